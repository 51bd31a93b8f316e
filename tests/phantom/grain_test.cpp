#include "phantom/grain.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "phantom/components.h"

namespace {
using namespace coral::phantom;
using std::numbers::pi;

GrainImage image_of(const VoidSpec& voids, double sphericity = 0.9, int across = 30, int supersample = 3,
                    std::uint64_t stream = 0)
{
    RandomSource random(3, stream);
    GrainSpec spec;
    spec.outline.sphericity = sphericity;
    spec.voids = voids;
    const Grain grain(spec, random);
    return grain.image(Eigen::Vector3d::Constant(spec.outline.equivalent_diameter / across), supersample);
}

TEST(Grain, without_voids_has_the_volume_of_its_outline)
{
    VoidSpec none;
    none.porosity = 0;
    const GrainImage image = image_of(none);
    EXPECT_NEAR(image.truth.volume / image.truth.apparent_volume, 1.0, 1e-3);
    EXPECT_EQ(image.truth.void_count, 0);
}

TEST(Grain, has_the_porosity_asked_for)
{
    for (const double porosity : {0.15, 0.3, 0.4}) {
        VoidSpec voids;
        voids.porosity = porosity;
        EXPECT_NEAR(image_of(voids).truth.intraparticle_porosity, porosity, 0.005);
    }
}

TEST(Grain, sealed_chambers_are_its_only_voids_and_have_the_volume_of_their_spheres)
{
    VoidSpec voids;
    voids.channels = 0;
    voids.chambers = 3;
    voids.compartments = 1;
    voids.open_share = 0;
    voids.sponge = false;
    const Truth truth = image_of(voids, 0.93, 50).truth;
    double spheres = 0;
    for (const double r : truth.chamber_radii) spheres += 4 * pi / 3 * r * r * r;
    EXPECT_EQ(truth.chamber_radii.size(), 3u);
    EXPECT_EQ(truth.closed_void_count, 3);
    EXPECT_EQ(truth.open_void_count, 0);
    EXPECT_EQ(truth.open_void_volume, 0);
    EXPECT_NEAR(truth.closed_void_volume / spheres, 1.0, 5e-3);
    EXPECT_NEAR(truth.intraparticle_porosity, spheres / truth.apparent_volume, 1e-3);
}

TEST(Grain, compartments_are_open_or_sealed_as_asked)
{
    VoidSpec voids;
    voids.channels = voids.chambers = 0;
    voids.open_share = 0;
    const Truth sealed = image_of(voids).truth;
    EXPECT_EQ(sealed.open_void_volume, 0);
    EXPECT_GE(sealed.closed_void_count, voids.compartments);
    voids.open_share = 1;
    const Truth open = image_of(voids).truth;
    EXPECT_GT(open.open_void_volume, 0.8 * (open.open_void_volume + open.closed_void_volume));
}

TEST(Grain, channels_are_free_to_their_throat_radius_and_walled_beyond_it)
{
    VoidSpec voids;
    voids.porosity = 0.12;
    voids.channels = 1;
    voids.chambers = 0;
    voids.compartments = 1;
    voids.open_share = 0;
    RandomSource random(9, 0);
    GrainSpec spec;
    spec.outline.sphericity = 0.93;
    spec.voids = voids;
    const Grain grain(spec, random);
    const Channel channel = grain.voids().channels().front();
    const double d = grain.outline().equivalent_diameter(), step = d / 60;
    const auto is_solid = [&](const Eigen::Vector3d& p) {
        const double depth = grain.outline().depth(p);
        return depth >= 0 && !grain.voids().is_void(p, depth, static_cast<float>(grain.voids().field().at(p)));
    };
    // Along the axis the free radius is the throat radius until the mouth.
    const double mouth = [&] {
        double s = 0;
        while (grain.outline().depth(channel.centre + s * channel.direction) > channel.throat_radius) s += step;
        return s;
    }();
    Eigen::Vector3d side = channel.direction.unitOrthogonal();
    for (double s = channel.ball_radius; s < mouth; s += step) {
        for (int turn = 0; turn < 8; ++turn) {
            const Eigen::Vector3d out = Eigen::AngleAxisd(turn * pi / 4, channel.direction) * side;
            const Eigen::Vector3d axis_point = channel.centre + s * channel.direction;
            EXPECT_FALSE(is_solid(axis_point + 0.99 * channel.throat_radius * out));
            EXPECT_TRUE(s < channel.ball_radius * 1.01 || is_solid(axis_point + 1.01 * channel.throat_radius * out));
        }
    }
}

TEST(Grain, has_the_same_figures_at_another_voxel_size)
{
    const VoidSpec voids;
    const Truth coarse = image_of(voids, 0.88, 24).truth, fine = image_of(voids, 0.88, 48).truth;
    EXPECT_NEAR(coarse.volume, fine.volume, 3e-3 * fine.volume);
    EXPECT_NEAR(coarse.closed_void_volume, fine.closed_void_volume, 0.02 * fine.apparent_volume);
    EXPECT_EQ(coarse.throat_diameters, fine.throat_diameters);
    EXPECT_EQ(coarse.chamber_radii, fine.chamber_radii);
}

TEST(Grain, refuses_chambers_that_exceed_the_porosity)
{
    VoidSpec voids;
    voids.porosity = 0.001;
    EXPECT_THROW(image_of(voids), coral::UsageError);
}

TEST(Components, tell_faces_from_corners)
{
    const std::vector<std::uint8_t> state{1, 0, 0, 1};  // 2 x 2 x 1, diagonal
    std::vector<std::int32_t> piece;
    EXPECT_EQ(label_pieces(state, 1, {2, 2, 1}, true, piece).size(), 2u);
    EXPECT_EQ(label_pieces(state, 1, {2, 2, 1}, false, piece).size(), 3u);
}
}  // namespace
