// Fines felt through the kernel: one falling alone, Ergun's bed without and with walls, and one sphere computed both ways.
#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "fluid/fine_force.h"
#include "fluid/immersed.h"
#include "validate/bed.h"
#include "validate/check.h"

namespace coral::validate {

namespace {

using Eigen::Vector3d;
using namespace fluid;
constexpr double pi = std::numbers::pi, water_density = 1000, water_viscosity = 1e-6;

/// Spheres in a flow, either held or falling along z under their weight in water.
struct Suspension {
    std::vector<Vector3d> positions, velocities;
    double diameter;
    Flow flow;
    FineCoupling coupling;
    std::vector<FeltFlow> felt{};
    std::vector<double> coefficients{};
    std::vector<Vector3d> forces{};  ///< total on each, hydrostatic part left out [N]

    Suspension(const GridSpec& grid, const FlowOptions& options, std::vector<Vector3d> places, double d, const KernelOptions& kernel = {})
        : positions(std::move(places)), velocities(positions.size(), Vector3d::Zero()), diameter(d), flow(grid, options), coupling(grid, kernel)
    {
    }
    double volume() const { return pi / 6 * diameter * diameter * diameter; }
    void step(double dt)
    {
        const std::size_t n = positions.size();
        const std::vector<double> diameters(n, diameter), volumes(n, volume());
        const FlowOptions& fluid = flow.options();
        felt.resize(n), coefficients.resize(n), forces.resize(n);
        coupling.place(positions, diameters, nullptr);
        coupling.deposit_volume(flow, volumes, velocities);
        coupling.feel(flow, felt);
        for (std::size_t i = 0; i < n; ++i) {
            const FineForce f = fine_force(DragLaw::gidaspow, {velocities[i], diameter, volumes[i], {}}, felt[i], fluid.density, fluid.kinematic_viscosity);
            coefficients[i] = f.coefficient, forces[i] = f.force;
        }
        std::vector<Vector3d> lag(n);
        coupling.deposit_drag(flow, coefficients, forces);
        flow.predict(dt);
        coupling.drag_lag(flow, coefficients, lag);
        flow.project(dt);
        for (std::size_t i = 0; i < n; ++i) forces[i] += lag[i] - fluid.density * volumes[i] * felt[i].pressure_gradient;
    }
};

/// Mean of a quantity over a span of time.
struct TimeMean {
    double sum = 0, span = 0;
    void add(double value, double dt) { sum += value * dt, span += dt; }
    double value() const { return sum / span; }
};

/// Speed at which the drag of one sphere carries its weight in water.
double terminal_speed(double d, double density)
{
    const double weight = (density - water_density) * pi / 6 * d * d * d * 9.81;
    double low = 0, high = 10;
    for (int i = 0; i < 100; ++i) {
        const double v = 0.5 * (low + high);
        (drag_coefficient(DragLaw::schiller_naumann, 1, v, d, water_density, water_viscosity) * v < weight ? low : high) = v;
    }
    return low;
}

/// Falls 14 diameters (or cells, where these are larger) through a closed column 12 wide with slip sides; mean of the last six.
double falling_speed(double d, double cells_per_diameter, SelfDisturbance self)
{
    const double density = 2780, h = d / cells_per_diameter, length = std::max(d, h);
    GridSpec grid;
    grid.cell = h;
    grid.cells.setConstant(4 * static_cast<int>(std::lround(3 * length / h)));
    grid.cells.z() = 4 * static_cast<int>(std::lround(6.5 * length / h));
    grid.boundary[z_minus].kind = grid.boundary[z_plus].kind = BoundaryKind::wall;
    KernelOptions kernel;
    kernel.self_disturbance = self;
    const Vector3d start = grid.size().cwiseProduct(Vector3d(0.5, 0.5, 1)) + Vector3d(0.21 * h, -0.13 * h, -6 * length);
    Suspension s(grid, flow_options(), {start}, d, kernel);
    s.velocities[0].z() = -terminal_speed(d, density);
    const double mass = density * s.volume(), weight = (density - water_density) * s.volume() * 9.81;
    TimeMean speed;
    for (double fallen = 0; fallen < 14 * length; fallen = start.z() - s.positions[0].z()) {
        double& v = s.velocities[0].z();
        const double dt = std::min({s.flow.stable_time_step(), 0.3 * h / std::abs(v), 1e-3});
        s.step(dt);
        s.positions[0].z() += dt * v;
        v += dt * (s.forces[0].z() - weight) / (mass + dt * s.coefficients[0]);  // drag at the new speed, to first order
        if (fallen > 8 * length) speed.add(-v, dt);
    }
    return speed.value();
}

/// Void fraction of a periodic bed like the paper's: 3380 spheres of 10 mm in 0.15 x 0.15 x 0.155 m.
constexpr double bed_void_fraction = 0.4925, bed_diameter = 0.01;

/// Viscous beds take a fluid a hundred times more viscous than water, so that steps are not bound by the flow's own time.
double bed_viscosity(double reynolds)
{
    return reynolds < 30 ? 1e-4 : 1e-6;
}

/// Pressure gradient over Ergun's at the superficial velocity that it drives through a periodic cube of spheres.
double periodic_bed(double reynolds, int cells_per_diameter, unsigned seed)
{
    const int count = 512;
    const double d = bed_diameter, nu = bed_viscosity(reynolds), L = d * std::cbrt(count * pi / 6 / (1 - bed_void_fraction));
    const double U = reynolds * nu / d, gradient = ergun_pressure_gradient(bed_void_fraction, U, d, water_density, nu);
    GridSpec grid;
    grid.cells.setConstant(4 * static_cast<int>(std::lround(0.25 * L / d * cells_per_diameter)));
    grid.cell = L / grid.cells.x();
    for (Boundary& side : grid.boundary) side.kind = BoundaryKind::periodic;
    FlowOptions options = flow_options();
    options.kinematic_viscosity = nu;
    options.body_acceleration = {0, 0, gradient / water_density};
    Suspension s(grid, options, random_spheres(count, d, Vector3d::Constant(L), true, seed), d);
    s.flow.set_velocity([&](const Vector3d&, int axis) { return axis == 2 ? U / bed_void_fraction : 0.0; });
    const double duration = reynolds < 30 ? 0.4 * d * d / nu : 12 * d * bed_void_fraction / U;
    TimeMean velocity;
    for (double t = 0; t < duration;) {
        const double dt = s.flow.stable_time_step();
        s.step(dt);
        t += dt;
        if (t > 0.5 * duration) velocity.add(s.flow.mean_superficial_velocity().z(), dt);
    }
    return gradient / ergun_pressure_gradient(bed_void_fraction, velocity.value(), d, water_density, nu);
}

struct WalledBed {
    double pressure_ratio;         ///< drop over Ergun's at the bed's own porosity and height
    double void_core, void_wall;   ///< cells farther than two diameters from the sides, and within half of one
    double speed_core, speed_wall; ///< superficial, over the mean
};

/// The paper's bed in its box with slip sides, flow from below; a diameter and a half of free water at both ends.
WalledBed walled_bed(double reynolds, int cells_per_diameter)
{
    const double d = bed_diameter, nu = bed_viscosity(reynolds), h = d / cells_per_diameter, U = reynolds * nu / d, free = 2 * d;
    const Vector3d box(0.15, 0.15, 0.155);
    GridSpec grid;
    grid.cell = h;
    grid.cells = {static_cast<int>(std::lround(box.x() / h)), static_cast<int>(std::lround(box.y() / h)), static_cast<int>(std::lround((box.z() + 2 * free) / h / 2)) * 2};
    grid.origin.z() = -free;
    grid.boundary[z_minus] = {BoundaryKind::inlet, {0, 0, U}, 0};
    grid.boundary[z_plus].kind = BoundaryKind::outlet;
    FlowOptions options = flow_options();
    options.kinematic_viscosity = nu;
    Suspension s(grid, options, random_spheres(3380, d, box, false, 1), d);
    s.flow.set_velocity([&](const Vector3d&, int axis) { return axis == 2 ? U : 0.0; });
    const double duration = reynolds < 30 ? 0.4 * d * d / nu : 0.5 * box.z() / U;
    TimeMean drop;
    for (double t = 0; t < duration;) {
        const double dt = s.flow.stable_time_step();
        s.step(dt);
        t += dt;
        if (t > 0.6 * duration) drop.add(s.flow.mean_boundary_pressure(z_minus) * water_density, dt);
    }
    WalledBed bed{drop.value() / (box.z() * ergun_pressure_gradient(bed_void_fraction, U, d, water_density, nu)), 0, 0, 0, 0};
    double core = 0, wall = 0;
    const FlowField& eps = s.flow.porous_fields().void_fraction;
    for (int k = 0; k < grid.cells.z(); ++k)
        for (int j = 0; j < grid.cells.y(); ++j)
            for (int i = 0; i < grid.cells.x(); ++i) {
                const Vector3d x = s.flow.cell_centre(i, j, k);
                if (x.z() < 2 * d || x.z() > box.z() - 2 * d) continue;
                const double side = std::min({x.x(), box.x() - x.x(), x.y(), box.y() - x.y()}), e = eps[s.flow.layout().index(i, j, k)];
                const double q = e * s.flow.cell_velocity(i, j, k).z() / U;
                if (side > 2 * d) core += 1, bed.void_core += e, bed.speed_core += q;
                if (side < 0.5 * d) wall += 1, bed.void_wall += e, bed.speed_wall += q;
            }
    bed.void_core /= core, bed.speed_core /= core, bed.void_wall /= wall, bed.speed_wall /= wall;
    return bed;
}

/// Drag of one held sphere in a stream of Reynolds number 100 over that of Schiller and Naumann, resolved or through the kernel. In free water the stream is
/// eight diameters wide, in the duct two: the undisturbed flow then differs from the mean by the blockage, which a kernel cannot see.
double held_sphere(double cells_per_diameter, double width, bool resolved)
{
    const double d = 1e-3, h = d / cells_per_diameter, U = 100 * water_viscosity / d;
    GridSpec grid;
    grid.cell = h;
    grid.cells.setConstant(2 * static_cast<int>(std::lround(0.5 * width * cells_per_diameter)));
    grid.cells.z() = 4 * static_cast<int>(std::lround(2.75 * cells_per_diameter));
    grid.boundary[z_minus] = {BoundaryKind::inlet, {0, 0, U}, 0};
    grid.boundary[z_plus].kind = BoundaryKind::outlet;
    const Vector3d place = grid.size().cwiseProduct(Vector3d(0.5, 0.5, 0)) + Vector3d(0.21 * h, -0.13 * h, 4.1 * d);
    Suspension s(grid, flow_options(), resolved ? std::vector<Vector3d>{} : std::vector<Vector3d>{place}, d);
    ImmersedBodies bodies(grid);
    std::vector<RigidMotion> motions(resolved ? 1 : 0);
    if (resolved) motions[0].position = place, bodies.add(sphere_shape(d), motions[0]), bodies.place(motions);
    s.flow.set_velocity([&](const Vector3d&, int axis) { return axis == 2 ? U : 0.0; });
    TimeMean force;
    for (double t = 0, end = 12 * d / U; t < end;) {
        const double dt = s.flow.stable_time_step();
        double now = 0;
        if (resolved) {
            s.flow.predict(dt);
            now = bodies.measure(s.flow, dt, motions)[0].force.z();
            bodies.apply(s.flow, motions);
            s.flow.project(dt);
        } else {
            s.step(dt);
            now = s.forces[0].z();
        }
        t += dt;
        if (t > 0.7 * end) force.add(now, dt);
    }
    return force.value() / (U * drag_coefficient(DragLaw::schiller_naumann, 1, U, d, water_density, water_viscosity));
}

/// Times a row.
template <class Work>
Check timed(Check check, const Work& work)
{
    const double begin = processor_seconds();
    check.value = work();
    check.seconds = processor_seconds() - begin;
    return check;
}

}  // namespace

std::vector<Check> falling_fine(const StudyOptions& options)
{
    std::vector<Check> rows;
    for (const double d : {2e-4, 5e-4, 2e-3})
        for (const double ratio : {1.0 / 3, 1.0, 3.0, 6.0}) {
            if (ratio > 3 && d < 5e-4) continue;  // thousands of viscous steps
            if (ratio > 3 && d < 2e-3 && !options.heavy) continue;
            const double target = terminal_speed(d, 2780);
            for (const auto& [self, name] : {std::pair{SelfDisturbance::removed, ""}, {SelfDisturbance::volume_removed, ", own volume removed only"}, {SelfDisturbance::kept, ", plain kernel means"}})
                rows.push_back(timed({fmt::format("fall of {} mm, Re {:.0f}{}", 1e3 * d, target * d / water_viscosity, name), "m/s", target, 0,
                                      self == SelfDisturbance::removed ? 0.03 : shown_only, true, "Schiller and Naumann 1933", ratio},
                                     [&, &chosen = self] { return falling_speed(d, ratio, chosen); }));
        }
    return rows;
}

std::vector<Check> ergun_bed(const StudyOptions& options)
{
    std::vector<Check> rows;
    for (const double reynolds : {1.0, 10.0, 100.0, 1000.0})
        for (const int ratio : {1, 3, 6}) {
            if (ratio == 6 && reynolds > 1 && reynolds < 1000 && !options.heavy) continue;
            const double tolerance = reynolds == 1 ? 0.07 : reynolds == 1000 ? 0.03 : shown_only;
            rows.push_back(timed({fmt::format("gradient in a periodic bed, Re {:.0f}", reynolds), "1", 1, 0, tolerance, true, "Ergun 1952", double(ratio)},
                                 [&] { return periodic_bed(reynolds, ratio, 1); }));
        }
    for (const unsigned seed : {2u, 3u})
        for (const double reynolds : {1.0, 1000.0})
            rows.push_back(timed({fmt::format("the same, Re {:.0f}, bed number {}", reynolds, seed), "1", 1, 0, reynolds == 1 ? 0.07 : 0.03, true, "Ergun 1952", 3},
                                 [&] { return periodic_bed(reynolds, 3, seed); }));
    return rows;
}

std::vector<Check> ergun_walls(const StudyOptions& options)
{
    std::vector<Check> rows;
    for (const double reynolds : {1.0, 100.0, 1000.0})
        for (const int ratio : {1, 3, 6}) {
            if (ratio == 6 && !options.heavy) continue;
            WalledBed bed{};
            rows.push_back(timed({fmt::format("pressure drop, Re {:.0f}", reynolds), "1", 1, 0, reynolds < 100 ? shown_only : 0.12, true, "Ergun 1952", double(ratio)}, [&] {
                bed = walled_bed(reynolds, ratio);
                return bed.pressure_ratio;
            }));
            for (const auto& [what, target, value] : {std::tuple{"void fraction in the core", bed_void_fraction, bed.void_core}, {"void fraction along the walls", bed_void_fraction, bed.void_wall},
                                                      {"superficial speed in the core over the mean", 1.0, bed.speed_core}, {"superficial speed along the walls over the mean", 1.0, bed.speed_wall}})
                if (std::isfinite(value))  // with one cell per diameter no cell centre lies in the layer along the walls
                    rows.push_back({what, "1", target, value, shown_only, true, "of the whole bed", double(ratio), rows.back().seconds});
        }
    return rows;
}

std::vector<Check> two_schemes(const StudyOptions& options)
{
    std::vector<Check> rows;
    for (const double width : {8.0, 2.0}) {
        const double fine_ratio = options.heavy && width < 8 ? 24 : 16;
        const double truth = width < 8 ? held_sphere(fine_ratio, width, true) : 1;
        for (const double ratio : {2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 16.0})
            for (const bool resolved : {true, false}) {
                if (width == 8 && ratio > 12 && !options.heavy) continue;
                rows.push_back(timed({fmt::format("{}, {}", width < 8 ? "sphere in a duct 2 d wide" : "sphere in free water", resolved ? "resolved" : "kernel"), "1", truth, 0, shown_only, true,
                                      width < 8 ? fmt::format("resolved, {:.0f} cells", fine_ratio) : "Schiller and Naumann 1933", ratio},
                                     [&] { return held_sphere(ratio, width, resolved); }));
            }
    }
    return rows;
}

}  // namespace coral::validate
