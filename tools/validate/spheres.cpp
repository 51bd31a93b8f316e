// Spheres that stay in their place: drag in a stream, torque in a spin, a shell that must be tight, a random bed.
#include <fmt/format.h>

#include <memory>
#include <numbers>
#include <random>

#include "validate/arrays.h"
#include "validate/check.h"
#include "validate/flow_start.h"

namespace coral::validate {

namespace {

using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

/// A quarter of a stream along z past a sphere of diameter 1 in the edge of two planes of symmetry; speed 1.
struct Stream {
    fluid::Flow flow;
    fluid::ImmersedBodies bodies;
    std::vector<fluid::RigidMotion> motions;
    double force = 0;

    Stream(double reynolds, int cells, double half_width, double upstream, double downstream)
        : flow(domain(cells, half_width, upstream, downstream), liquid(reynolds)), bodies(flow.grid()), motions(1)
    {
        motions[0].position = {0, 0, upstream};
        bodies.add(fluid::sphere_shape(1), motions[0]);
        bodies.place(motions);
        flow.set_velocity([](const Vector3d&, int axis) { return axis == 2 ? 1.0 : 0.0; });
    }
    static fluid::GridSpec domain(int cells, double half_width, double upstream, double downstream)
    {
        fluid::GridSpec grid;
        grid.cell = 1.0 / cells;
        grid.cells = (Vector3d(half_width, half_width, upstream + downstream) * cells).array().round().cast<int>();
        grid.boundary[fluid::z_minus] = {fluid::BoundaryKind::inlet, Vector3d(0, 0, 1), 0};
        grid.boundary[fluid::z_plus].kind = fluid::BoundaryKind::outlet;
        return grid;
    }
    static fluid::FlowOptions liquid(double reynolds)
    {
        fluid::FlowOptions options = flow_options();
        options.density = 1;
        options.kinematic_viscosity = 1 / reynolds;
        return options;
    }
    void step()
    {
        const double dt = flow.stable_time_step();
        flow.predict(dt);
        force = 4 * bodies.measure(flow, dt, motions)[0].force.z();
        bodies.apply(flow, motions);
        flow.project(dt);
    }
    double drag_coefficient() const { return force / (pi / 8); }
    /// Until the drag changes by less than 2e-4 in the time that the stream takes past the sphere.
    void settle(double shortest)
    {
        double last = 0, time = 0, next = 1;
        for (; time < 40; time += flow.stable_time_step()) {
            step();
            if (time < next) continue;
            if (time > shortest && std::abs(drag_coefficient() / last - 1) < 2e-4) break;
            last = drag_coefficient();
            next += 1;
        }
    }
};

/// C_D = 24/Re (1 + 0.1935 Re^0.6305), 20 < Re < 260 [Clift, Grace & Weber 1978, table 5.12].
double drag_of_clift(double reynolds) { return 24 / reynolds * (1 + 0.1935 * std::pow(reynolds, 0.6305)); }

}  // namespace

std::vector<Check> fixed_sphere(const StudyOptions& options)
{
    std::vector<Check> checks;
    for (const double reynolds : {20.0, 50.0, 100.0}) {
        std::unique_ptr<Stream> coarse;
        const auto run = [&](int cells, double half_width, double upstream, double downstream, double tolerance, const char* box) {
            const double begin = processor_seconds();
            auto stream = std::make_unique<Stream>(reynolds, cells, half_width, upstream, downstream);
            if (coarse) start_from(coarse->flow, stream->flow);
            stream->settle(coarse ? 3 : 12);
            checks.push_back({fmt::format("drag coefficient, Re = {}, box {}", reynolds, box), "1", drag_of_clift(reynolds), stream->drag_coefficient(), tolerance, true,
                              "Clift, Grace & Weber 1978", static_cast<double>(cells), processor_seconds() - begin});
            coarse = std::move(stream);
        };
        run(5, 4, 4, 7, shown_only, "8 x 8 x 11 d");
        run(10, 4, 4, 7, 0.10, "8 x 8 x 11 d");
        if (!options.heavy) continue;
        run(15, 4, 4, 7, shown_only, "8 x 8 x 11 d");
        run(20, 4, 4, 7, 0.05, "8 x 8 x 11 d");
        coarse.reset();
        run(10, 7, 7, 11, shown_only, "14 x 14 x 18 d");
    }
    return checks;
}

/// Torque of a slowly turning sphere in a periodic cube: 8 pi mu a^3 omega/(1 - c). The lattice of torques turns the fluid at the sphere by
/// -T/(6 mu V); the next term is of order c^(10/3).
std::vector<Check> rotating_sphere(const StudyOptions& options)
{
    std::vector<Check> checks;
    const double edge = 2.5, c = pi / 6 / (edge * edge * edge);
    for (const int cells : {6, 10, 14, 20}) {
        if (cells > 14 && !options.heavy) continue;
        const double begin = processor_seconds();
        fluid::GridSpec grid;
        grid.cells.setConstant(static_cast<int>(std::lround(edge * cells)));
        grid.cell = edge / grid.cells.x();
        for (fluid::Boundary& side : grid.boundary) side.kind = fluid::BoundaryKind::periodic;
        fluid::FlowOptions liquid = flow_options();
        liquid.density = liquid.kinematic_viscosity = 1;
        liquid.convection = fluid::Convection::none;
        fluid::Flow flow(grid, liquid);
        fluid::ImmersedBodies bodies(grid);
        std::vector<fluid::RigidMotion> motions(1);
        motions[0].position = edge * Vector3d(0.5131, 0.4863, 0.5072);
        motions[0].angular_velocity = Vector3d(0.3, -0.5, 0.8);
        bodies.add(fluid::sphere_shape(1), motions[0]);
        bodies.place(motions);
        double torque = 0;
        const int window = std::max(50, grid.cells.x() * grid.cells.x() / 10);
        for (double last = 1; std::abs(torque / last - 1) > 2e-4;) {
            last = torque;
            for (int s = 0; s < window; ++s) {
                const double dt = flow.stable_time_step();
                flow.predict(dt);
                torque = bodies.measure(flow, dt, motions)[0].torque.norm();
                bodies.apply(flow, motions);
                flow.project(dt);
            }
        }
        const double expected = pi * motions[0].angular_velocity.norm() / (1 - c);
        checks.push_back({"torque of a turning sphere", "N m", expected, torque, cells < 10 ? shown_only : 0.03, true, "8 pi mu a^3 omega/(1 - c)", cells * 1.0, processor_seconds() - begin});
    }
    return checks;
}

/// A closed shell in a stream at Re 100: the speed inside must vanish. The wall's thickness is given in cells.
std::vector<Check> closed_shell(const StudyOptions& options)
{
    std::vector<Check> checks;
    for (const int cells : {12, 20, 32})
        for (const double wall : {1.0, 2.0, 3.0}) {
            if (cells > 20 && !options.heavy) continue;
            const double begin = processor_seconds();
            Stream stream(100, cells, 1.5, 1.5, 2);
            fluid::BodyShape shell = fluid::sphere_shape(1);
            const double thickness = wall / cells;
            shell.distance = [thickness](std::span<const Vector3d> points, std::span<double> distances) {
                for (std::size_t p = 0; p < points.size(); ++p) distances[p] = std::abs(points[p].norm() - 0.5 + 0.5 * thickness) - 0.5 * thickness;
            };
            stream.bodies = fluid::ImmersedBodies(stream.flow.grid());
            stream.bodies.add(shell, stream.motions[0]);
            stream.bodies.place(stream.motions);
            double time = 0;
            for (; time < 8; time += stream.flow.stable_time_step()) stream.step();
            double inside = 0;
            const Eigen::Vector3i n = stream.flow.grid().cells;
            for (int k = 0; k < n.z(); ++k)
                for (int j = 0; j < n.y(); ++j)
                    for (int i = 0; i < n.x(); ++i)
                        if ((stream.flow.cell_centre(i, j, k) - stream.motions[0].position).norm() < 0.5 - thickness - 1.0 / cells)
                            inside = std::max(inside, stream.flow.cell_velocity(i, j, k).norm());
            checks.push_back({fmt::format("speed in a closed shell, wall of {} cells", wall), "1", 0, inside, wall < 2 || cells < 20 ? shown_only : 1e-3, false, "impermeable", cells * 1.0,
                              processor_seconds() - begin});
        }
    return checks;
}

namespace {

/// Moves of one sphere at a time that leave it free of the others, `rounds` for each [Metropolis et al. 1953]: spheres that were pushed apart still
/// touch in clusters, between which a flow finds wide ways; the beds of the reference were at random like a gas of hard spheres.
void stir(std::vector<Vector3d>& x, double diameter, int rounds, unsigned seed)
{
    std::mt19937_64 random(seed);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    const double longest = 0.1 * diameter;
    for (std::size_t move = 0; move < static_cast<std::size_t>(rounds) * x.size(); ++move) {
        const auto a = static_cast<std::size_t>(random() % x.size());
        const Vector3d to = x[a] + longest * Vector3d(2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1);
        bool free = true;
        for (std::size_t b = 0; b < x.size() && free; ++b) {
            Vector3d r = to - x[b];
            r -= r.array().round().matrix();
            free = a == b || r.squaredNorm() >= diameter * diameter;
        }
        if (free) x[a] = to;
    }
}

/// Centres of equal spheres in a periodic unit cube, at random and not overlapping: random points, pushed apart pair by pair.
std::vector<Vector3d> random_packing(int count, double diameter, unsigned seed)
{
    std::mt19937_64 random(seed);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    std::vector<Vector3d> x(static_cast<std::size_t>(count));
    for (Vector3d& point : x)
        for (double& value : point) value = unit();
    const double reach = 1.002 * diameter;
    for (int round = 0; round < 200000; ++round) {
        double deepest = 0;
        for (std::size_t a = 0; a < x.size(); ++a)
            for (std::size_t b = 0; b < a; ++b) {
                Vector3d r = x[a] - x[b];
                r -= r.array().round().matrix();
                const double overlap = reach - r.norm();
                if (overlap <= 0) continue;
                deepest = std::max(deepest, overlap);
                x[a] += 0.5 * overlap * r.normalized();
                x[b] -= 0.5 * overlap * r.normalized();
            }
        if (deepest < 0.002 * diameter) break;
    }
    return x;
}

}  // namespace

/// Two beds of 27 spheres each. The target is the law fitted to lattice-Boltzmann beds, good to 3 %; Carman & Kozeny's is shown beside it.
std::vector<Check> random_bed(const StudyOptions& options)
{
    std::vector<Check> checks;
    for (const double c : {0.4, 0.5, 0.58}) {
        const int count = 27;
        const double diameter = std::cbrt(6 * c / (pi * count));
        // F = (1 - c) F_total/(3 pi mu d U); F_total/(6 pi mu a U) is what an array calls K
        const double fitted = 10 * c / ((1 - c) * (1 - c)) + (1 - c) * (1 - c) * (1 + 1.5 * std::sqrt(c));
        for (const double wanted : {8.0, 12.0, 16.0, 24.0}) {
            if (wanted > 12 && !options.heavy) continue;
            const double begin = processor_seconds();
            const int cells = static_cast<int>(std::lround(wanted / diameter));
            double sum = 0;
            for (const unsigned seed : {1U, 2U}) {
                std::vector<Vector3d> centres = random_packing(count, diameter, seed);
                stir(centres, diameter, 5000, seed);
                ArrayFlow bed(centres, diameter, cells);
                sum += bed.settle(3e-4) / 2;
            }
            const double permeability = 1 / (18 * c * sum), kozeny = std::pow(1 - c, 3) / (180 * c * c);  // over d^2
            const double seconds = processor_seconds() - begin, resolution = cells * diameter;
            checks.push_back({fmt::format("drag in random beds, c = {}", c), "1", fitted, (1 - c) * sum, wanted < 12 ? shown_only : 0.05, true, "van der Hoef et al. 2005", resolution, seconds});
            checks.push_back({fmt::format("permeability / d^2, c = {}", c), "1", kozeny, permeability, shown_only, true,
                              "Carman & Kozeny, (1 - c)^3/(180 c^2)", resolution, seconds});
        }
    }
    return checks;
}

}  // namespace coral::validate
