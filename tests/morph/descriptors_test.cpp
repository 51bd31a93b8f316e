#include "morph/descriptors.h"

#include <gtest/gtest.h>

#include <random>

#include <Eigen/Geometry>
#include <map>
#include <numbers>

#include "core/error.h"
#include "morph/extraction.h"
#include "morph/hull.h"
#include "morph/oriented_box.h"
#include "morph/surface.h"
#include "shapes.h"

namespace coral::morph {
namespace {

constexpr double pi = std::numbers::pi;

Descriptors measured(const Mask& mask) { return measure(mask, close_with_ball(mask, default_closing_radius(mask))); }

TEST(Surface, of_a_sphere_has_its_area_and_volume)
{
    for (const double r : {10.0, 20.0}) {
        const SurfaceMesh mesh = extract_surface(test::draw_sphere(int(2 * r) + 6, r));
        EXPECT_NEAR(surface_area(mesh) / (4 * pi * r * r), 1.0, 0.015) << r;
        EXPECT_NEAR(enclosed_volume(mesh) / (4.0 / 3.0 * pi * r * r * r), 1.0, 2.0 / (r * r)) << r;  // smoothing: 3 (0.7 / r)^2
    }
}

TEST(Surface, is_closed_and_oriented)
{
    const SurfaceMesh mesh = extract_surface(test::draw_sphere(24, 9.0));
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : mesh.triangles)
        for (std::size_t n = 0; n < 3; ++n) ++edges[{t[n], t[(n + 1) % 3]}];
    for (const auto& [edge, count] : edges) {
        ASSERT_EQ(count, 1);
        ASSERT_TRUE(edges.contains({edge.second, edge.first}));
    }
    EXPECT_EQ(mesh.vertices.size() + mesh.triangles.size(), edges.size() / 2 + 2);  // Euler: a sphere
}

TEST(Surface, follows_the_voxel_edges)
{
    const Eigen::Vector3d edges(1.0, 1.3, 2.0);
    const Mask mask = test::draw({30, 24, 16}, [](const Eigen::Vector3d& p) { return (p - Eigen::Vector3d(15, 15.6, 16)).norm() <= 12.0; }, edges);
    EXPECT_NEAR(surface_area(extract_surface(mask)) / (4 * pi * 144.0), 1.0, 0.03);
}

TEST(Probit, inverts_the_normal_distribution)
{
    for (const double x : {-3.0, -1.7, -0.2, 0.0, 0.9, 2.8}) EXPECT_NEAR(probit(0.5 * std::erfc(-x / std::sqrt(2.0))), x, 1e-7);
}

TEST(Curvature, of_a_sphere_is_one_over_its_radius)
{
    const double r = 20.0;
    double area = 0, sum = 0;
    for (const CurvatureSample& s : surface_curvature(test::draw_sphere(48, r), 2.5)) {
        ASSERT_NEAR(s.largest_curvature * r, 1.0, 0.5);  // the voxel steps show, and the largest of two takes their upper side
        area += s.area;
        sum += s.area * s.largest_curvature * r;
    }
    EXPECT_NEAR(sum / area, 1.0, 0.1);
}

TEST(Hull, of_a_turned_box_gives_its_volume_and_corners)
{
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    std::vector<Eigen::Vector3d> points{turn * Eigen::Vector3d(1, 1, 1)};
    for (int n = 0; n < 8; ++n) points.push_back(turn * Eigen::Vector3d(n & 1 ? 5 : 0, n & 2 ? 3 : 0, n & 4 ? 2 : 0));
    const HullProperties hull = hull_properties(points);
    EXPECT_NEAR(hull.volume, 30.0, 1e-9);
    EXPECT_EQ(hull.corners.size(), 8u);
    points.erase(points.begin());
    points.resize(4);  // one face
    EXPECT_THROW(hull_properties(points), Error);
}

TEST(LeastBox, finds_boxes_known_exactly_however_they_are_turned)
{
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (int trial = 0; trial < 20; ++trial) {
        const Eigen::Matrix3d turn = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized().toRotationMatrix();
        std::vector<Eigen::Vector3d> box, tetrahedron;
        for (int n = 0; n < 8; ++n) box.push_back(turn * Eigen::Vector3d(n & 1 ? 5 : 0, n & 2 ? 3 : 0, n & 4 ? 2 : 0));
        EXPECT_NEAR((least_box(box) - Eigen::Vector3d(5, 3, 2)).norm(), 0.0, 1e-6);
        // A regular tetrahedron fits a cube by its face diagonals, and no smaller box [O'Rourke 1985].
        for (const int n : {0, 3, 5, 6}) tetrahedron.push_back(turn * Eigen::Vector3d(n & 1, n >> 1 & 1, n >> 2 & 1));
        EXPECT_NEAR(least_box(tetrahedron).prod(), 1.0, 1e-6);
    }
}

TEST(Descriptors, of_a_sphere_are_all_one)
{
    const Descriptors d = measured(test::draw_sphere(46, 20.0));
    EXPECT_NEAR(d.equivalent_diameter, 40.0, 0.1);
    EXPECT_NEAR(d.sphericity, 1.0, 0.015);
    EXPECT_NEAR(d.convexity, 1.0, 0.03);
    EXPECT_NEAR(d.elongation, 1.0, 0.03);
    EXPECT_NEAR(d.flatness, 1.0, 0.03);
    EXPECT_GT(d.roundness, 0.85);
    EXPECT_LT(d.intraparticle_porosity, 0.01);
}

TEST(Descriptors, of_an_ellipsoid_give_its_axes)
{
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 1, 0.3).normalized()).toRotationMatrix();
    const Mask mask = test::draw({60, 60, 60}, [&](const Eigen::Vector3d& p) {
        return (turn * (p - Eigen::Vector3d(30.2, 29.7, 30.1))).cwiseQuotient(Eigen::Vector3d(25, 18, 12)).norm() <= 1.0;
    });
    const Descriptors d = measured(mask);
    EXPECT_NEAR(d.volume, 4.0 / 3.0 * pi * 25 * 18 * 12, 0.005 * d.volume);
    EXPECT_NEAR(d.elongation, 18.0 / 25.0, 0.02);
    EXPECT_NEAR(d.flatness, 12.0 / 18.0, 0.02);
    // Area by Thomsen's formula, within 1.1 %.
    const double p = 1.6075, area = 4 * pi * std::pow((std::pow(25 * 18, p) + std::pow(25 * 12, p) + std::pow(18 * 12, p)) / 3, 1 / p);
    EXPECT_NEAR(d.apparent_surface_area / area, 1.0, 0.025);
}

