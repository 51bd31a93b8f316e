#include "sh/tabulate.h"

#include <gtest/gtest.h>

#include "bodies.h"
#include "core/error.h"
#include "sdf/mass_properties.h"
#include "sh/quadrature.h"

namespace coral::sh::test {
namespace {

TEST(Tabulate, of_a_sphere_holds_exact_distances_with_a_node_at_the_origin)
{
    const sdf::DistanceGrid grid = tabulate(sphere_surface(1.0), 0.1, 0.8);
    double largest = 0;
    for (int k = 0; k < grid.size.z(); ++k)
        for (int j = 0; j < grid.size.y(); ++j)
            for (int i = 0; i < grid.size.x(); ++i)
                largest = std::max(largest, std::abs(grid.distance[grid.index(i, j, k)] - (grid.node(i, j, k).norm() - 1.0)));
    EXPECT_LE(largest, 1e-4);  // a thousandth of a spacing
    const Eigen::Vector3d first = grid.origin / 0.1;
    EXPECT_NEAR((first.array() - first.array().round()).abs().maxCoeff(), 0.0, 1e-9);
    EXPECT_TRUE(grid.inside_box({1.8, 0, 0}) && grid.inside_box({0, 0, -1.8}));
}

TEST(Tabulate, of_a_lump_agrees_with_brute_force_distances)
{
    const Surface surface = lump(10, 0.12, 3);
    const double h = 0.1;
    const sdf::DistanceGrid grid = tabulate(surface, h, 0.8);
    const Evaluator evaluator(surface);
    std::vector<Eigen::Vector3d> dense;
    const SphereQuadrature q = sphere_quadrature(200, 400);
    for (const auto& u : q.directions) dense.push_back(evaluator.point(u));
    std::mt19937_64 random(8);
    double squares = 0, largest = 0;
    const int count = 300;
    for (int n = 0; n < count; ++n) {
        const Eigen::Vector3i at(int(random() % unsigned(grid.size.x())), int(random() % unsigned(grid.size.y())), int(random() % unsigned(grid.size.z())));
        const Eigen::Vector3d x = grid.node(at.x(), at.y(), at.z());
        double nearest = 1e9;
        for (const auto& p : dense) nearest = std::min(nearest, (x - p).squaredNorm());
        const double sign = evaluator.radial_distance(x) < 0 ? -1 : 1;
        const double error = (grid.distance[grid.index(at.x(), at.y(), at.z())] - sign * std::sqrt(nearest)) / h;
        squares += error * error;
        largest = std::max(largest, std::abs(error));
    }
    EXPECT_LE(std::sqrt(squares / count), 0.02);
    EXPECT_LE(largest, 0.15);
}

TEST(Tabulate, keeps_volume_and_inertia_of_the_body)
{
    const Surface surface = centred(lump(10, 0.12, 5));
    const BodyProperties truth = body_properties(surface);
    const sdf::MassProperties body = sdf::mass_properties(tabulate(surface, 0.05, 0.2));
    EXPECT_NEAR(body.volume / truth.volume, 1.0, 1e-3);
    EXPECT_NEAR(body.centroid.norm(), 0.0, 1e-3);
    EXPECT_LE((body.inertia - truth.inertia).norm() / truth.inertia.norm(), 2e-3);
}

TEST(Tabulate, clamps_only_deep_inside_when_asked)
{
    const sdf::DistanceGrid grid = tabulate(sphere_surface(1.0), 0.1, 0.5, 0.3);
    EXPECT_NEAR(grid.sample(Eigen::Vector3d::Zero()), -0.3, 1e-6);
    EXPECT_NEAR(grid.inside_limit, 0.3, 1e-6);
    EXPECT_TRUE(std::isinf(grid.outside_limit));
    EXPECT_NEAR(grid.sample({1.4, 0, 0}), 0.4, 1e-3);
}

TEST(Tabulate, refuses_a_radius_that_is_not_positive)
{
    Surface surface = lump(4, 0.1, 1);
    surface.coefficients[6] = 10;
    EXPECT_THROW(tabulate(surface, 0.1, 0.5), Error);
}

}  // namespace
}  // namespace coral::sh::test
