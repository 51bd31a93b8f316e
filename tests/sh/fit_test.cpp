#include "sh/fit.h"

#include <gtest/gtest.h>

#include "bodies.h"
#include "core/error.h"
#include "sdf/mass_properties.h"
#include "sh/quadrature.h"
#include "sh/tabulate.h"

namespace coral::sh::test {
namespace {

TEST(Fit, finds_a_body_of_degree_8_in_its_level_set)
{
    // To 2e-3 of the radius from a level set with R = 20 h.
    const Surface truth = centred(lump(8, 0.12, 7));
    const sdf::DistanceGrid grid = tabulate(truth, 0.05, 0.3);
    const RadialSamples samples = cast_rays(grid, 8);
    EXPECT_EQ(samples.non_star_fraction, 0.0);
    EXPECT_TRUE(samples.centre_inside);
    const Surface found = fit(samples, 8, body_properties(truth).volume);
    EXPECT_LE(found.centre.norm(), 1e-3);
    const Evaluator a(truth), b(found);
    double squares = 0, weight = 0;
    const SphereQuadrature q = sphere_quadrature(20, 40);
    for (std::size_t i = 0; i < q.weights.size(); ++i) {
        const Eigen::Vector3d p = b.point(q.directions[i]);
        squares += q.weights[i] * std::pow(a.radial_distance(p), 2);
        weight += q.weights[i];
    }
    EXPECT_LE(std::sqrt(squares / weight), 2e-3);
    EXPECT_NEAR(body_properties(found).volume / body_properties(truth).volume, 1.0, 1e-6);
}

TEST(Fit, errors_fall_with_the_degree_and_vanish_at_the_true_one)
{
    const Surface truth = centred(lump(8, 0.12, 9));
    const sdf::DistanceGrid grid = tabulate(truth, 0.05, 0.3);
    const FitReference reference(grid);
    const RadialSamples samples = cast_rays(grid, 8);
    double previous = 1;
    for (const int degree : {2, 4, 6, 8}) {
        const FitErrors e = reference.errors(fit(samples, degree, reference.volume()), samples);
        EXPECT_LT(e.rms_error, 0.85 * previous) << degree;
        EXPECT_GE(e.max_error, e.rms_error);
        previous = e.rms_error;
    }
    const FitErrors e = reference.errors(fit(samples, 8, reference.volume()), samples);
    EXPECT_LE(e.rms_error, 1.5e-3);
    EXPECT_LE(e.max_error, 1e-2);
    EXPECT_LE(std::abs(e.volume_error), 5e-3);
    EXPECT_LE(std::abs(e.area_error), 1e-2);
    EXPECT_LE(e.inertia_error, 5e-3);
}

TEST(Fit, error_of_a_sphere_of_the_wrong_radius_is_the_difference)
{
    const sdf::DistanceGrid grid = tabulate(sphere_surface(1.0), 0.05, 0.3);
    const FitReference reference(grid);
    const RadialSamples samples = cast_rays(grid, 2);
    const FitErrors e = reference.errors(sphere_surface(1.1), samples);
    EXPECT_NEAR(e.rms_error, 0.05, 1e-3);  // 0.1 of a diameter of 2
    EXPECT_NEAR(e.max_error, 0.05, 2e-3);
    EXPECT_NEAR(e.area_error, 0.21, 5e-3);
}

TEST(CastRays, tells_a_hook_from_a_star_shaped_body)
{
    // Three quarters of a ring: the centroid lies in its opening.
    const auto ring = [](double s) { return Eigen::Vector3d(std::cos(4.7 * s), std::sin(4.7 * s), 0); };
    const RadialSamples hook = cast_rays(tube(ring, 0.35, 1.5, 0.1), 6);
    EXPECT_FALSE(hook.centre_inside);
    EXPECT_GT(hook.non_star_fraction, non_star_refusal);
    // A gentle bow stays star-shaped.
    const auto bow = [](double s) { return Eigen::Vector3d(2 * s - 1, 0.3 * (2 * s - 1) * (2 * s - 1), 0); };
    const RadialSamples stick = cast_rays(tube(bow, 0.45, 1.7, 0.1), 6);
    EXPECT_TRUE(stick.centre_inside);
    EXPECT_LE(stick.non_star_fraction, non_star_warning);
}

TEST(CastRays, take_the_outermost_exit_over_a_void)
{
    sdf::DistanceGrid grid = tabulate(sphere_surface(1.0), 0.05, 0.2);
    for (int k = 0; k < grid.size.z(); ++k)
        for (int j = 0; j < grid.size.y(); ++j)
            for (int i = 0; i < grid.size.x(); ++i) {
                float& d = grid.distance[grid.index(i, j, k)];
                d = std::max(d, float(0.2 - (grid.node(i, j, k) - Eigen::Vector3d(0.5, 0, 0)).norm()));
            }
    const RadialSamples samples = cast_rays(grid, 6);
    EXPECT_GT(samples.non_star_fraction, 0.01);
    for (const double r : samples.radii) EXPECT_NEAR(r, 1.0, 0.03);
}

TEST(Fit, refuses_what_it_cannot_do)
{
    const RadialSamples samples = cast_rays(tabulate(sphere_surface(1.0), 0.1, 0.3), 4);
    EXPECT_THROW(fit(samples, 5, 1.0), Error);
    sdf::DistanceGrid empty = tabulate(sphere_surface(1.0), 0.1, 0.3);
    std::fill(empty.distance.begin(), empty.distance.end(), 1.0f);
    EXPECT_THROW(cast_rays(empty, 4), Error);
}

}  // namespace
}  // namespace coral::sh::test
