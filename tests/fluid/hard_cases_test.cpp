// Scenes that break a coupled flow solver: light bodies, no gap, no way out, sudden steps.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "core/error.h"
#include "fluid/scenes.h"

using namespace coral::fluid;
using namespace coral::fluid::test;
using Eigen::Vector3d;

namespace {

/// Duct along z, fed from above.
GridSpec duct(double speed)
{
    GridSpec grid = cube(12, 1e-3, BoundaryKind::slip);
    grid.cells.z() = 24;
    grid.boundary[z_plus] = {BoundaryKind::inlet, Vector3d(0, 0, -speed), 0.0};
    grid.boundary[z_minus].kind = BoundaryKind::outlet;
    return grid;
}

BodyShape box_shape(const Vector3d& half)
{
    BodyShape box;
    box.box_max = half, box.box_min = -half;
    box.distance = [half](std::span<const Vector3d> points, std::span<double> d) {
        for (std::size_t p = 0; p < points.size(); ++p) d[p] = (points[p].cwiseAbs() - half).maxCoeff();
    };
    return box;
}

struct Release {
    double last_speed = 0, roughness = 0, worst_balance = 0;
};

/// A sphere of 8 cells set free in a periodic box, its weight balanced by the box's fluid at rest far away.
/// docs/numerics.md, eq. 11: virtual mass below a density ratio of 0.8.
Release release(double ratio, int steps)
{
    const double d = 8e-3, rho = 1000.0;
    const GridSpec grid = cube(32, 1e-3, BoundaryKind::wall);
    FlowOptions options;
    options.kinematic_viscosity = 1e-5;
    options.max_time_step = 2e-3;
    Flow flow(grid, options);
    ImmersedBodies bodies(grid);
    std::vector<RigidMotion> motions = {at({0.0161, 0.0159, 0.0162})};
    bodies.add(sphere_shape(d), motions[0]);
    bodies.place(motions);
    const double m_f = rho * pi / 6 * d * d * d, m_p = ratio * m_f, c_v = ratio < 0.8 ? 0.5 : 0.0;
    Release result;
    Vector3d& v = motions[0].velocity;
    Vector3d before = Vector3d::Zero();
    double acceleration = 0.0;
    for (int step = 0; step < steps; ++step) {
        const double dt = std::min(flow.stable_time_step(), v.norm() > 0.0 ? 0.1 * grid.cell / v.norm() : 1.0);
        flow.predict(dt);
        const FluidAction action = bodies.measure(flow, dt, motions)[0];
        const Vector3d push = dt * (action.force + (m_p - m_f) * Vector3d(0, 0, -2.0)) + c_v * m_f * before;
        const Vector3d change = push.array() / (m_p + action.forced_mass.array() - m_f + c_v * m_f);
        const double now = change.z() / dt;
        if (step > 20) result.roughness = std::max(result.roughness, std::abs(now - acceleration));
        acceleration = now;
        before = change;
        v += change;
        motions[0].position += dt * v;
        bodies.apply(flow, motions);
        flow.project(dt);
        bodies.place(motions);
        result.worst_balance = std::max(result.worst_balance, flow.momentum().relative_error());
        if ((motions[0].position - Vector3d(0.0161, 0.0159, 0.0162)).norm() > 5e-3) break;  // before it nears a wall
    }
    result.last_speed = v.z();
    return result;
}

}  // namespace

TEST(HardCases, bodies_of_half_to_ten_times_the_density_of_the_fluid_are_stable)
{
    for (const double ratio : {0.5, 0.7, 0.83, 0.95, 1.05, 1.2, 2.78, 10.0}) {
        const Release r = release(ratio, 160);
        EXPECT_LT(r.last_speed * (ratio - 1.0), 0.0) << ratio;  // up when light, down when heavy
        EXPECT_LT(std::abs(r.last_speed), 0.5) << ratio;
        // a scheme that rings changes its acceleration by as much as gravity from step to step
        EXPECT_LT(r.roughness, 0.2 * 2.0 * std::abs(ratio - 1.0)) << ratio;
        EXPECT_LT(r.worst_balance, 1e-9) << ratio;
    }
}

