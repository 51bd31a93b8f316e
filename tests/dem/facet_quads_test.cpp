#include "dem/detail/facet_quads.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

// Lanes are passed by value inline only, as in lanes.h.
#pragma GCC diagnostic ignored "-Wpsabi"

using namespace coral::dem::detail;
using Eigen::Vector3d;

namespace {

using Triangle = std::array<Vector3d, 3>;

/// Midpoints of 4^depth like parts: an independent quadrature of what the ball covers.
void sum_up(const Triangle& t, const Vector3d& centre, double radius, int depth, double& energy)
{
    if (depth > 0) {
        const Vector3d ab = 0.5 * (t[0] + t[1]), bc = 0.5 * (t[1] + t[2]), ca = 0.5 * (t[2] + t[0]);
        for (const Triangle& part : {Triangle{t[0], ab, ca}, Triangle{ab, t[1], bc}, Triangle{ca, bc, t[2]}, Triangle{ab, bc, ca}})
            sum_up(part, centre, radius, depth - 1, energy);
        return;
    }
    const double away2 = ((t[0] + t[1] + t[2]) / 3.0 - centre).squaredNorm();
    if (away2 < radius * radius) energy += 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm() * (radius * radius - away2) / (2.0 * radius);
}

FacetQuad quad_of(const std::array<Triangle, 4>& triangles)
{
    FacetQuad quad;
    for (int k = 0; k < lane_count; ++k) quad.set(k, triangles[std::size_t(k)][0], triangles[std::size_t(k)][1], triangles[std::size_t(k)][2]);
    return quad;
}

double energy_of(const FacetQuad& quad, int k, const Vector3d& centre, double radius)
{
    QuadPress press;
    return press_on(quad, centre, radius, press) && press.covered[k] > 0.0 ? press.energy[k] : 0.0;
}

}  // namespace

TEST(Lanes, argument_is_that_of_the_complex_number)
{
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> exponent(-20.0, 20.0), turn(-std::numbers::pi, std::numbers::pi);
    for (int round = 0; round < 20000; ++round) {
        Lanes re, im;
        for (int k = 0; k < lane_count; ++k) {
            const double size = std::exp(exponent(random)), angle = turn(random);
            re[k] = size * std::cos(angle);
            im[k] = size * std::sin(angle);
        }
        const Lanes found = argument(re, im);
        for (int k = 0; k < lane_count; ++k) EXPECT_NEAR(found[k], std::atan2(im[k], re[k]), 9e-16) << re[k] << " " << im[k];
    }
    const Lanes axes = argument(Lanes{1.0, 0.0, -1.0, 0.0}, Lanes{0.0, 1.0, 0.0, -1.0});
    for (int k = 0; k < lane_count; ++k) EXPECT_EQ(axes[k], (k < 3 ? k : -1) * 0.5 * std::numbers::pi);
}

TEST(FacetQuad, energy_is_the_integral_over_what_the_ball_covers)
{
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto point = [&] { return Vector3d(uniform(random), uniform(random), uniform(random)); };
    int seen = 0, whole = 0;
    for (int round = 0; round < 60; ++round) {
        std::array<Triangle, 4> triangles;
        const double size = round % 2 ? 1.0 : 0.2;
        for (Triangle& t : triangles) {
            const Vector3d middle = 0.8 * point();
            t = {middle + size * point(), middle + size * point(), middle + size * point()};
        }
        const FacetQuad quad = quad_of(triangles);
        const Vector3d centre = 0.3 * point();
        const double radius = 0.7;
        for (int k = 0; k < 4; ++k) {
            double wanted = 0.0;
            sum_up(triangles[std::size_t(k)], centre, radius, 7, wanted);
            const double area = 0.5 * (triangles[std::size_t(k)][1] - triangles[std::size_t(k)][0]).cross(triangles[std::size_t(k)][2] - triangles[std::size_t(k)][0]).norm();
            EXPECT_NEAR(energy_of(quad, k, centre, radius), wanted, 2e-5 * radius * area) << round << " " << k;
            seen += wanted > 0.0;
            bool all_in = true;
            for (const Vector3d& corner : triangles[std::size_t(k)]) all_in = all_in && (corner - centre).norm() < radius;
            whole += all_in;
        }
    }
    EXPECT_GT(seen, 100);
    EXPECT_GT(whole, 10);
}

