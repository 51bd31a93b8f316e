// Superellipsoids: closed forms against integration, tabulated distance against the surface itself.
#include "dem/superellipsoid.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "shapes_for_tests.h"

using namespace coral;
using namespace coral::dem;
using namespace coral::dem::testing;

namespace {

double power(double x, double e) { return std::copysign(std::pow(std::abs(x), e), x); }

/// Barr's parametric surface.
Vec3 surface_point(const Superellipsoid& s, double eta, double omega)
{
    return s.radii.cwiseProduct(Vec3(power(std::cos(eta), s.e1) * power(std::cos(omega), s.e2), power(std::cos(eta), s.e1) * power(std::sin(omega), s.e2),
                                     power(std::sin(eta), s.e1)));
}

/// Distance by looking everywhere on Barr's surface, then ever closer around the best place found.
double searched_distance(const Superellipsoid& s, const Vec3& p)
{
    const double pi = std::numbers::pi;
    double best = 1e300, eta = 0, omega = 0, reach_eta = 0.5 * pi, reach_omega = pi;
    for (int round = 0; round < 40; ++round) {
        const double eta0 = eta, omega0 = omega;
        const int n = round == 0 ? 100 : 6;
        for (int i = -n; i <= n; ++i)
            for (int j = -n; j <= n; ++j) {
                const double at_eta = eta0 + reach_eta * i / n, at_omega = omega0 + reach_omega * j / n;
                const double d = (surface_point(s, at_eta, at_omega) - p).norm();
                if (d < best) best = d, eta = at_eta, omega = at_omega;
            }
        reach_eta *= round == 0 ? 0.04 : 0.6, reach_omega *= round == 0 ? 0.04 : 0.6;
    }
    Vec3 ignored;
    return gauge(s, p, ignored) < 1.0 ? -best : best;
}

}  // namespace

TEST(Superellipsoid, ellipsoid_and_box_are_its_limits)
{
    const Vec3 r(3e-3, 2e-3, 1e-3);
    const Superellipsoid ellipsoid{r, 1, 1}, nearly_box{r, 0.01, 0.01}, octahedron{r, 2, 2};
    EXPECT_NEAR(volume(ellipsoid) / (4.0 / 3.0 * std::numbers::pi * r.prod()), 1.0, 1e-13);
    EXPECT_NEAR(inertia(ellipsoid)(2, 2) / (volume(ellipsoid) / 5 * (r.x() * r.x() + r.y() * r.y())), 1.0, 1e-13);
    EXPECT_NEAR(volume(nearly_box) / (8 * r.prod()), 1.0, 1e-3);
    EXPECT_NEAR(inertia(nearly_box)(0, 0) / (volume(nearly_box) / 3 * (r.y() * r.y() + r.z() * r.z())), 1.0, 1e-3);
    EXPECT_NEAR(volume(octahedron) / (4.0 / 3.0 * r.prod()), 1.0, 1e-12);
    EXPECT_NEAR(inertia(octahedron)(1, 1) / (volume(octahedron) / 10 * (r.x() * r.x() + r.z() * r.z())), 1.0, 1e-12);
}

TEST(Superellipsoid, volume_and_inertia_are_those_of_an_integration)
{
    for (const auto& [e1, e2] : {std::pair{0.4, 0.7}, std::pair{1.0, 0.3}, std::pair{1.6, 1.2}}) {
        const Superellipsoid s{Vec3(1.5, 1.0, 0.7), e1, e2};
        const int n = 90;  // of one octant, smoothed over a cell
        double sum = 0.0;
        Vec3 second = Vec3::Zero();
        for (int i = 0; i < n * n * n; ++i) {
            const Vec3 p = s.radii.cwiseProduct(Vec3(i % n + 0.5, i / n % n + 0.5, i / n / n + 0.5)) / n;
            Vec3 slope;
            const double g = gauge(s, p, slope);
            const double across = slope.cwiseProduct(s.radii).lpNorm<1>() / n;
            const double share = std::clamp(0.5 + (1.0 - g) / across, 0.0, 1.0);
            sum += share;
            second += share * p.cwiseAbs2();
        }
        const double cell = 8.0 * s.radii.prod() / std::pow(n, 3);
        EXPECT_NEAR(volume(s) / (cell * sum), 1.0, 1e-3) << e1 << " " << e2;
        second *= cell;
        const Vec3 moments(second.y() + second.z(), second.x() + second.z(), second.x() + second.y());
        for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(inertia(s)(axis, axis) / moments[axis], 1.0, 2e-3) << axis;
    }
}