TEST(HardCases, a_flow_with_no_way_through_stops_with_a_message)
{
    Flow flow(duct(0.05), {});
    ImmersedBodies bodies(flow.grid());
    const std::vector<RigidMotion> motions = {at({6e-3, 6e-3, 12e-3})};
    bodies.add(box_shape({0.02, 0.02, 3.2e-3}), motions[0]);
    bodies.place(motions);
    std::string message;
    try {
        for (int step = 0; step < 2000; ++step) coupled_step(flow, bodies, motions, flow.stable_time_step());
    } catch (const coral::Error& error) {
        message = error.what();
    }
    EXPECT_NE(message.find("its way from the inlet is blocked"), std::string::npos) << message;
}

TEST(HardCases, a_plate_with_small_holes_is_no_blockage)
{
    Flow flow(duct(0.01), {});
    ImmersedBodies bodies(flow.grid());
    const std::vector<RigidMotion> motions = {at({6e-3, 6e-3, 12.25e-3})};
    bodies.add(plate_shape(2e-3, 2.5e-3, 12e-3, {0.02, 0.02}), motions[0]);
    bodies.place(motions);
    EXPECT_NO_THROW({
        for (int step = 0; step < 1000; ++step) coupled_step(flow, bodies, motions, flow.stable_time_step());
    });
    EXPECT_LT(flow.mass().relative_error(), 1e-12);
}

TEST(HardCases, touching_and_overlapping_grains_close_the_balance)
{
    // no gap, half a cell of overlap, and one grain inside another, in a stream and in motion
    Flow flow(duct(0.05), {});
    ImmersedBodies bodies(flow.grid());
    std::vector<RigidMotion> motions = {at({3.0e-3, 6e-3, 12e-3}, {1e-3, 0, 0}), at({8.0e-3, 6e-3, 12e-3}),
                                        at({8.0e-3, 6e-3, 16.5e-3}, {0, 0, -1e-3}), at({8.1e-3, 6.1e-3, 12.1e-3})};
    for (const double d : {5e-3, 5e-3, 5e-3, 3e-3}) bodies.add(sphere_shape(d), motions[bodies.size()]);
    bodies.place(motions);
    for (int step = 0; step < 300; ++step) {
        const double dt = flow.stable_time_step();
        coupled_step(flow, bodies, motions, dt);
        for (RigidMotion& m : motions) m.position += dt * m.velocity;
        bodies.place(motions);
        ASSERT_LT(flow.momentum().relative_error(), 1e-10);
        ASSERT_LT(flow.mass().relative_error(), 1e-12);
    }
    EXPECT_LT(flow.mass().velocity_scale, 5.0);
}

TEST(HardCases, a_domain_that_is_solid_throughout_stands_whatever_pulls_at_its_fluid)
{
    const GridSpec grid = cube(10, 1e-3, BoundaryKind::wall);
    FlowOptions options;
    options.body_acceleration = {3.0, -5.0, 9.81};
    Flow flow(grid, options);
    ImmersedBodies bodies(grid);
    const std::vector<RigidMotion> motions = {at({5e-3, 5e-3, 5e-3})};
    bodies.add(box_shape({0.01, 0.01, 0.01}), motions[0]);
    bodies.place(motions);
    for (int step = 0; step < 20; ++step) coupled_step(flow, bodies, motions, 1e-3);
    EXPECT_LT(flow.mass().velocity_scale, 1e-12);
    EXPECT_LT(flow.momentum().relative_error(), 1e-10);
    const double weight = 1000.0 * 1e-9 * 10 * 10 * 9 * 9.81;  // of the faces that the equations move
    EXPECT_NEAR(flow.momentum().forcing.z() / (1e-3 * weight), -1.0, 1e-9);
}

