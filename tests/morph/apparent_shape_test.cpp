#include "morph/apparent_shape.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "shapes.h"

namespace coral::morph {
namespace {

using test::draw;

/// Ball of radius 14 with a cavity of radius 7 and a straight mouth of the given radius along +x.
Mask flask(double mouth)
{
    const Eigen::Vector3d c(17.0, 17.0, 17.0);
    return draw({34, 34, 34}, [=](const Eigen::Vector3d& p) {
        const Eigen::Vector3d r = p - c;
        return r.norm() <= 14 && r.norm() > 7 && !(r.x() > 0 && std::hypot(r.y(), r.z()) <= mouth);
    });
}

TEST(ApparentShape, fills_a_closed_cavity_of_a_hollow_sphere)
{
    const Eigen::Vector3d c(20.2, 19.7, 20.1);
    const Mask shell = draw({40, 40, 40}, [=](const Eigen::Vector3d& p) { return (p - c).norm() <= 17 && (p - c).norm() > 9; });
    const ApparentShape shape = close_with_ball(shell, 3.0);
    const double exact = std::pow(9.0 / 17.0, 3);
    EXPECT_EQ(shape.open_void, 0U);
    EXPECT_EQ(shape.void_count, 1U);
    EXPECT_EQ(shape.largest_throat, 0.0);
    EXPECT_NEAR(double(shape.closed_void) / double(shape.filled), exact, 0.01 * exact);
}

TEST(ApparentShape, leaves_a_convex_body_as_it_is)
{
    const Mask ball = test::draw_sphere(40, 15.3);
    const ApparentShape shape = close_with_ball(ball, 3.0);
    EXPECT_LT(double(shape.filled - shape.solid), 0.01 * double(shape.solid));
    EXPECT_EQ(shape.void_count, 0U);
}

TEST(ApparentShape, keeps_a_mouth_open_for_a_smaller_ball_and_closes_it_for_a_larger)
{
    const double mouth = 3.2;
    const Mask body = flask(mouth);
    const std::size_t cavity = body.index(17, 17, 17);
    EXPECT_EQ(close_with_ball(body, mouth - 1.0).apparent.voxels[cavity], 0);
    EXPECT_EQ(close_with_ball(body, mouth + 1.0).apparent.voxels[cavity], 1);
}

TEST(ApparentShape, measures_the_throat_before_a_cavity)
{
    for (const double mouth : {1.6, 2.6, 3.6}) {
        const ApparentShape shape = close_with_ball(flask(mouth), mouth + 1.5);
        EXPECT_NEAR(shape.largest_throat, 2.0 * mouth, 0.8) << mouth;
        EXPECT_EQ(shape.closed_void, 0U);
        EXPECT_EQ(shape.void_count, 1U);
    }
}

TEST(ApparentShape, equals_its_definition_by_brute_force)
{
    std::mt19937_64 random(5);
    const Eigen::Vector3i size(16, 15, 14);
    const Mask solid = draw(size, [&](const Eigen::Vector3d& p) { return (p - Eigen::Vector3d(8, 7, 7)).norm() < 6 && random() % 3 == 0; });
    const double radius = 2.2, reach = radius + 0.5;
    const ApparentShape shape = close_with_ball(solid, radius);
    const Mask box = padded(solid, 7);
    std::vector<Eigen::Vector3d> solids;
    std::vector<std::uint8_t> clear(box.count(), 1), reached(box.count(), 0);
    const auto point = [&](std::size_t v) {
        return Eigen::Vector3d(double(v % std::size_t(box.size.x())), double(v / std::size_t(box.size.x()) % std::size_t(box.size.y())),
                               double(v / std::size_t(box.size.x() * box.size.y())));
    };
    for (std::size_t v = 0; v < box.count(); ++v)
        if (box.voxels[v]) solids.push_back(point(v));
    for (std::size_t v = 0; v < box.count(); ++v)
        for (const auto& s : solids) clear[v] &= (point(v) - s).squaredNorm() >= reach * reach;
    std::vector<std::size_t> stack{0};
    reached[0] = 1;
    std::vector<Eigen::Vector3d> centres;
    while (!stack.empty()) {
        const Eigen::Vector3i p = point(stack.back()).cast<int>();
        stack.pop_back();
        centres.push_back(p.cast<double>());
        for (int a = 0; a < 3; ++a)
            for (int s : {-1, 1}) {
                Eigen::Vector3i q = p;
                q[a] += s;
                if (q[a] < 0 || q[a] >= box.size[a]) continue;
                const std::size_t n = box.index(q.x(), q.y(), q.z());
                if (clear[n] && !reached[n]) reached[n] = 1, stack.push_back(n);
            }
    }
    for (int k = 0; k < size.z(); ++k)
        for (int j = 0; j < size.y(); ++j)
            for (int i = 0; i < size.x(); ++i) {
                bool touched = false;
                for (const auto& c : centres) touched = touched || (c - Eigen::Vector3d(i + 7, j + 7, k + 7)).squaredNorm() <= reach * reach;
                const bool expected = !touched || solid.voxels[solid.index(i, j, k)];
                ASSERT_EQ(bool(shape.apparent.voxels[solid.index(i, j, k)]), expected) << i << " " << j << " " << k;
            }
}

TEST(ApparentShape, scales_with_the_voxel_edge)
{
    Mask body = flask(2.6);
    const ApparentShape unit = close_with_ball(body, 4.0);
    body.voxel_size *= 3e-5;
    const ApparentShape small = close_with_ball(body, 4.0 * 3e-5);
    EXPECT_EQ(unit.apparent.voxels, small.apparent.voxels);
    EXPECT_NEAR(small.largest_throat, 3e-5 * unit.largest_throat, 1e-12);
}

}  // namespace
}  // namespace coral::morph
