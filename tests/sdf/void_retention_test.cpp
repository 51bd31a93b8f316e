#include "sdf/void_retention.h"

#include <gtest/gtest.h>

#include "shapes.h"

namespace coral::sdf::test {
namespace {

/// Ball of radius 15 with a cavity of radius 8 and a mouth of the given radius along +x, and what its level sets keep at a spacing.
VoidRetention flask_at(double spacing, double mouth)
{
    const Eigen::Vector3d c(18.2, 17.8, 18.1);
    const Distance flask = [=](const Eigen::Vector3d& x) {
        const Eigen::Vector3d r = x - c;
        const double tube = r.x() < 0 ? 1.0 : std::hypot(r.y(), r.z()) - mouth;
        return std::max({r.norm() - 15, 8 - r.norm(), mouth > 0 ? -tube : -1.0});
    };
    const Eigen::Vector3i size(37, 37, 37);
    const Mask solid = voxelise(flask, size, Eigen::Vector3d::Ones()), apparent = voxelise(sphere(c, 15), size, Eigen::Vector3d::Ones());
    std::vector<std::uint8_t> classes(solid.voxels.size());
    for (std::size_t v = 0; v < classes.size(); ++v) classes[v] = apparent.voxels[v] && !solid.voxels[v] ? (mouth > 0 ? 2 : 1) : 0;
    LevelSetOptions options;
    options.spacing = spacing;
    return void_retention(solid.view, apparent.view, classes, grain_from_masks(solid.view, apparent.view, options));
}

TEST(VoidRetention, is_nearly_whole_at_the_voxel_edge)
{
    const VoidRetention kept = flask_at(1.0, 3.0);
    EXPECT_NEAR(kept.retained(), 1.0, 0.005);
    EXPECT_GT(kept.overlap(), 0.96);
    EXPECT_LT(kept.lost_link(), 0.04);
    EXPECT_NEAR(kept.voids, kept.masked, 1e-9);
    EXPECT_NEAR(kept.open, kept.voids, 1e-9);
}

TEST(VoidRetention, falls_with_the_spacing_while_the_sum_does_not_show_it)
{
    const VoidRetention fine = flask_at(1.0, 3.0), coarse = flask_at(5.0, 3.0);
    EXPECT_LT(coarse.overlap(), fine.overlap());
    EXPECT_GT(coarse.solid_lost, fine.solid_lost);
    EXPECT_LT(std::abs(coarse.retained() - 1.0), 1.0 - coarse.overlap()) << "the sum hides what lies in the wrong place";
}

TEST(VoidRetention, tells_when_a_throat_closes)
{
    // A mouth of diameter 3 survives 1 voxel between nodes; from 5 on it is little more than half a spacing wide.
    EXPECT_LT(flask_at(1.0, 1.5).lost_link(), 0.1);
    // Whether one closes depends on where the rows of nodes fall, so several spacings are tried.
    double most = 0;
    for (const double spacing : {5.0, 5.5, 6.0, 6.5}) most = std::max(most, flask_at(spacing, 1.5).lost_link());
    EXPECT_GT(most, 0.9);
    EXPECT_GT(flask_at(6.0, 1.5).overlap(), 0.6) << "the cavity itself is still there";
}

TEST(VoidRetention, of_a_closed_cavity_has_no_link_to_lose)
{
    const VoidRetention kept = flask_at(2.0, 0.0);
    EXPECT_EQ(kept.open, 0.0);
    EXPECT_EQ(kept.lost_link(), 0.0);
    EXPECT_GT(kept.overlap(), 0.93);
}

}  // namespace
}  // namespace coral::sdf::test
