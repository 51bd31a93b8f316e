#include "sdf/extend.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "sdf/mass_properties.h"
#include "shapes.h"

namespace coral::sdf::test {
namespace {

constexpr double h = 2e-4;

/// Largest error anywhere in the grid [spacings].
double largest_error(const DistanceGrid& grid, const Distance& truth)
{
    double largest = 0;
    for (int k = 0; k < grid.size.z(); ++k)
        for (int j = 0; j < grid.size.y(); ++j)
            for (int i = 0; i < grid.size.x(); ++i)
                largest = std::max(largest, std::abs(grid.distance[grid.index(i, j, k)] - truth(grid.node(i, j, k))) / grid.spacing);
    return largest;
}

TEST(Extended, reaches_true_distances_far_from_a_sphere_and_deep_in_it)
{
    const Distance truth = sphere(Eigen::Vector3d(0.3, -0.2, 0.4) * h, 10 * h);
    const DistanceGrid band = tabulated(truth, Eigen::Vector3d::Constant(-15 * h), {31, 31, 31}, h, 4, 4);
    const DistanceGrid wide = extended(band, 20 * h);
    EXPECT_LE(largest_error(wide, truth), 0.02);
    EXPECT_TRUE(wide.inside_box(Eigen::Vector3d(30.3 * h, 0, 0)));
    EXPECT_TRUE(wide.inside_box(Eigen::Vector3d(0, 0, -29.6 * h)));
    EXPECT_TRUE(std::isinf(wide.outside_limit) && std::isinf(wide.inside_limit));
}

TEST(Extended, keeps_the_band_bit_for_bit)
{
    const Distance truth = sphere(Eigen::Vector3d::Zero(), 8 * h);
    const DistanceGrid band = tabulated(truth, Eigen::Vector3d::Constant(-13 * h), {27, 27, 27}, h, 3, 4);
    const DistanceGrid wide = extended(band, 10 * h);
    const Eigen::Vector3i shift = ((band.origin - wide.origin) / h).array().round().cast<int>();
    int kept = 0;
    for (int k = 0; k < 27; ++k)
        for (int j = 0; j < 27; ++j)
            for (int i = 0; i < 27; ++i) {
                const float d = band.distance[band.index(i, j, k)];
                if (d <= -float(band.inside_limit) || d >= float(band.outside_limit)) continue;
                EXPECT_EQ(d, wide.distance[wide.index(i + shift.x(), j + shift.y(), k + shift.z())]);
                ++kept;
            }
    EXPECT_GT(kept, 1000);
}

TEST(Extended, keeps_a_closed_cavity_and_fills_it_with_distances)
{
    const Distance truth = shell(Eigen::Vector3d(0.2, 0.1, -0.3) * h, 20 * h, 12 * h);
    const DistanceGrid band = tabulated(truth, Eigen::Vector3d::Constant(-26 * h), {53, 53, 53}, h, 4, 4);
    const DistanceGrid wide = extended(band, 15 * h);
    // Next to the cavity's centre every surface point is nearest: the feet's own error is all there is.
    EXPECT_LE(largest_error(wide, truth), 0.02);
    EXPECT_NEAR(wide.sample(Eigen::Vector3d(0.2, 0.1, -0.3) * h), 12 * h, 0.8 * h);  // a cone, cut by the trilinear cell
    EXPECT_NEAR(solid_volume(wide) / solid_volume(band), 1.0, 1e-9);
}

TEST(Extended, of_a_torus_is_right_across_its_hole)
{
    const Distance truth = torus(Eigen::Vector3d(0.4, 0.1, 0.2) * h, some_rotation(1.1), 16 * h, 6 * h);
    const DistanceGrid band = tabulated(truth, Eigen::Vector3d::Constant(-26 * h), {53, 53, 53}, h, 3, 3);
    EXPECT_LE(largest_error(extended(band, 12 * h), truth), 0.06);
}

TEST(Extended, refuses_a_band_too_narrow_for_its_surface)
{
    const DistanceGrid band = tabulated(sphere(Eigen::Vector3d::Zero(), 8 * h), Eigen::Vector3d::Constant(-13 * h), {27, 27, 27}, h, 1, 1);
    EXPECT_THROW(extended(band, 10 * h), Error);
}

}  // namespace

TEST(Trimmed, keeps_the_surface_and_the_margin)
{
    const double radius = 6.3, h = 1.0;
    const auto distance = [&](const Eigen::Vector3d& x) { return (x - Eigen::Vector3d(1.2, -0.4, 0.1)).norm() - radius; };
    const DistanceGrid wide = tabulated(distance, {-12, -13, -14}, {25, 27, 29}, h);
    const DistanceGrid part = trimmed(wide, 2);
    EXPECT_LT(part.node_count(), wide.node_count() / 4);
    for (int k = 0; k < wide.size.z(); ++k)
        for (int j = 0; j < wide.size.y(); ++j)
            for (int i = 0; i < wide.size.x(); ++i) {
                const Eigen::Vector3d x = wide.node(i, j, k);
                if (distance(x) > 2.0 / std::sqrt(3.0)) continue;
                ASSERT_TRUE(part.inside_box(x));
                EXPECT_EQ(part.sample(x), wide.sample(x));
            }
    for (const float border : {part.distance.front(), part.distance.back()}) EXPECT_GT(border, 0.0f);
    EXPECT_EQ(trimmed(part, 2).size, part.size);
}

}  // namespace coral::sdf::test
