#include "fluid/flow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"

using namespace coral::fluid;
using Eigen::Vector3d;

namespace {

constexpr double pi = std::numbers::pi;

void set_kind(GridSpec& grid, int axis, BoundaryKind kind)
{
    grid.boundary[2 * axis].kind = grid.boundary[2 * axis + 1].kind = kind;
}

GridSpec box(Eigen::Vector3i cells, double cell, BoundaryKind x, BoundaryKind y, BoundaryKind z)
{
    GridSpec grid;
    grid.cells = cells;
    grid.cell = cell;
    set_kind(grid, 0, x), set_kind(grid, 1, y), set_kind(grid, 2, z);
    return grid;
}

/// Channel open along `axis` (+1: flows towards the high side), with slip, wall and periodic sides around it.
GridSpec open_channel(int axis, int direction, double speed)
{
    GridSpec grid = box({12, 10, 14}, 0.01, BoundaryKind::slip, BoundaryKind::slip, BoundaryKind::slip);
    const int inlet = 2 * axis + (direction > 0 ? 0 : 1), outlet = 2 * axis + (direction > 0 ? 1 : 0);
    set_kind(grid, (axis + 1) % 3, BoundaryKind::wall);
    grid.boundary[inlet].kind = BoundaryKind::inlet;
    grid.boundary[inlet].velocity[axis] = direction * speed;
    grid.boundary[outlet].kind = BoundaryKind::outlet;
    return grid;
}

FlowOptions liquid(double nu, TimeScheme scheme = TimeScheme::adams_bashforth)
{
    FlowOptions options;
    options.kinematic_viscosity = nu;
    options.scheme = scheme;
    return options;
}

constexpr TimeScheme both_schemes[] = {TimeScheme::adams_bashforth, TimeScheme::runge_kutta};

/// A rough divergent start, so that every term has work to do.
Vector3d stirred(const Vector3d& x, int)
{
    return {std::sin(90 * x.x() + 3 * x.y()) * std::cos(40 * x.z()), std::cos(70 * x.y() - 20 * x.z()),
            std::sin(55 * x.z() + 60 * x.x())};
}

}  // namespace

TEST(Flow, is_free_of_divergence_and_balances_mass_and_momentum_for_any_axis_of_the_outlet)
{
    for (int axis = 0; axis < 3; ++axis)
        for (int direction : {-1, 1})
            for (const TimeScheme scheme : both_schemes) {
                Flow flow(open_channel(axis, direction, 0.1), liquid(1e-5, scheme));
                flow.set_velocity([&](const Vector3d& x, int c) { return 0.1 * stirred(x, c)[c]; });
                for (int step = 0; step < 20; ++step) {
                    flow.step(flow.stable_time_step());
                    EXPECT_LT(flow.mass().relative_error(), 1e-12);
                    EXPECT_LT(flow.momentum().relative_error(), 1e-10) << axis << " " << direction << " step " << step;
                }
            }
}

TEST(Flow, balances_momentum_in_closed_and_periodic_boxes)
{
    for (const BoundaryKind x : {BoundaryKind::slip, BoundaryKind::wall, BoundaryKind::periodic})
        for (const BoundaryKind z : {BoundaryKind::slip, BoundaryKind::wall, BoundaryKind::periodic})
            for (const Convection convection : {Convection::up3, Convection::koren, Convection::none}) {
                FlowOptions options = liquid(2e-5);
                options.body_acceleration = {0.3, -0.2, 0.1};
                options.convection = convection;
                Flow flow(box({9, 11, 10}, 0.01, x, BoundaryKind::periodic, z), options);
                flow.set_velocity([&](const Vector3d& r, int c) { return 0.1 * stirred(r, c)[c]; });
                for (int step = 0; step < 5; ++step) {
                    flow.step(flow.stable_time_step());
                    EXPECT_LT(flow.mass().relative_error(), 1e-12);
                    EXPECT_LT(flow.momentum().relative_error(), 1e-10);
                }
            }
}