TEST(Descriptors, of_a_hollow_sphere_tell_closed_from_open_voids)
{
    const auto shell = [](double bore) {
        const Eigen::Vector3d c(22.1, 21.8, 22.3);
        return test::draw({44, 44, 44}, [=](const Eigen::Vector3d& p) {
            const Eigen::Vector3d r = p - c;
            return r.norm() <= 19 && r.norm() > 10 && !(r.z() > 0 && std::hypot(r.x(), r.y()) < bore);
        });
    };
    const double exact = std::pow(10.0 / 19.0, 3);
    const Descriptors closed = measured(shell(0.0)), open = measured(shell(2.0));
    EXPECT_NEAR(closed.closed_porosity, exact, 0.01 * exact);
    EXPECT_LT(closed.open_porosity, 0.005);
    EXPECT_NEAR(open.open_porosity, exact, 0.1 * exact);
    EXPECT_EQ(open.closed_porosity, 0.0);
    EXPECT_NEAR(open.largest_throat, 4.0, 1.0);
    EXPECT_NEAR(closed.sphericity, 1.0, 0.02);  // of the apparent shape
    EXPECT_GT(closed.surface_area, 1.2 * closed.apparent_surface_area);
}

TEST(Descriptors, of_a_cube_are_less_round_than_of_a_sphere)
{
    const Mask cube = test::draw({46, 46, 46}, [](const Eigen::Vector3d& p) { return (p - Eigen::Vector3d::Constant(23)).cwiseAbs().maxCoeff() <= 16; });
    const Descriptors d = measured(cube);
    EXPECT_NEAR(d.sphericity, std::cbrt(pi / 6), 0.03);
    EXPECT_LT(d.roundness, 0.5);
    EXPECT_NEAR(d.convexity, 1.0, 0.02);
}

TEST(Extraction, drops_and_lists_border_and_small_grains_and_scales_the_rest)
{
    const Eigen::Vector3i size(80, 40, 40);
    std::vector<std::uint32_t> labels(80 * 40 * 40, 0);
    const auto paint = [&](const Eigen::Vector3d& c, double r, std::uint32_t label) {
        for (int k = 0; k < 40; ++k)
            for (int j = 0; j < 40; ++j)
                for (int i = 0; i < 80; ++i)
                    if ((Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5) - c).norm() <= r) labels[std::size_t((k * 40 + j) * 80 + i)] = label;
    };
    paint({14, 20, 20}, 9, 4000000000U);
    paint({45, 20, 20}, 12, 7);
    paint({64, 20, 20}, 2, 9);
    paint({79, 20, 20}, 6, 3);
    ExtractionOptions options;
    options.scale_to = 0.015;
    const Extraction all = extract_grains(labels, size, Eigen::Vector3d::Constant(3e-5), options);
    ASSERT_EQ(all.grains.size(), 2U);
    ASSERT_EQ(all.dropped.size(), 2U);
    EXPECT_EQ(all.dropped[0].box.label, 3U);
    EXPECT_EQ(all.dropped[0].reason, DropReason::border);
    EXPECT_EQ(all.dropped[1].reason, DropReason::small);
    for (const Grain& grain : all.grains) {
        EXPECT_NEAR(grain.shape.equivalent_diameter, 0.015, 1e-9);
        EXPECT_NEAR(double(solid_count(grain.solid.unpack())) * grain.solid.unpack().voxel_volume(), grain.shape.volume, 1e-9 * grain.shape.volume);
    }
    options.scale_to = 0;
    const Extraction plain = extract_grains(labels, size, Eigen::Vector3d::Constant(3e-5), options);
    EXPECT_EQ(plain.grains[0].box.label, 7U);  // by falling volume
    EXPECT_EQ(plain.grains[1].box.label, 4000000000U);
    options.keep_border = true;
    EXPECT_EQ(extract_grains(labels, size, Eigen::Vector3d::Constant(3e-5), options).grains.size(), 3U);
}

}  // namespace
}  // namespace coral::morph
