// Pictures of samples whose look is known.
#include "pack/picture.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>

#include "core/output_file.h"
#include "core/parallel.h"
#include "pack/scratch.h"

using namespace coral::pack;

namespace {

/// A coarse sphere of 10 mm in the middle of a box, and fines in front of and behind the plane of the cut.
Sample three_spheres()
{
    Sample sample;
    sample.size = {0.02, 0.02, 0.02};
    sample.shapes = {unit_sphere()};
    sample.materials.resize(1);
    for (const auto& [position, diameter, role] : {std::tuple{Eigen::Vector3d(0.01, 0.01, 0.01), 0.01, Role::coarse}, std::tuple{Eigen::Vector3d(0.01, 0.002, 0.01), 0.002, Role::fine},
                                                   std::tuple{Eigen::Vector3d(0.003, 0.016, 0.017), 0.004, Role::fine}}) {
        Particle p;
        p.position = position;
        p.scale = diameter;
        p.role = role;
        sample.particles.push_back(p);
    }
    return sample;
}

std::array<int, 3> pixel(const Picture& picture, int x, int y)
{
    const std::size_t at = 3 * (std::size_t(y) * std::size_t(picture.width) + std::size_t(x));
    return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
}

}  // namespace

TEST(SamplePicture, shows_the_cut_face_and_no_fines_in_front_of_it)
{
    const Picture picture = draw_sample(three_spheres(), 300);
    ASSERT_EQ(picture.rgb.size(), std::size_t(picture.width * picture.height * 3));
    EXPECT_EQ(std::max(picture.width, picture.height), 300);
    EXPECT_EQ(pixel(picture, 0, 0), (std::array{255, 255, 255}));
    int caps = 0, yellow = 0, violet = 0;
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            const auto [r, g, b] = pixel(picture, x, y);
            caps += r > 235 && r < 254 && b > 190 && b < 220;
            yellow += r > 150 && b < 0.5 * r;
            violet += b > 1.1 * r && b > 1.5 * g;
        }
    // the disc of 10 mm, seen at the angle between the rays and the plane
    const double edge = 0.02 * 1.04 * 0.95 / 300;
    EXPECT_GT(caps, 0.5 * std::numbers::pi * 25e-6 * 0.88 / (edge * edge) * 0.5);
    EXPECT_GT(yellow, 300);
    EXPECT_EQ(violet, 0);
}

TEST(SamplePicture, is_the_same_for_any_number_of_threads_and_written_as_png)
{
    coral::set_thread_count(1);
    const Picture one = draw_sample(three_spheres(), 120);
    coral::set_thread_count(2);
    const Picture two = draw_sample(three_spheres(), 120);
    EXPECT_EQ(one.rgb, two.rgb);
    write_png(one, scratch("sample.png"));
    EXPECT_EQ(coral::read_text_file(scratch("sample.png")).substr(1, 3), "PNG");
    EXPECT_THROW(check_png("picture.gif"), std::exception);
}