TEST(Flow, between_outlets_of_different_pressure_reaches_the_parabola_of_poiseuille)
{
    // plane channel of gap H: u(y) = dp/(2 mu L) y (H - y); the scheme's own profile is exact at centres up to +dp
    // h2/(8 mu L)
    GridSpec grid = box({8, 12, 4}, 1e-3, BoundaryKind::outlet, BoundaryKind::wall, BoundaryKind::periodic);
    const double dp = 0.02, mu = 1e-2, L = 8e-3, H = 12e-3;
    grid.boundary[x_minus].pressure = dp;
    FlowOptions options = liquid(mu / 1000.0);
    options.convection = Convection::none;  // no entry length: the fluid comes in without momentum
    Flow flow(grid, options);
    for (int step = 0; step < 2500; ++step) flow.step(flow.stable_time_step());
    for (int j = 0; j < 12; ++j) {
        const double y = (j + 0.5) * 1e-3;
        const double expected = dp / (2 * mu * L) * (y * (H - y) + 0.25e-6);
        EXPECT_NEAR(flow.cell_velocity(4, j, 2).x() / expected, 1.0, 1e-4) << j;
    }
    EXPECT_LT(flow.momentum().relative_error(), 1e-10);
}

TEST(Flow, driven_by_a_moving_wall_is_linear_across_the_gap)
{
    GridSpec grid = box({4, 4, 10}, 1e-3, BoundaryKind::periodic, BoundaryKind::periodic, BoundaryKind::wall);
    grid.boundary[z_plus].velocity = {0.01, -0.02, 0.0};
    Flow flow(grid, liquid(1e-5));
    for (int step = 0; step < 2500; ++step) flow.step(flow.stable_time_step());
    for (int k = 0; k < 10; ++k) {
        EXPECT_NEAR(flow.cell_velocity(1, 1, k).x(), 0.01 * (k + 0.5) / 10, 1e-6);
        EXPECT_NEAR(flow.cell_velocity(1, 1, k).y(), -0.02 * (k + 0.5) / 10, 2e-6);
    }
}

/// Largest velocity error of Taylor and Green's decaying vortices (in the plane of `first` and `second`) after 0.5 s.
double taylor_green_error(int n, int first, int second, TimeScheme scheme)
{
    const double nu = 0.01, L = 1.0, end = 0.5, k = 2 * pi / L;
    Eigen::Vector3i cells(4, 4, 4);
    cells[first] = cells[second] = n;
    FlowOptions options = liquid(nu, scheme);
    options.first_step_factor = 1.0;
    options.cfl = 0.25;
    options.density = 2.0;
    Flow flow(box(cells, L / n, BoundaryKind::periodic, BoundaryKind::periodic, BoundaryKind::periodic), options);
    const auto exact = [&](const Vector3d& x, int component, double t) {
        const double decay = std::exp(-2 * nu * k * k * t);
        if (component == first) return std::sin(k * x[first]) * std::cos(k * x[second]) * decay;
        if (component == second) return -std::cos(k * x[first]) * std::sin(k * x[second]) * decay;
        return 0.0;
    };
    flow.set_velocity([&](const Vector3d& x, int component) { return exact(x, component, 0.0); });
    double t = 0.0;
    while (t < end * (1 - 1e-12)) {
        const double dt = fit_time_step(flow.stable_time_step(), end - t);
        flow.step(dt);
        t += dt;
    }
    double worst = 0.0;
    Eigen::Vector3i c(1, 1, 1);
    for (c[second] = 0; c[second] < n; ++c[second])
        for (c[first] = 0; c[first] < n; ++c[first]) {
            Vector3d x = (c.cast<double>() + Vector3d::Constant(0.5)) * (L / n);
            x[first] -= 0.5 * L / n;
            const double u = flow.velocity(first)[flow.layout().index(c.x(), c.y(), c.z())];
            worst = std::max(worst, std::abs(u - exact(x, first, t)));
        }
    return worst;
}

