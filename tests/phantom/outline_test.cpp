#include "phantom/outline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sh/basis.h"

namespace {
using namespace coral::phantom;
using std::numbers::pi;

Outline make(double sphericity, double stretch, std::uint64_t stream = 0)
{
    RandomSource random(7, stream);
    OutlineSpec spec;
    spec.sphericity = sphericity;
    spec.stretch = stretch;
    return Outline(spec, random);
}

TEST(Outline, is_a_sphere_or_a_spheroid_when_the_bumps_have_no_height)
{
    const Outline sphere = make(1.0, 1.0);
    const double radius = 4e-3;
    EXPECT_NEAR(sphere.sphericity(), 1.0, 1e-6);
    EXPECT_NEAR(sphere.area(), 4 * pi * radius * radius, 1e-6 * sphere.area());

    // Prolate spheroid of aspect 2 (Wadell's sphericity in closed form): a = b, c = 2a, e^2 = 3/4.
    const double c = 2, e = std::sqrt(0.75), area = 2 * pi * (1 + c / e * std::asin(e)), volume = 4 * pi / 3 * c;
    const double sphericity = std::cbrt(36 * pi * volume * volume) / area;
    const Outline stick = make(sphericity - 1e-9, 2.0);
    EXPECT_NEAR(stick.area() / (stick.equivalent_diameter() * stick.equivalent_diameter()), pi / sphericity, 1e-5);
}

TEST(Outline, has_the_diameter_and_sphericity_asked_for)
{
    for (const double sphericity : {0.80, 0.88, 0.95}) {
        const Outline lump = make(sphericity, 1.0);
        EXPECT_NEAR(lump.equivalent_diameter(), 8e-3, 1e-12);
        EXPECT_NEAR(lump.sphericity(), sphericity, 1e-6);
    }
    EXPECT_NEAR(make(0.76, 2.0).sphericity(), 0.76, 1e-6);
}

TEST(Outline, encloses_the_volume_found_by_throwing_points)
{
    const Outline lump = make(0.82, 1.0, 3);
    RandomSource random(1, 0);
    const double r = lump.outer_radius();
    const int points = 400'000;
    int inside = 0;
    for (int n = 0; n < points; ++n)
        inside += lump.contains({random.uniform(-r, r), random.uniform(-r, r), random.uniform(-r, r)});
    const double share = double(inside) / points;
    const double deviation = std::sqrt(share * (1 - share) / points) / share;
    EXPECT_NEAR(share * 8 * r * r * r / lump.volume(), 1.0, 4 * deviation);
}

TEST(Outline, depth_is_the_distance_to_the_surface_near_it)
{
    const Outline stick = make(0.76, 2.0, 2);
    const coral::sh::Basis basis(10);
    RandomSource random(2, 0);
    for (int n = 0; n < 200; ++n) {
        const Eigen::Vector3d u = random.direction();
        Eigen::Vector3d gradient;
        const double r = basis.sum(stick.coefficients(), u, gradient);
        const Eigen::Vector3d scale(1, 1, stick.stretch());
        const Eigen::Vector3d on_surface = r * scale.cwiseProduct(u);
        const Eigen::Vector3d normal = (r * u - gradient).cwiseQuotient(scale).normalized();
        const double away = 2e-4 * 8e-3;
        EXPECT_NEAR(stick.depth(on_surface), 0, 1e-4 * 8e-3);
        EXPECT_NEAR(stick.depth(on_surface - away * normal), away, 1.1e-4 * 8e-3);
    }
}

TEST(Outline, refuses_a_sphericity_that_cannot_be_had)
{
    EXPECT_THROW(make(0.99, 3.0), std::runtime_error);
}
}  // namespace
