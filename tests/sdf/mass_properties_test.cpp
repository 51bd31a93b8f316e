#include "sdf/mass_properties.h"

#include <gtest/gtest.h>

#include "shapes.h"

namespace coral::sdf::test {
namespace {

TEST(MassProperties, of_a_sphere_are_exact_to_a_thousandth_at_nine_spacings)
{
    const Eigen::Vector3d centre(0.31, -0.22, 0.13);
    for (const double radius : {9.0, 20.0}) {
        const int half = int(radius) + 4;
        const MassProperties body = mass_properties(tabulated(sphere(centre, radius), Eigen::Vector3d::Constant(-half), Eigen::Vector3i::Constant(2 * half + 1), 1.0));
        const double v = sphere_volume(radius);
        EXPECT_NEAR(body.volume / v, 1.0, radius < 10 ? 3e-4 : 1e-4);
        EXPECT_NEAR((body.centroid - centre).norm(), 0.0, 3e-3);
        for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(body.inertia(axis, axis) / (0.4 * v * radius * radius), 1.0, radius < 10 ? 2e-3 : 5e-4);
        EXPECT_NEAR(body.inertia(0, 1) / body.inertia(0, 0), 0.0, 1e-3);
    }
}

TEST(MassProperties, of_a_hollow_sphere_with_a_wall_of_two_and_a_half_spacings)
{
    // 12 mm ball, 0.5 mm wall, 200 um.
    const double h = 2e-4, outer = 6e-3, inner = 5.5e-3;
    const DistanceGrid grid = tabulated(shell(Eigen::Vector3d(3e-5, -6e-5, 8e-5), outer, inner), Eigen::Vector3d::Constant(-34 * h), Eigen::Vector3i::Constant(69), h);
    const MassProperties body = mass_properties(grid);
    EXPECT_NEAR(body.volume / (sphere_volume(outer) - sphere_volume(inner)), 1.0, 5e-4);
    const double inertia = 8.0 / 15.0 * std::numbers::pi * (std::pow(outer, 5) - std::pow(inner, 5));
    EXPECT_NEAR(body.inertia.trace() / 3 / inertia, 1.0, 1e-3);
}

TEST(MassProperties, turn_with_the_body)
{
    const Eigen::Matrix3d turn = some_rotation(0.9);
    const auto body_of = [](const Eigen::Matrix3d& frame) {
        return mass_properties(tabulated(torus(Eigen::Vector3d(0.3, 0.2, 0.1), frame, 14, 7), Eigen::Vector3d::Constant(-25), Eigen::Vector3i::Constant(51), 1.0));
    };
    const MassProperties still = body_of(Eigen::Matrix3d::Identity()), turned = body_of(turn);
    EXPECT_NEAR((turned.inertia - turn * still.inertia * turn.transpose()).norm() / still.inertia.norm(), 0.0, 1e-3);
    EXPECT_NEAR(still.volume / (2 * std::pow(std::numbers::pi, 2) * 14 * 49), 1.0, 5e-4);
}

TEST(SmoothedSolid, has_no_first_and_second_moment)
{
    // Integral over s of (H(s) - [s<0]) s^n, n = 0, 1: both vanish, so that flat and curved surfaces are counted without bias.
    double zeroth = 0, first = 0;
    const int steps = 30000;
    for (int i = 0; i < steps; ++i) {
        const double s = -1.0 + 2.0 * (i + 0.5) / steps, excess = smoothed_solid(s) - (s < 0);
        zeroth += excess * 2.0 / steps;
        first += excess * s * 2.0 / steps;
    }
    EXPECT_NEAR(zeroth, 0.0, 1e-8);
    EXPECT_NEAR(first, 0.0, 1e-8);
    EXPECT_EQ(smoothed_solid(-1.1), 1.0);
    EXPECT_EQ(smoothed_solid(1.1), 0.0);
}

}  // namespace
}  // namespace coral::sdf::test
