#include "sdf/surface_nodes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include <numeric>

#include "core/error.h"
#include "core/parallel.h"
#include "sdf/mesh.h"
#include "shapes.h"

namespace coral::sdf::test {
namespace {

const DistanceGrid ball = tabulated(sphere({0.01, 0.02, -0.03}, 1.0), Eigen::Vector3d::Constant(-1.4), Eigen::Vector3i::Constant(57), 0.05);

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

TEST(SurfaceNodes, share_out_the_whole_area_and_lie_on_the_surface)
{
    const SurfaceNodes nodes = surface_nodes(ball, 500);
    ASSERT_EQ(nodes.positions.size(), 500u);
    EXPECT_NEAR(sum(nodes.areas) / surface_area(extract_mesh(ball)), 1.0, 1e-12);
    for (std::size_t n = 0; n < 500; ++n) {
        EXPECT_NEAR(ball.sample(nodes.positions[n]), 0.0, 1e-8);
        EXPECT_GT(nodes.normals[n].dot((nodes.positions[n] - Eigen::Vector3d(0.01, 0.02, -0.03)).normalized()), 0.999);
    }
}

TEST(SurfaceNodes, are_near_uniform)
{
    const int count = 500;
    const SurfaceNodes nodes = surface_nodes(ball, count);
    const double mean_area = sum(nodes.areas) / count, spacing = std::sqrt(mean_area);
    double deviation = 0, nearest_of_all = 1e9;
    for (int a = 0; a < count; ++a) {
        deviation += std::pow(nodes.areas[std::size_t(a)] / mean_area - 1, 2);
        for (int b = 0; b < a; ++b)
            nearest_of_all = std::min(nearest_of_all, (nodes.positions[std::size_t(a)] - nodes.positions[std::size_t(b)]).norm());
    }
    EXPECT_LE(std::sqrt(deviation / count), 0.15);
    EXPECT_GE(nearest_of_all, 0.6 * spacing);  // a hexagonal cover would have 1.07
}

TEST(SurfaceNodes, integrate_over_the_surface)
{
    // Closed surface: sum of n A = 0; divergence theorem: sum of x.n A = 3 V.
    const SurfaceNodes nodes = surface_nodes(ball, 800);
    Eigen::Vector3d closed = Eigen::Vector3d::Zero();
    double volume = 0;
    for (std::size_t n = 0; n < nodes.areas.size(); ++n) {
        closed += nodes.areas[n] * nodes.normals[n];
        volume += nodes.areas[n] * nodes.normals[n].dot(nodes.positions[n]) / 3;
    }
    EXPECT_LE(closed.norm() / sum(nodes.areas), 3e-3);
    EXPECT_NEAR(volume / sphere_volume(1), 1.0, 5e-3);
}

TEST(SurfaceNodes, are_denser_where_a_ball_touches_and_still_integrate)
{
    // A ball with a closed round void: a probe larger than the void cannot touch its wall.
    const double outer = 1.0, inner = 0.45;
    const DistanceGrid grid = tabulated(shell(Eigen::Vector3d::Zero(), outer, inner), Eigen::Vector3d::Constant(-1.39), Eigen::Vector3i::Constant(57), 0.05);
    const SurfaceNodes even = surface_nodes(grid, 1500), nodes = surface_nodes(grid, 1500, 0.7);
    const auto inside = [](const SurfaceNodes& n) {
        return std::count_if(n.positions.begin(), n.positions.end(), [](const Eigen::Vector3d& p) { return p.norm() < 0.7; });
    };
    const double share = inner * inner / (inner * inner + outer * outer);
    EXPECT_NEAR(double(inside(even)), 1500 * share, 15);
    EXPECT_NEAR(double(inside(nodes)), 1500 * share / 9 / (share / 9 + 1 - share), 8) << "a ninth of the density";
    EXPECT_NEAR(sum(nodes.areas) / sum(even.areas), 1.0, 1e-12);
    double outside = 0;
    for (std::size_t n = 0; n < nodes.areas.size(); ++n)
        if (nodes.positions[n].norm() > 0.7) outside += nodes.areas[n];
    EXPECT_NEAR(outside / (4 * std::numbers::pi), 1.0, 2e-3);
}

TEST(SurfaceNodes, cover_both_sides_of_a_thin_wall)
{
    const double outer = 1.0, inner = 0.9;  // wall of two spacings, thinner than the distance between nodes
    const DistanceGrid grid = tabulated(shell(Eigen::Vector3d::Constant(0.01), outer, inner), Eigen::Vector3d::Constant(-1.4), Eigen::Vector3i::Constant(57), 0.05);
    const SurfaceNodes nodes = surface_nodes(grid, 600);
    double outside = 0;
    for (std::size_t n = 0; n < nodes.areas.size(); ++n)
        if ((nodes.positions[n] - Eigen::Vector3d::Constant(0.01)).norm() > 0.95) outside += nodes.areas[n];
    EXPECT_NEAR(outside / sum(nodes.areas), 1.0 / (1.0 + 0.81), 0.01);
}

TEST(SurfaceNodes, are_the_same_every_time_for_any_thread_count)
{
    const SurfaceNodes many = surface_nodes(ball, 200);
    set_thread_count(1);
    const SurfaceNodes one = surface_nodes(ball, 200);
    set_thread_count(0);
    EXPECT_EQ(many.positions, one.positions);
    EXPECT_EQ(many.areas, one.areas);
}

TEST(SurfaceNodes, refuse_too_few)
{
    EXPECT_THROW(surface_nodes(ball, 3), Error);
    EXPECT_NEAR(node_count_for_spacing(ball, 0.1), 4 * std::numbers::pi / 0.01, 5);
}

}  // namespace
}  // namespace coral::sdf::test