TEST(Superellipsoid, tabulated_distance_is_that_to_the_surface)
{
    // Within a tenth of the diameter of the surface, at the default spacing of 1/60: in units of the spacing.
    for (const auto& [e1, e2, rms, most] : {std::tuple{1.0, 1.0, 0.01, 0.02}, std::tuple{0.6, 0.8, 0.01, 0.03}, std::tuple{0.3, 0.3, 0.025, 0.15}, std::tuple{1.5, 1.3, 0.02, 0.1}}) {
        const Superellipsoid s{Vec3(9e-3, 7.5e-3, 6e-3), e1, e2};
        const double spacing = 15e-3 / 60;
        const sdf::DistanceGrid grid = tabulate(s, spacing, 2e-3);
        std::mt19937_64 random(2);
        std::uniform_real_distribution<double> u(-1.0, 1.0);
        double sum = 0.0, worst = 0.0;
        int count = 0;
        while (count < 150) {
            const Vec3 p = 10.5e-3 * Vec3(u(random), u(random), u(random));
            if (std::abs(grid.sample(p)) > 1.5e-3) continue;
            const double error = std::abs(grid.sample(p) - searched_distance(s, p)) / spacing;
            sum += error * error;
            worst = std::max(worst, error);
            ++count;
        }
        std::printf("e1 %.1f e2 %.1f: rms %.4f, worst %.4f of the spacing\n", e1, e2, std::sqrt(sum / count), worst);
        EXPECT_LT(std::sqrt(sum / count), rms) << e1 << " " << e2;
        EXPECT_LT(worst, most) << e1 << " " << e2;
    }
}

TEST(Superellipsoid, nodes_lie_on_the_surface_and_share_its_area)
{
    const Superellipsoid s{Vec3(1.5e-3, 1e-3, 1e-3), 1, 1};
    const auto shape = superellipsoid_shape(s, 0.5e-3);
    EXPECT_EQ(shape->nodes().size(), 2500u);
    double area = 0.0;
    for (const double a : shape->node_areas()) area += a;
    // Prolate spheroid: S = 2 pi a^2 (1 + c/(a e) asin e).
    const double e = std::sqrt(1 - 1 / 2.25);
    EXPECT_NEAR(area / (2 * std::numbers::pi * 1e-6 * (1 + 1.5 / e * std::asin(e))), 1.0, 2e-3);
    Vec3 ignored;
    for (const Vec3& p : shape->nodes()) EXPECT_NEAR(gauge(s, p, ignored), 1.0, 1e-12);
    EXPECT_GE(shape->exterior_reach(), 0.5e-3);
}

TEST(Superellipsoid, refuses_exponents_and_radii_that_make_no_body)
{
    EXPECT_THROW(check({Vec3(1, 1, 0), 1, 1}, "body"), Error);
    EXPECT_THROW(check({Vec3(1, 1, 1), 0, 1}, "body"), Error);
    EXPECT_THROW(check({Vec3(1, 1, 1), 1, 2.5}, "body"), Error);
    EXPECT_THROW(check({Vec3(1, 1, 1), -1, 1}, "body"), Error);
    EXPECT_NO_THROW(check({Vec3(1, 1, 1), 0.1, 2}, "body"));
}
