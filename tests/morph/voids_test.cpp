#include "morph/voids.h"

#include <gtest/gtest.h>

#include "morph/apparent_shape.h"
#include "shapes.h"

namespace coral::morph {
namespace {

using test::draw;

/// A voxel centre: the largest ball of a void is looked for at voxel centres, up to 0.87 voxel away from where it belongs.
const Eigen::Vector3d centre(17.5, 17.5, 17.5);

/// Ball of radius 14 with a cavity of radius 6 and a straight mouth of the given radius along +x (none at 0).
Mask flask(double mouth, const Eigen::Vector3d& edges = Eigen::Vector3d::Ones())
{
    const Eigen::Vector3i size = (Eigen::Vector3d::Constant(35).cwiseQuotient(edges)).array().ceil().cast<int>();
    return draw(size, [=](const Eigen::Vector3d& p) {
        const Eigen::Vector3d r = p - centre;
        return r.norm() <= 14 && r.norm() > 6 && !(mouth > 0 && r.x() > 0 && std::hypot(r.y(), r.z()) <= mouth);
    }, edges);
}

std::vector<Void> voids_of(const Mask& solid, double radius)
{
    std::vector<Void> voids;
    const ApparentShape shape = close_with_ball(solid, radius, &voids);
    EXPECT_EQ(voids.size(), shape.void_count);
    return voids;
}

TEST(Voids, of_a_hollow_ball_are_one_closed_void_without_throat)
{
    const std::vector<Void> voids = voids_of(flask(0), 3.0);
    ASSERT_EQ(voids.size(), 1U);
    EXPECT_FALSE(voids[0].open);
    EXPECT_EQ(voids[0].throat_diameter, 0.0);
    EXPECT_EQ(voids[0].voxels, 925U) << "lattice points within 6 of one of them";
    EXPECT_EQ(voids[0].volume, 925.0);
    EXPECT_NEAR(voids[0].width, 12.0, 0.3);
    EXPECT_NEAR(voids[0].depth, 14.0, 0.6);
    EXPECT_LT((voids[0].centroid - centre).norm(), 0.1);
}

TEST(Voids, with_a_mouth_are_as_wide_as_the_mouth_lets_in)
{
    for (const double mouth : {1.6, 2.6, 3.6}) {
        const std::vector<Void> voids = voids_of(flask(mouth), mouth + 1.5);
        ASSERT_EQ(voids.size(), 1U) << mouth;
        EXPECT_TRUE(voids[0].open);
        EXPECT_NEAR(voids[0].throat_diameter, 2.0 * mouth, 1.0) << mouth;
        EXPECT_NEAR(voids[0].width, 12.0, 0.7);
        EXPECT_NEAR(voids[0].depth, 13.0, 1.0) << "from the centre of the cavity to where the ball sags into the mouth";
        EXPECT_GT(voids[0].centroid.x(), centre.x());
    }
}

TEST(Voids, have_slanted_throats_measured_below_the_voxel)
{
    const double radius = 5.0;
    for (const Eigen::Vector3d& way : {Eigen::Vector3d(0.31, -0.85, 0.42), Eigen::Vector3d(-0.6, 0.5, 0.7), Eigen::Vector3d(0.95, 0.2, 0.1), Eigen::Vector3d(-1, -1, -1)}) {
        const Eigen::Vector3d axis = way.normalized(), middle = centre + Eigen::Vector3d(10.3, 9.8, 10.1);
        const Mask body = draw({55, 55, 55}, [=](const Eigen::Vector3d& p) {
            const Eigen::Vector3d r = p - middle;
            return r.norm() <= 24 && r.norm() > 14 && !(r.dot(axis) > 0 && r.cross(axis).norm() <= radius);
        });
        const std::vector<Void> voids = voids_of(body, 7.5);
        ASSERT_EQ(voids.size(), 1U);
        EXPECT_NEAR(voids[0].throat_diameter, 2.0 * radius, 0.5) << way.transpose();
    }
}

TEST(Voids, of_a_pit_have_its_width_for_a_throat)
{
    const double radius = 3.1;
    const Mask pit = draw({35, 35, 35}, [=](const Eigen::Vector3d& p) {
        const Eigen::Vector3d r = p - centre;
        return r.norm() <= 14 && !(r.x() > 2 && std::hypot(r.y(), r.z()) <= radius);
    });
    const std::vector<Void> voids = voids_of(pit, 5.0);
    ASSERT_EQ(voids.size(), 1U);
    EXPECT_TRUE(voids[0].open);
    EXPECT_NEAR(voids[0].throat_diameter, 2.0 * radius, 1.0);
    // The rim lies at 13.65 from the centre, the ball of radius 5 sags by 1.08 below it, the deepest voxel centre is at 2.5.
    EXPECT_NEAR(voids[0].depth, 13.65 - 1.08 - 2.5 - 0.5, 0.7);
}

TEST(Voids, come_by_falling_volume_and_leave_dimples_out)
{
    const Eigen::Vector3d other = centre + Eigen::Vector3d(0, 7, 0);
    const Mask solid = draw({35, 35, 35}, [=](const Eigen::Vector3d& p) {
        return (p - centre).norm() <= 14 && (p - centre + Eigen::Vector3d(0, 5, 0)).norm() > 4 && (p - other).norm() > 2.5;
    });
    const std::vector<Void> voids = voids_of(solid, 3.0);
    ASSERT_EQ(voids.size(), 2U);
    EXPECT_GT(voids[0].volume, voids[1].volume);
    EXPECT_LT((voids[1].centroid - other).norm(), 0.3);
    EXPECT_TRUE(voids_of(test::draw_sphere(40, 15.3), 3.0).empty()) << "a ball has no voids, whatever its steps";
}

TEST(Voids, scale_with_the_voxels)
{
    Mask body = flask(2.6);
    const Void unit = voids_of(body, 4.1).at(0);
    body.voxel_size *= 3e-5;
    const Void small = voids_of(body, 4.1 * 3e-5).at(0), expected = scaled(unit, 3e-5);
    EXPECT_NEAR(small.volume / expected.volume, 1.0, 1e-6);
    EXPECT_NEAR(small.throat_diameter / expected.throat_diameter, 1.0, 1e-5);
    EXPECT_NEAR(small.depth / expected.depth, 1.0, 1e-5);
    EXPECT_LT((small.centroid - expected.centroid).norm(), 1e-9);
}

TEST(Voids, of_voxels_twice_as_high_have_the_same_sizes)
{
    const std::vector<Void> voids = voids_of(flask(3.0, {1, 1, 2}), 4.5);
    ASSERT_EQ(voids.size(), 1U);
    EXPECT_NEAR(voids[0].throat_diameter, 6.0, 2.0);
    EXPECT_NEAR(voids[0].depth, 14.0, 2.0);
    EXPECT_NEAR(voids[0].centroid.z(), centre.z(), 0.3);
}

TEST(Voids, fall_into_closed_and_open_ones_voxel_by_voxel)
{
    for (const double mouth : {0.0, 2.6}) {
        const Mask solid = flask(mouth);
        const ApparentShape shape = close_with_ball(solid, 4.1);
        const std::vector<std::uint8_t> classes = void_classes(solid, shape.apparent);
        const std::uint8_t wanted = mouth > 0 ? 2 : 1;
        EXPECT_EQ(classes[solid.index(17, 17, 17)], wanted);
        const auto count = std::size_t(std::ranges::count(classes, wanted));
        EXPECT_NEAR(double(count), double(shape.open_void + shape.closed_void), 0.05 * double(count));
    }
    const Mask ball = test::draw_sphere(40, 15.3);
    const std::vector<std::uint8_t> none = void_classes(ball, close_with_ball(ball, 3.0).apparent);
    EXPECT_EQ(std::ranges::count(none, 0), std::ptrdiff_t(none.size()));
}

}  // namespace
}  // namespace coral::morph
