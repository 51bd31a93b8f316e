#include "sh/surface_distance.h"

#include <gtest/gtest.h>

#include "bodies.h"
#include "core/error.h"
#include "sh/quadrature.h"

namespace coral::sh::test {
namespace {

TEST(SurfaceDistance, of_a_sphere_is_exact_inside_outside_and_at_the_centre)
{
    Surface sphere = sphere_surface(2.0);
    sphere.centre = Eigen::Vector3d(0.3, -0.2, 1);
    const SurfaceDistance field(sphere);
    const Eigen::Vector3d u = Eigen::Vector3d(1, 2, -2) / 3;
    for (const double r : {1e-3, 0.5, 1.9, 2.0, 2.3, 40.0}) {
        const SurfaceDistance::Foot foot = field.foot(sphere.centre + r * u);
        EXPECT_NEAR(foot.distance, r - 2.0, 1e-13 * (1 + r)) << r;
        EXPECT_LE((foot.normal - u).norm(), 1e-9) << r;
    }
    EXPECT_NEAR(field.distance(sphere.centre), -2.0, 1e-14);
}

TEST(SurfaceDistance, comes_back_along_the_normal_of_an_ellipsoid)
{
    // Up to the centre of curvature the foot of p + d n is p. Least radius of curvature of the ellipsoid: 0.64/1.3 = 0.49.
    const SurfaceDistance field(ellipsoid());
    for (const Eigen::Vector3d& u : sphere_quadrature(6, 10).directions)
        for (const double d : {-0.4, -0.1, -1e-6, 1e-3, 0.3, 3.0}) {
            Eigen::Vector3d normal;
            const Eigen::Vector3d p = field.evaluator().point(u, normal);
            const SurfaceDistance::Foot foot = field.foot(p + d * normal);
            EXPECT_NEAR(foot.distance, d, 1e-10) << u.transpose();
            EXPECT_LE((foot.point - p).norm(), 1e-7) << u.transpose() << " at " << d;
            EXPECT_LE((foot.normal - normal).norm(), 1e-7);
        }
}

/// Least distance over a dense grid of directions, sharpened around the nearest ones.
struct Dense {
    explicit Dense(const Evaluator& of) : evaluator(of), quadrature(sphere_quadrature(160, 320))
    {
        for (const auto& u : quadrature.directions) points.push_back(evaluator.point(u));
    }
    double distance(const Eigen::Vector3d& x) const
    {
        std::vector<std::pair<double, std::size_t>> order;
        for (std::size_t i = 0; i < points.size(); ++i) order.emplace_back((x - points[i]).squaredNorm(), i);
        std::partial_sort(order.begin(), order.begin() + 40, order.end());
        double least = order[0].first;
        for (int n = 0; n < 40; ++n) {  // a pattern search that only ever compares distances: no derivative to trust
            Eigen::Vector3d u = quadrature.directions[order[std::size_t(n)].second];
            double value = order[std::size_t(n)].first;
            for (double step = 0.02; step > 1e-8;) {
                const Eigen::Vector3d a = u.unitOrthogonal(), b = u.cross(a);
                bool moved = false;
                for (const Eigen::Vector3d& t : {a, Eigen::Vector3d(-a), b, Eigen::Vector3d(-b)}) {
                    const Eigen::Vector3d v = (u + step * t).normalized();
                    if (const double d = (x - evaluator.point(v)).squaredNorm(); d < value) {
                        value = d, u = v, moved = true;
                        break;
                    }
                }
                if (!moved) step *= 0.5;
            }
            least = std::min(least, value);
        }
        return std::sqrt(least);
    }
    const Evaluator& evaluator;
    SphereQuadrature quadrature;
    std::vector<Eigen::Vector3d> points;
};

TEST(SurfaceDistance, is_the_least_over_the_whole_of_a_rough_surface)
{
    for (const unsigned seed : {3u, 4u}) {
        const Surface surface = lump(10, 0.2, seed);  // rougher than coral sand: radii from 0.5 to 1.6
        const SurfaceDistance field(surface);
        const Dense dense(field.evaluator());
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> uniform(-2, 2);
        for (int n = 0; n < 60; ++n) {
            const Eigen::Vector3d x(uniform(random), uniform(random), uniform(random));
            EXPECT_NEAR(std::abs(field.distance(x)), dense.distance(x), 1e-8) << x.transpose();
            EXPECT_EQ(field.distance(x) < 0, field.evaluator().radial_distance(x) < 0);
        }
    }
}

TEST(SurfaceDistance, has_its_normal_as_gradient)
{
    const SurfaceDistance field(lump(10, 0.12, 6));
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform(-1.6, 1.6);
    int compared = 0;
    for (int n = 0; n < 100; ++n) {
        const Eigen::Vector3d x(uniform(random), uniform(random), uniform(random));
        const SurfaceDistance::Foot foot = field.foot(x);
        if (foot.distance < 0.02) continue;  // inside, the distance has kinks where two sides are equally near
        Eigen::Vector3d gradient;
        for (int axis = 0; axis < 3; ++axis) {
            const Eigen::Vector3d step = 1e-6 * Eigen::Vector3d::Unit(axis);
            gradient[axis] = (field.distance(x + step) - field.distance(x - step)) / 2e-6;
        }
        compared += 1;
        EXPECT_LE((gradient - foot.normal).norm(), 1e-5) << x.transpose();
    }
    EXPECT_GT(compared, 50);
}

TEST(SurfaceDistance, follows_a_query_that_moves_little_from_its_last_foot)
{
    const SurfaceDistance field(lump(10, 0.12, 8));
    Eigen::Vector3d guess = field.foot({1.6, 0, 0}).direction;
    for (int n = 1; n <= 40; ++n) {
        const double angle = 0.02 * n;
        const Eigen::Vector3d x(1.6 * std::cos(angle), 1.6 * std::sin(angle), 0.1 * n / 40);
        const SurfaceDistance::Foot near = field.foot_near(x, guess);
        guess = near.direction;
        EXPECT_GE(near.distance, field.distance(x) - 1e-12);
        if (n < 10) {
            EXPECT_NEAR(near.distance, field.distance(x), 1e-10);
        }
    }
}

TEST(SurfaceDistance, refuses_a_radius_that_is_not_positive)
{
    Surface surface = lump(4, 0.1, 1);
    surface.coefficients[6] = 10;
    EXPECT_THROW(SurfaceDistance{surface}, Error);
}

}  // namespace
}  // namespace coral::sh::test
