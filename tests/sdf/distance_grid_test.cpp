#include "sdf/distance_grid.h"

#include <gtest/gtest.h>

#include <random>

#include "shapes.h"

namespace coral::sdf::test {
namespace {

const DistanceGrid ball = tabulated(sphere(Eigen::Vector3d(0.1, 0.2, -0.1), 1.0), Eigen::Vector3d::Constant(-1.6), {17, 17, 17}, 0.2);

TEST(DistanceGrid, gives_a_linear_field_back_with_its_gradient)
{
    const Eigen::Vector3d slope(0.3, -0.5, 0.7);
    const DistanceGrid grid = tabulated([&](const Eigen::Vector3d& x) { return slope.dot(x) + 4.0; }, {-1, -2, -3}, {5, 6, 7}, 0.5);
    for (const Eigen::Vector3d& x : {Eigen::Vector3d(-0.9, -1.2, -2.1), Eigen::Vector3d(1, 0.5, 0), Eigen::Vector3d(-1, -2, -3)}) {
        Eigen::Vector3d g;
        EXPECT_NEAR(grid.sample_with_gradient(x, g), slope.dot(x) + 4.0, 1e-6);
        EXPECT_NEAR((g - slope).norm(), 0.0, 1e-5);
    }
}

TEST(DistanceGrid, gradient_is_that_of_the_value_itself)
{
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform(-2.4, 2.4);  // inside and outside the box
    const double step = 1e-6;
    for (int n = 0; n < 2000; ++n) {
        const Eigen::Vector3d x(uniform(random), uniform(random), uniform(random));
        const Eigen::Vector3d cell = (x - ball.origin) / ball.spacing;
        if ((cell.array() - cell.array().round()).abs().minCoeff() < 1e-4) continue;  // kinks between cells
        Eigen::Vector3d g, numeric;
        const double d = ball.sample_with_gradient(x, g);
        EXPECT_DOUBLE_EQ(d, ball.sample(x));
        for (int axis = 0; axis < 3; ++axis)
            numeric[axis] = (ball.sample(x + step * Eigen::Vector3d::Unit(axis)) - ball.sample(x - step * Eigen::Vector3d::Unit(axis))) / (2 * step);
        ASSERT_NEAR((g - numeric).norm(), 0.0, 1e-7);
    }
}

TEST(DistanceGrid, outside_its_box_gives_a_positive_lower_bound)
{
    const Distance truth = sphere(Eigen::Vector3d(0.1, 0.2, -0.1), 1.0);
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> uniform(-6, 6);
    for (int n = 0; n < 2000; ++n) {
        const Eigen::Vector3d x(uniform(random), uniform(random), uniform(random));
        if (ball.inside_box(x)) continue;
        const double d = ball.sample(x);
        EXPECT_GT(d, 0.0);
        EXPECT_LE(d, truth(x) + 0.01);
        EXPECT_GE(d, 0.5 * truth(x));
    }
}

}  // namespace
}  // namespace coral::sdf::test
