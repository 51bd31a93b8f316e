#include "morph/watershed.h"

#include <gtest/gtest.h>

#include <set>

#include "core/error.h"
#include "core/parallel.h"
#include "shapes.h"

namespace coral::morph {
namespace {

/// 2 x 2 x 2 spheres of radius 12 that overlap by one voxel, each with holes of radius `hole` on a lattice.
Mask touching_spheres(double hole)
{
    const double pitch = 23.0;
    return test::draw({50, 50, 50}, [=](const Eigen::Vector3d& p) {
        bool solid = false;
        for (int n = 0; n < 8; ++n) {
            const Eigen::Vector3d c = Eigen::Vector3d::Constant(13.5) + pitch * Eigen::Vector3d(n & 1, n >> 1 & 1, n >> 2 & 1);
            solid = solid || (p - c).norm() <= 12.0;
        }
        const Eigen::Vector3d in_cell = p.unaryExpr([](double x) { return x - 6.0 * std::round(x / 6.0); });
        return solid && in_cell.norm() > hole;
    });
}

std::size_t largest_difference_to_spheres(const Mask& solid, const std::vector<std::uint32_t>& labels)
{
    // Every sphere's own voxels (within 10 of its centre) must carry one label, and no two spheres the same one.
    std::set<std::uint32_t> used;
    std::size_t wrong = 0;
    for (int n = 0; n < 8; ++n) {
        const Eigen::Vector3d c = Eigen::Vector3d::Constant(13.5) + 23.0 * Eigen::Vector3d(n & 1, n >> 1 & 1, n >> 2 & 1);
        std::uint32_t own = 0;
        for (int k = 0; k < 50; ++k)
            for (int j = 0; j < 50; ++j)
                for (int i = 0; i < 50; ++i) {
                    const std::size_t v = solid.index(i, j, k);
                    if (!solid.voxels[v] || (Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5) - c).norm() > 10.0) continue;
                    if (own == 0) own = labels[v];
                    wrong += labels[v] != own;
                }
        used.insert(own);
    }
    return wrong + (8 - used.size()) * 1000;
}

TEST(Watershed, parts_touching_spheres)
{
    const Mask solid = touching_spheres(0.0);
    const WatershedResult result = split_touching_grains(solid, {});
    EXPECT_EQ(result.grains, 8U);
    EXPECT_EQ(largest_difference_to_spheres(solid, result.labels), 0U);
}

TEST(Watershed, does_not_break_porous_spheres_at_their_voids)
{
    const Mask solid = touching_spheres(1.7);
    const WatershedResult result = split_touching_grains(solid, {2.4});
    EXPECT_EQ(result.grains, 8U);
    EXPECT_EQ(largest_difference_to_spheres(solid, result.labels), 0U);
}

TEST(Watershed, finds_the_closing_radius_itself)
{
    const WatershedResult result = split_touching_grains(touching_spheres(1.7), {});
    EXPECT_EQ(result.grains, 8U);
    EXPECT_NEAR(result.closing_radius, 2.4, 0.5);
}

TEST(Watershed, parts_27_touching_porous_ellipsoids)
{
    // 3 x 3 x 3 grains of unlike axes that overlap by a voxel or two, a quarter of each taken up by voids of radius 2.
    const auto centre = [](int n) { return Eigen::Vector3d(Eigen::Vector3d::Constant(16.3) + 26.0 * Eigen::Vector3d(n % 3, n / 3 % 3, n / 9)); };
    const auto depth = [&](const Eigen::Vector3d& p, int n) {
        const Eigen::Vector3d axes = Eigen::Vector3d(13.6, 14.2, 13.2) + Eigen::Vector3d(n % 2, 0.5 * (n % 3), 0.7 * (n % 4));
        return (p - centre(n)).cwiseQuotient(axes).norm();
    };
    const Mask solid = test::draw({86, 86, 86}, [&](const Eigen::Vector3d& p) {
        const Eigen::Vector3d in_cell = p.unaryExpr([](double x) { return x - 7.0 * std::round(x / 7.0); });
        if (in_cell.norm() <= 2.0) return false;
        for (int n = 0; n < 27; ++n)
            if (depth(p, n) <= 1.0) return true;
        return false;
    });
    const WatershedResult result = split_touching_grains(solid, {});
    EXPECT_EQ(result.grains, 27U);
    std::set<std::uint32_t> used;
    for (int n = 0; n < 27; ++n) {  // the core of each grain carries one label of its own
        std::set<std::uint32_t> own;
        for (int k = 0; k < 86; ++k)
            for (int j = 0; j < 86; ++j)
                for (int i = 0; i < 86; ++i)
                    if (solid.voxels[solid.index(i, j, k)] && depth(Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5), n) < 0.75)
                        own.insert(result.labels[solid.index(i, j, k)]);
        EXPECT_EQ(own.size(), 1U) << n;
        used.insert(own.begin(), own.end());
    }
    EXPECT_EQ(used.size(), 27U);
}

TEST(Watershed, labels_solid_only_and_all_of_it)
{
    const Mask solid = touching_spheres(1.7);
    const WatershedResult result = split_touching_grains(solid, {2.4});
    for (std::size_t v = 0; v < solid.voxels.size(); ++v) ASSERT_EQ(result.labels[v] != 0, solid.voxels[v] != 0);
}

TEST(Watershed, does_not_depend_on_the_thread_count)
{
    const Mask solid = touching_spheres(1.7);
    set_thread_count(1);
    const auto one = split_touching_grains(solid, {2.4}).labels;
    set_thread_count(3);
    EXPECT_EQ(one, split_touching_grains(solid, {2.4}).labels);
    set_thread_count(0);
}

TEST(Watershed, refuses_an_empty_stack) { EXPECT_THROW(split_touching_grains(make_mask({4, 4, 4}, Eigen::Vector3d::Ones()), {}), Error); }

}  // namespace
}  // namespace coral::morph
