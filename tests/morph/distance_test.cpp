#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/parallel.h"
#include "morph/components.h"
#include "morph/distance_transform.h"
#include "shapes.h"

namespace coral::morph {
namespace {

Mask random_mask(const Eigen::Vector3i& size, double share, unsigned seed)
{
    std::mt19937_64 random(seed);
    return test::draw(size, [&](const Eigen::Vector3d&) { return std::uniform_real_distribution<>(0, 1)(random) < share; });
}

void compare_with_brute_force(const Mask& mask, const Eigen::Vector3d& edges)
{
    const std::vector<float> d2 = squared_distances(mask.voxels, mask.size, 1, edges);
    for (int k = 0; k < mask.size.z(); ++k)
        for (int j = 0; j < mask.size.y(); ++j)
            for (int i = 0; i < mask.size.x(); ++i) {
                double best = std::numeric_limits<double>::infinity();
                for (int c = 0; c < mask.size.z(); ++c)
                    for (int b = 0; b < mask.size.y(); ++b)
                        for (int a = 0; a < mask.size.x(); ++a)
                            if (mask.voxels[mask.index(a, b, c)])
                                best = std::min(best, Eigen::Vector3d(a - i, b - j, c - k).cwiseProduct(edges).squaredNorm());
                ASSERT_FLOAT_EQ(d2[mask.index(i, j, k)], float(best)) << i << " " << j << " " << k;
            }
}

TEST(DistanceTransform, equals_brute_force_on_cubic_voxels) { compare_with_brute_force(random_mask({13, 17, 11}, 0.02, 1), Eigen::Vector3d::Ones()); }

TEST(DistanceTransform, equals_brute_force_on_anisotropic_voxels) { compare_with_brute_force(random_mask({12, 9, 15}, 0.01, 2), {0.7, 1.0, 2.3}); }

TEST(DistanceTransform, is_infinite_without_features)
{
    const Mask mask = make_mask({4, 5, 6}, Eigen::Vector3d::Ones());
    for (float d : squared_distances(mask.voxels, mask.size, 1, mask.voxel_size)) EXPECT_TRUE(std::isinf(d));
}

TEST(DistanceTransform, does_not_depend_on_the_thread_count)
{
    const Mask mask = random_mask({40, 33, 29}, 0.005, 3);
    set_thread_count(1);
    const auto one = squared_distances(mask.voxels, mask.size, 1, {1.0, 1.1, 1.7});
    set_thread_count(3);
    EXPECT_EQ(one, squared_distances(mask.voxels, mask.size, 1, {1.0, 1.1, 1.7}));
    set_thread_count(0);
}

TEST(Components, touch_over_a_corner_only_with_full_connectivity)
{
    Mask mask = make_mask({4, 4, 4}, Eigen::Vector3d::Ones());
    mask.voxels[mask.index(1, 1, 1)] = mask.voxels[mask.index(2, 2, 2)] = 1;
    EXPECT_EQ(connected_components(mask.voxels, mask.size, 1, Connectivity::full).sizes.size(), 1U);
    EXPECT_EQ(connected_components(mask.voxels, mask.size, 1, Connectivity::faces).sizes.size(), 2U);
}

TEST(Components, equal_a_plain_flood_on_random_voxels)
{
    const Mask mask = random_mask({15, 14, 13}, 0.3, 4);
    const Components parts = connected_components(mask.voxels, mask.size, 1, Connectivity::faces);
    // Flood from the first voxel of each component must find exactly its size; 6-neighbours share labels.
    std::vector<std::size_t> counted(parts.sizes.size(), 0);
    for (std::uint32_t l : parts.labels)
        if (l) ++counted[l - 1];
    EXPECT_EQ(counted, parts.sizes);
    for (int k = 0; k < 13; ++k)
        for (int j = 0; j < 14; ++j)
            for (int i = 1; i < 15; ++i) {
                const auto a = parts.labels[mask.index(i, j, k)], b = parts.labels[mask.index(i - 1, j, k)];
                if (a && b) {
                    EXPECT_EQ(a, b);
                }
            }
    std::vector<std::uint8_t> seen(mask.voxels.size(), 0);
    std::size_t floods = 0;
    for (std::size_t v = 0; v < seen.size(); ++v) {
        if (!mask.voxels[v] || seen[v]) continue;
        ++floods;
        std::vector<std::size_t> stack{v};
        seen[v] = 1;
        while (!stack.empty()) {
            const std::size_t w = stack.back();
            stack.pop_back();
            const int i = int(w % 15), j = int(w / 15 % 14), k = int(w / 210);
            const auto go = [&](int a, int b, int c) {
                if (a < 0 || b < 0 || c < 0 || a > 14 || b > 13 || c > 12) return;
                const std::size_t n = mask.index(a, b, c);
                if (mask.voxels[n] && !seen[n]) seen[n] = 1, stack.push_back(n);
            };
            go(i - 1, j, k), go(i + 1, j, k), go(i, j - 1, k), go(i, j + 1, k), go(i, j, k - 1), go(i, j, k + 1);
        }
    }
    EXPECT_EQ(floods, parts.sizes.size());
}

TEST(Components, keep_the_largest_and_report_the_islands)
{
    Mask mask = test::draw({20, 8, 8}, [](const Eigen::Vector3d& p) { return p.x() < 8 || (p.x() > 10 && p.x() < 12); });
    const Islands islands = keep_largest_component(mask);
    EXPECT_EQ(islands.count, 1U);
    EXPECT_EQ(islands.voxels, 2U * 64U);
    EXPECT_EQ(solid_count(mask), 8U * 64U);
}

}  // namespace
}  // namespace coral::morph
