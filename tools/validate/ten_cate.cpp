// Sphere settling in a closed tank of oil: ten Cate, Nieuwstad, Derksen & Van den Akker, Phys. Fluids 14(11) 4012 (2002).
#include <fmt/format.h>

#include <numbers>
#include <span>

#include "core/table.h"
#include "fluid/immersed.h"
#include "validate/check.h"

namespace coral::validate {

namespace {

using Eigen::Vector3d;

/// One oil of the experiment and the greatest speed measured in it.
struct Oil {
    const char* name;
    double density, dynamic_viscosity, peak, longest;  // kg/m3, Pa s, m/s, s
};
constexpr Oil oils[] = {{"E4", 960, 0.058, 0.1226, 1.4}, {"E3", 962, 0.113, 0.0869, 1.9}, {"E2", 965, 0.212, 0.0571, 2.8}, {"E1", 970, 0.373, 0.0363, 4.2}};
constexpr double diameter = 0.015, sphere_density = 1120, tank = 0.1, height = 0.16, start = 0.1275;

struct Fall {
    std::vector<double> time, position, velocity;
    double peak = 0, seconds = 0, resolution = 0, momentum_error = 0;
};

/// A quarter of the tank between two planes of symmetry, the sphere in their edge.
fluid::GridSpec quarter_tank(int cells)
{
    fluid::GridSpec grid;
    grid.cell = 0.5 * tank / cells;
    // The lid stands up to half a cell off; it is a diameter and a half away from where the sphere starts.
    grid.cells = {cells, cells, static_cast<int>(std::lround(height / grid.cell))};
    for (fluid::Boundary& side : grid.boundary) side.kind = fluid::BoundaryKind::wall;
    grid.boundary[fluid::x_minus].kind = grid.boundary[fluid::y_minus].kind = fluid::BoundaryKind::slip;
    return grid;
}

/// From rest until the sphere is within a tenth of its diameter of the floor. There is no contact model here: none is in reach.
Fall let_fall(const Oil& oil, int cells)
{
    Fall fall;
    const double begin = processor_seconds();
    const fluid::GridSpec grid = quarter_tank(cells);
    fluid::FlowOptions options = flow_options();
    options.density = oil.density;
    options.kinematic_viscosity = oil.dynamic_viscosity / oil.density;
    options.max_time_step = 1e-3;
    fluid::Flow flow(grid, options);
    fluid::ImmersedBodies bodies(grid);
    std::vector<fluid::RigidMotion> motions(1);
    motions[0].position = {0, 0, start};
    bodies.add(fluid::sphere_shape(diameter), motions[0]);
    bodies.place(motions);
    const double volume = 0.25 * std::numbers::pi / 6 * std::pow(diameter, 3), m_p = sphere_density * volume, m_f = oil.density * volume;
    double& v = motions[0].velocity.z();
    double& z = motions[0].position.z();
    for (double t = 0; t < oil.longest && z > 0.6 * diameter;) {
        const double dt = flow.stable_time_step();
        flow.predict(dt);
        const fluid::FluidAction action = bodies.measure(flow, dt, motions)[0];
        v += dt * (action.force.z() - (m_p - m_f) * 9.81) / (m_p + action.forced_mass.z() - m_f);  // docs/numerics.md, eq. 11
        z += dt * v;
        bodies.apply(flow, motions);
        flow.project(dt);
        bodies.place(motions);
        t += dt;
        fall.time.push_back(t), fall.position.push_back(z), fall.velocity.push_back(v);
        fall.peak = std::max(fall.peak, -v);
        fall.momentum_error = std::max(fall.momentum_error, flow.momentum().relative_error());
    }
    fall.resolution = diameter / grid.cell;
    fall.seconds = processor_seconds() - begin;
    return fall;
}

void write_curve(const std::filesystem::path& file, const Fall& fall)
{
    Table table{{"time", "gap_over_diameter", "velocity"}, {}};
    const std::size_t stride = std::max<std::size_t>(1, fall.time.size() / 400);
    for (std::size_t n = 0; n < fall.time.size(); n += stride) table.add({fall.time[n], (fall.position[n] - 0.5 * diameter) / diameter, fall.velocity[n]});
    table.write(file);
}

/// Root mean square distance of the measured points of E4 from the curve, over the peak. The last ones, where the sphere brakes within a tenth of a second,
/// are left out: there the reading of the time axis (about 0.05 s) decides.
double distance_from_points(const Fall& fall, const std::filesystem::path& file)
{
    const Table points = read_table(file);
    double sum = 0;
    int count = 0;
    for (const auto& row : points.rows) {
        const double t = std::get<double>(row[0]), v = std::get<double>(row[1]);
        if (t > 1.1) continue;
        const auto after = std::ranges::lower_bound(fall.time, t);
        if (after == fall.time.end()) continue;
        const double difference = fall.velocity[static_cast<std::size_t>(after - fall.time.begin())] - v;
        sum += difference * difference;
        ++count;
    }
    return std::sqrt(sum / count) / oils[0].peak;
}

}  // namespace

std::vector<Check> ten_cate_tank(const StudyOptions& options)
{
    std::vector<Check> checks;
    for (const Oil& oil : oils)
        for (const int cells : {20, 27, 40, 54}) {
            if (cells > 27 && !options.heavy) continue;
            const Fall fall = let_fall(oil, cells);
            const double tolerance = cells >= 54 ? 0.03 : cells == 27 ? 0.04 : shown_only;
            const std::string name = std::string("ten Cate ") + oil.name;
            checks.push_back({name + ", greatest speed", "m/s", oil.peak, fall.peak, tolerance, true, "ten Cate et al. 2002, measured", fall.resolution, fall.seconds});
            checks.push_back({name + ", momentum balance", "1", 0, fall.momentum_error, balance_tolerance(1e-8), false, "conservation", fall.resolution, fall.seconds});
            write_curve(options.output / fmt::format("ten-cate-{}-{}.csv", oil.name, cells), fall);
            if (&oil == &oils[0])
                checks.push_back({name + ", velocity against points, rms / peak", "1", 0, distance_from_points(fall, options.scenes / "reference/ten-cate-e4.csv"), 0.04, false,
                                  "ten Cate et al. 2002, digitised to 2-3 %", fall.resolution, fall.seconds});
        }
    return checks;
}

}  // namespace coral::validate
