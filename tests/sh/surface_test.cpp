#include "sh/surface.h"

#include <gtest/gtest.h>

#include "bodies.h"
#include "core/error.h"
#include "sh/quadrature.h"

namespace coral::sh::test {
namespace {

const double pi = std::numbers::pi;

TEST(BodyProperties, of_an_ellipsoid_are_the_closed_forms)
{
    const double a = 1.3, b = 1.0, c = 0.8, v = 4.0 / 3.0 * pi * a * b * c;
    const BodyProperties body = body_properties(ellipsoid());
    EXPECT_NEAR(body.volume / v, 1.0, 1e-8);
    EXPECT_NEAR(body.centroid.norm(), 0.0, 1e-12);
    EXPECT_NEAR(body.inertia(0, 0) / (0.2 * v * (b * b + c * c)), 1.0, 1e-8);
    EXPECT_NEAR(body.inertia(1, 1) / (0.2 * v * (a * a + c * c)), 1.0, 1e-8);
    EXPECT_NEAR(body.inertia(0, 2), 0.0, 1e-12);
    // Area by elliptic integrals (numerical quadrature of the parametrised surface, 4000 x 4000 midpoints): 13.37346.
    double area = 0;
    const int n = 400;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double t = pi * (i + 0.5) / n, p = 2 * pi * (j + 0.5) / n, s = std::sin(t);
            area += s * std::sqrt(std::pow(b * c * s * std::cos(p), 2) + std::pow(a * c * s * std::sin(p), 2) + std::pow(a * b * std::cos(t), 2)) * 2 * pi * pi / n / n;
        }
    EXPECT_NEAR(body.area / area, 1.0, 1e-5);
}

TEST(ScaledToVolume, is_exact_and_keeps_the_shape)
{
    const Surface surface = lump(10, 0.15, 2), doubled = scaled_to_volume(surface, 8.5);
    EXPECT_NEAR(body_properties(doubled).volume / 8.5, 1.0, 1e-12);
    EXPECT_NEAR(doubled.coefficients[7] / doubled.coefficients[0], surface.coefficients[7] / surface.coefficients[0], 1e-15);
    EXPECT_NEAR(doubled.scale, std::cbrt(8.5 / body_properties(surface).volume), 1e-12);
}

TEST(Centred, puts_the_centroid_at_the_origin)
{
    Surface surface = lump(8, 0.2, 4);
    surface.centre = Eigen::Vector3d(0.3, 0.1, -2);
    surface.coefficients[2] = 0.3;  // pushes the body along z
    EXPECT_GT(body_properties(surface).centroid.norm(), 1.0);
    EXPECT_NEAR(body_properties(centred(surface)).centroid.norm(), 0.0, 1e-14);
}

TEST(Evaluator, normal_is_perpendicular_to_the_surface)
{
    const Evaluator lumpy(lump(8, 0.2, 4));
    const Eigen::Vector3d u = Eigen::Vector3d(0.4, 0.3, -0.7).normalized();
    Eigen::Vector3d normal;
    const Eigen::Vector3d p = lumpy.point(u, normal);
    for (const Eigen::Vector3d& step : {Eigen::Vector3d(1e-6, 0, 0), Eigen::Vector3d(0, 1e-6, 0)})
        EXPECT_NEAR(normal.dot((lumpy.point((u + step).normalized()) - p).normalized()), 0.0, 1e-5);
    EXPECT_GT(normal.dot(u), 0.0);
}

TEST(Evaluator, refuses_coefficients_that_do_not_fit)
{
    Surface surface = lump(4, 0.1, 1);
    surface.coefficients.pop_back();
    EXPECT_THROW(Evaluator{surface}, Error);
}

}  // namespace
}  // namespace coral::sh::test