TEST(HardCases, a_closed_void_moves_with_its_grain)
{
    // the void has no outlet of its own: the fluid inside can only go along
    const GridSpec grid = cube(28, 1e-3, BoundaryKind::wall);
    FlowOptions options;
    options.kinematic_viscosity = 1e-4;  // what the sudden start leaves inside dies out within 10 ms
    Flow flow(grid, options);
    ImmersedBodies bodies(grid);
    std::vector<RigidMotion> motions = {at({9e-3, 14e-3, 14e-3}, {0.02, 0, 0})};
    BodyShape shell = sphere_shape(14e-3);
    shell.distance = [](std::span<const Vector3d> points, std::span<double> d) {
        for (std::size_t p = 0; p < points.size(); ++p) d[p] = std::abs(points[p].norm() - 5.5e-3) - 1.5e-3;
    };
    bodies.add(shell, motions[0]);
    bodies.place(motions);
    double time = 0.0, worst = 0.0;
    while (time < 0.3) {
        const double dt = std::min(flow.stable_time_step(), 5e-3);
        coupled_step(flow, bodies, motions, dt);
        motions[0].position += dt * motions[0].velocity;
        bodies.place(motions);
        time += dt;
        if (time < 0.1) continue;
        const Eigen::Vector3i c = (motions[0].position / grid.cell).cast<int>();
        worst = std::max(worst, (flow.cell_velocity(c.x(), c.y(), c.z()) - motions[0].velocity).norm());
    }
    EXPECT_LT(worst, 0.02 * 0.02);
    EXPECT_LT(flow.mass().relative_error(), 1e-12);
}

TEST(HardCases, sudden_changes_of_the_time_step_leave_flow_and_balance_whole)
{
    Flow flow(duct(0.05), {});
    ImmersedBodies bodies(flow.grid());
    const std::vector<RigidMotion> motions = {at({6.2e-3, 5.9e-3, 12.1e-3})};
    bodies.add(sphere_shape(7e-3), motions[0]);
    bodies.place(motions);
    for (int step = 0; step < 200; ++step) coupled_step(flow, bodies, motions, flow.stable_time_step());
    const double speed = flow.mass().velocity_scale;
    for (int step = 0; step < 200; ++step) {
        const double part = step % 40 < 20 ? 1.0 : step % 2 ? 0.01 : 0.5;
        coupled_step(flow, bodies, motions, part * flow.stable_time_step());
        ASSERT_LT(flow.momentum().relative_error(), 1e-10);
        ASSERT_LT(flow.mass().velocity_scale, 1.5 * speed) << step;
    }
}

TEST(HardCases, a_coarse_bed_at_a_pore_reynolds_number_of_a_thousand_stays_bounded)
{
    // 8 cells per sphere, U d/nu = 1000: nothing resolves the boundary layer, and a central scheme blows up
    const double d = 8e-3, speed = 0.125;
    GridSpec grid = duct(speed);
    grid.cells = {16, 16, 36};
    Flow flow(grid, {});
    ImmersedBodies bodies(grid);
    std::vector<RigidMotion> motions;
    for (int i = 0; i < 8; ++i)
        motions.push_back(at({4e-3 + 8e-3 * (i % 2), 4e-3 + 8e-3 * (i / 2 % 2), 14.1e-3 + 8e-3 * (i / 4)}));
    for (const RigidMotion& motion : motions) bodies.add(sphere_shape(d), motion);
    bodies.place(motions);
    double time = 0.0;
    for (; time < 0.4; time += flow.stable_time_step()) {
        coupled_step(flow, bodies, motions, flow.stable_time_step());
        ASSERT_LT(flow.mass().velocity_scale, 40 * speed) << time;
    }
    EXPECT_LT(flow.mass().relative_error(), 1e-12);
    EXPECT_LT(flow.momentum().relative_error(), 1e-10);
    EXPECT_GT(flow.mean_boundary_pressure(z_plus), 0.0);
}

TEST(HardCases, without_any_drive_bodies_and_flow_stay_at_rest)
{
    Flow flow(duct(0.0), {});
    ImmersedBodies bodies(flow.grid());
    const std::vector<RigidMotion> motions = {at({6e-3, 6e-3, 12e-3})};
    bodies.add(box_shape({0.02, 0.02, 3.2e-3}), motions[0]);  // closes the duct: with no flow that is no blockage
    bodies.place(motions);
    for (int step = 0; step < 400; ++step) coupled_step(flow, bodies, motions, 1e-3);
    EXPECT_EQ(flow.mass().velocity_scale, 0.0);
    EXPECT_EQ(bodies.measure(flow, 1e-3, motions)[0].force.norm(), 0.0);
}