TEST(FacetQuad, force_is_what_the_energy_loses_on_the_way)
{
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto point = [&] { return Vector3d(uniform(random), uniform(random), uniform(random)); };
    for (int round = 0; round < 200; ++round) {
        std::array<Triangle, 4> triangles;
        for (Triangle& t : triangles) t = {point(), point(), point()};
        const FacetQuad quad = quad_of(triangles);
        const Vector3d centre = 0.3 * point();
        const double radius = 0.8, step = 1e-5;
        QuadPress press;
        const bool any = press_on(quad, centre, radius, press);
        for (int k = 0; k < 4; ++k) {
            const Vector3d force = any && press.covered[k] > 0.0 ? lane(press.force, k) : Vector3d::Zero().eval();
            for (int axis = 0; axis < 3; ++axis) {
                const Vector3d h = step * Vector3d::Unit(axis);
                const double slope = (energy_of(quad, k, centre + h, radius) - energy_of(quad, k, centre - h, radius)) / (2.0 * step);
                EXPECT_NEAR(force[axis], -slope, 1e-6) << round << " " << k;
            }
        }
    }
}

TEST(FacetQuad, ball_on_a_wide_triangle_follows_the_linear_law)
{
    // k_a int (R^2 - r^2)/(2R) dA = kn d^2/2 (1 - d/2R)^2 with k_a = kn/(2 pi R)
    FacetQuad quad;
    quad.set(0, {-9.0, -9.0, 0.0}, {9.0, -9.0, 0.0}, {0.0, 9.0, 0.0});
    for (int k = 1; k < lane_count; ++k) quad.clear(k);
    for (const double overlap : {1e-6, 1e-3, 0.1}) {
        QuadPress press;
        ASSERT_TRUE(press_on(quad, {0.1, 0.2, 1.0 - overlap}, 1.0, press));
        EXPECT_EQ(press.covered[0], 1.0);
        EXPECT_EQ(press.covered[1] + press.covered[2] + press.covered[3], 0.0);
        const double stiffness = 1.0 / (2.0 * std::numbers::pi);
        EXPECT_NEAR(stiffness * press.energy[0], 0.5 * overlap * overlap * (1.0 - 0.5 * overlap) * (1.0 - 0.5 * overlap), 1e-9 * overlap * overlap);
        EXPECT_NEAR(stiffness * press.force.z[0], overlap * (1.0 - overlap) * (1.0 - 0.5 * overlap), 1e-8 * overlap);
        EXPECT_NEAR(press.size[0], press.force.z[0], 1e-12);
    }
    QuadPress press;
    EXPECT_FALSE(press_on(quad, {0.1, 0.2, 1.0}, 1.0, press));
    EXPECT_FALSE(press_on(quad, {0.0, 0.0, 500.0}, 1.0, press));
}

TEST(FacetQuad, triangle_beside_the_ball_in_its_own_plane_is_not_touched)
{
    FacetQuad quad;
    quad.set(0, {1.01, -0.5, 0.0}, {2.0, 0.0, 0.0}, {1.01, 0.5, 0.0});
    quad.set(1, {0.0, 0.0, 0.0}, {-0.125, 0.0, 0.0}, {0.0, -0.125, 0.0});  // a corner under the centre
    quad.set(2, {1.0, 1.0, 0.0}, {3.0, 1.0, 0.0}, {3.0, 3.0, 0.0});
    quad.clear(3);
    QuadPress press;
    ASSERT_TRUE(press_on(quad, Vector3d::Zero(), 1.0, press));
    EXPECT_EQ(press.covered[0], 0.0);
    EXPECT_EQ(press.covered[1], 1.0);
    EXPECT_NEAR(press.energy[1], 0.5 * (0.125 * 0.125 / 2.0 - std::pow(0.125, 4) / 6.0), 1e-12);
    EXPECT_EQ(press.covered[2], 0.0);
}