TEST(Flow, converges_to_taylor_and_greens_vortices_with_second_order)
{
    for (const auto& [first, second] : {std::pair(0, 1), std::pair(1, 2), std::pair(2, 0)}) {
        for (const TimeScheme scheme : both_schemes) {
            const double coarse = taylor_green_error(16, first, second, scheme), fine = taylor_green_error(32, first, second, scheme);
            EXPECT_LT(fine, 2e-3);
            EXPECT_GT(std::log2(coarse / fine), 1.8) << coarse << " " << fine;
        }
    }
}

TEST(Flow, gives_the_same_bits_with_one_and_two_threads)
{
    const auto run = [](int threads) {
        coral::set_thread_count(threads);
        Flow flow(open_channel(2, -1, 0.1), liquid(1e-5));
        flow.set_velocity([&](const Vector3d& x, int c) { return 0.1 * stirred(x, c)[c]; });
        for (int step = 0; step < 10; ++step) flow.step(flow.stable_time_step());
        return flow;
    };
    const Flow one = run(1), two = run(2);
    for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(one.velocity(axis), two.velocity(axis));
    EXPECT_EQ(one.pressure(), two.pressure());
    EXPECT_EQ(one.momentum().after, two.momentum().after);
}

TEST(Flow, continues_bit_for_bit_from_a_saved_state)
{
    for (const TimeScheme scheme : both_schemes) {
        Flow flow(open_channel(0, 1, 0.1), liquid(1e-5, scheme));
        for (int step = 0; step < 7; ++step) flow.step(flow.stable_time_step());
        Flow other(open_channel(0, 1, 0.1), liquid(1e-5, scheme));
        other.restore(flow.save());
        for (int step = 0; step < 7; ++step) {
            EXPECT_EQ(flow.stable_time_step(), other.stable_time_step());
            flow.step(flow.stable_time_step());
            other.step(other.stable_time_step());
        }
        for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(flow.velocity(axis), other.velocity(axis));
        EXPECT_EQ(flow.pressure(), other.pressure());
        EXPECT_EQ(flow.momentum().relative_error(), other.momentum().relative_error());
    }
    Flow flow(open_channel(0, 1, 0.1), liquid(1e-5));
    for (int step = 0; step < 7; ++step) flow.step(flow.stable_time_step());
    Flow of_other_scheme(open_channel(0, 1, 0.1), liquid(1e-5, TimeScheme::runge_kutta));
    of_other_scheme.restore(flow.save());
    for (int step = 0; step < 7; ++step) {
        of_other_scheme.step(of_other_scheme.stable_time_step());
        EXPECT_LT(of_other_scheme.mass().relative_error(), 1e-12);
        EXPECT_LT(of_other_scheme.momentum().relative_error(), 1e-10);
    }
    Flow small(box({4, 4, 4}, 0.01, BoundaryKind::slip, BoundaryKind::slip, BoundaryKind::slip), liquid(1e-5));
    EXPECT_THROW(small.restore(flow.save()), coral::Error);
}

TEST(Flow, refuses_domains_that_cannot_work)
{
    GridSpec grid = open_channel(2, -1, 0.1);
    grid.boundary[z_minus].kind = BoundaryKind::slip;  // nowhere to go
    EXPECT_THROW(Flow(grid, liquid(1e-6)), coral::UsageError);
    grid = open_channel(2, -1, 0.1);
    grid.boundary[x_minus].kind = BoundaryKind::periodic;
    EXPECT_THROW(Flow(grid, liquid(1e-6)), coral::UsageError);
    grid = open_channel(2, -1, 0.1);
    EXPECT_THROW(Flow(grid, liquid(0.0)), coral::UsageError);
    grid.cell = 0.0;
    EXPECT_THROW(Flow(grid, liquid(1e-6)), coral::UsageError);
}

TEST(Flow, at_rest_with_no_inflow_stays_at_rest)
{
    Flow flow(open_channel(2, -1, 0.0), liquid(1e-6));
    for (int step = 0; step < 3; ++step) flow.step(flow.stable_time_step());
    EXPECT_EQ(flow.mass().velocity_scale, 0.0);
    EXPECT_EQ(flow.mass().relative_error(), 0.0);
    EXPECT_EQ(flow.momentum().relative_error(), 0.0);
}
