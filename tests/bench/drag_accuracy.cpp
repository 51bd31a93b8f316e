// Speed against error of resolved grains: cells per diameter against the drag of a periodic array of spheres in Stokes flow.
// Truth: simple cubic array, F = 6 pi mu a K U, K = 7.442 at solid fraction 0.216 and 15.4 at 0.343 [Zick and Homsy 1982, Table 2].
#include <cmath>
#include <numbers>

#include "bench/table.h"
#include "fluid/immersed.h"

namespace {

using namespace coral::fluid;
using Eigen::Vector3d;

struct Outcome {
    double K, seconds, step_seconds;
    int steps;
};

Outcome run(double solid_fraction, int cells, bool plain_blend)
{
    const double length = 0.01, pi = std::numbers::pi;
    GridSpec grid;
    grid.cells.setConstant(cells);
    grid.cell = length / cells;
    for (Boundary& side : grid.boundary) side.kind = BoundaryKind::periodic;
    FlowOptions options;
    options.kinematic_viscosity = 1e-4;
    options.convection = Convection::none;
    options.body_acceleration = {1e-3, 0, 0};
    ForcingOptions forcing;
    forcing.plain_blend = plain_blend;
    Flow flow(grid, options);
    ImmersedBodies bodies(grid, forcing);
    const double radius = 0.5 * length * std::cbrt(6 * solid_fraction / pi);
    RigidMotion motion;
    motion.position = length * Vector3d(0.513, 0.486, 0.507);
    const std::vector<RigidMotion> motions{motion};
    bodies.add(sphere_shape(2 * radius), motion);
    bodies.place(motions);
    Outcome out{0, 0, 0, 0};
    double K = 0;
    out.seconds = coral::bench::seconds([&] {
        // Steady when the drag factor stands still: both force and velocity then follow one slow mode.
        for (double last = 1; out.steps < 4000; ++out.steps) {
            const double dt = flow.stable_time_step();
            flow.predict(dt);
            const double force = bodies.measure(flow, dt, motions)[0].force.x();
            bodies.apply(flow, motions);
            flow.project(dt);
            K = force / (6 * pi * options.density * options.kinematic_viscosity * radius * flow.mean_superficial_velocity().x());
            if (out.steps % 50 == 49) {
                if (std::abs(K / last - 1) < 2e-4) break;
                last = K;
            }
        }
    });
    out.K = K;
    out.step_seconds = out.seconds / std::max(1, out.steps);
    return out;
}

}  // namespace

int main()
{
    struct Case {
        double solid_fraction, K;
    };
    coral::bench::heading("Drag of a periodic array of spheres: cells per diameter against error and cost",
                          {"solid fraction", "cells / diameter", "drag error", "paper's blend", "steps", "seconds", "us / cell step"});
    for (const Case& c : {Case{0.216, 7.442}, Case{0.343, 15.4}})
        for (int cells : {8, 11, 16, 22, 30}) {
            const double diameter = cells * std::cbrt(6 * c.solid_fraction / std::numbers::pi);
            const Outcome ours = run(c.solid_fraction, cells, false), plain = run(c.solid_fraction, cells, true);
            coral::bench::line({c.solid_fraction, diameter, ours.K / c.K - 1, plain.K / c.K - 1, static_cast<double>(ours.steps), ours.seconds,
                                1e6 * ours.step_seconds / std::pow(cells, 3)});
        }
}
