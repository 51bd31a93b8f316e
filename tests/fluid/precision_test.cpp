#include <gtest/gtest.h>

#include "core/parallel.h"
#include "fines_scene.h"

using namespace coral::fluid;
using namespace coral::fluid::test;
using Eigen::Vector3d;

namespace {

/// A grain on its way through a stream, fines around it.
struct Stream {
    GridSpec grid;
    Flow flow;
    ImmersedBodies bodies;
    FineCoupling coupling;
    std::vector<RigidMotion> motions{at(Vector3d(8e-3, 7e-3, 9e-3), Vector3d(2e-3, 0.0, -5e-3))};
    Fines fines;

    Stream(Precision precision, TimeScheme scheme) : grid(channel()), flow(grid, options(precision, scheme)), bodies(grid), coupling(grid)
    {
        fines = random_fines(grid, 150, 1.2e-3, 2.5e-3, 0.02, 17);
        bodies.add(sphere_shape(9e-3), motions[0]);
        bodies.place(motions);
    }
    static GridSpec channel()
    {
        GridSpec grid = box({16, 14, 20}, 1e-3, BoundaryKind::slip);
        grid.boundary[z_plus] = {BoundaryKind::inlet, Vector3d(0.0, 0.0, -0.05), 0.0};
        grid.boundary[z_minus].kind = BoundaryKind::outlet;
        return grid;
    }
    static FlowOptions options(Precision precision, TimeScheme scheme)
    {
        FlowOptions options;
        options.precision = precision;
        options.scheme = scheme;
        return options;
    }
    void advance(int steps)
    {
        for (int step = 0; step < steps; ++step) {
            const double dt = flow.stable_time_step();
            fines.step(flow, coupling, dt, &bodies, motions);
            for (RigidMotion& motion : motions) motion.position += dt * motion.velocity;
            bodies.place(motions);
        }
    }
    /// Force on the grain, were the next step to begin now [N].
    Vector3d force()
    {
        Stream next = *this;
        const double dt = next.flow.stable_time_step();
        next.flow.predict(dt);
        return next.bodies.measure(next.flow, dt, motions)[0].force;
    }
    double pressure_drop() const { return flow.mean_boundary_pressure(z_plus) - flow.mean_boundary_pressure(z_minus); }

    Stream(const Stream& other) : grid(other.grid), flow(other.flow), bodies(other.grid), coupling(other.grid), motions(other.motions), fines(other.fines)
    {
        bodies.add(sphere_shape(9e-3), motions[0]);
        bodies.restore(other.bodies.placed_motions());
    }
};

constexpr TimeScheme both_schemes[] = {TimeScheme::adams_bashforth, TimeScheme::runge_kutta};

}  // namespace

TEST(SinglePrecision, tells_the_same_forces_and_pressure_as_double)
{
    for (const TimeScheme scheme : both_schemes) {
        Stream exact(Precision::float64, scheme), rounded(Precision::float32, scheme);
        exact.advance(60), rounded.advance(60);
        EXPECT_NEAR(rounded.pressure_drop() / exact.pressure_drop(), 1.0, 1e-5);
        EXPECT_LT((rounded.force() - exact.force()).norm(), 1e-5 * exact.force().norm());
        for (std::size_t i = 0; i < exact.fines.size(); ++i)
            EXPECT_LT((rounded.fines.forces[i] - exact.fines.forces[i]).norm(), 1e-4 * exact.fines.forces[i].norm()) << i;
    }
}

TEST(SinglePrecision, keeps_volume_and_momentum_to_six_digits)
{
    for (const TimeScheme scheme : both_schemes) {
        Stream stream(Precision::float32, scheme);
        for (int step = 0; step < 60; ++step) {
            stream.advance(1);
            EXPECT_LT(stream.flow.mass().relative_error(), 1e-5) << step;
            EXPECT_LT(stream.flow.momentum().relative_error(), 1e-5) << step;
        }
    }
}

TEST(SinglePrecision, has_the_same_bits_with_one_and_two_threads_and_after_a_restart)
{
    for (const TimeScheme scheme : both_schemes) {
        std::vector<FlowField> results;
        for (const int threads : {1, 2}) {
            coral::set_thread_count(threads);
            Stream whole(Precision::float32, scheme);
            whole.advance(10);
            Stream parts(Precision::float32, scheme);
            parts.flow.restore(whole.flow.save());
            parts.bodies.restore(whole.bodies.placed_motions());
            parts.motions = whole.motions, parts.fines = whole.fines;
            whole.advance(10), parts.advance(10);
            results.push_back(whole.flow.velocity(2));
            results.push_back(parts.flow.velocity(2));
        }
        for (const FlowField& result : results) EXPECT_EQ(result, results[0]);
    }
}

TEST(SinglePrecision, goes_on_from_a_state_in_double_and_back)
{
    Stream exact(Precision::float64, TimeScheme::runge_kutta), rounded(Precision::float32, TimeScheme::runge_kutta);
    exact.advance(20);
    rounded.flow.restore(exact.flow.save());
    EXPECT_EQ(rounded.flow.velocity(0).precision(), Precision::float32);
    for (std::size_t at = 0; at < exact.flow.layout().total; ++at)
        EXPECT_EQ(rounded.flow.velocity(2)[at], double(float(exact.flow.velocity(2)[at])));
    exact.flow.restore(rounded.flow.save());
    EXPECT_EQ(exact.flow.velocity(0).precision(), Precision::float64);
    for (std::size_t at = 0; at < exact.flow.layout().total; ++at) EXPECT_EQ(exact.flow.velocity(2)[at], rounded.flow.velocity(2)[at]);
}
