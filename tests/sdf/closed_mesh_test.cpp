#include "sdf/closed_mesh.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "meshes.h"

namespace coral::sdf::test {
namespace {

const Eigen::Vector3d zero = Eigen::Vector3d::Zero();

TEST(ClosedMesh, turns_an_inside_out_body_outwards)
{
    BodyReport report;
    const TriangleMesh ball = ball_mesh({1, 2, 3}, 1.0), body = closed_body(turned(ball), "ball", &report);
    EXPECT_NEAR(enclosed_volume(body) / enclosed_volume(ball), 1.0, 1e-12);
    EXPECT_EQ(report.turned, ball.triangles.size());
    EXPECT_EQ(report.bodies, 1);
    EXPECT_EQ(report.cavities, 0);
}

TEST(ClosedMesh, turns_single_triangles_that_face_the_wrong_way)
{
    TriangleMesh ball = ball_mesh(zero, 1.0, 3);
    const double volume = enclosed_volume(ball);
    for (std::size_t t = 0; t < ball.triangles.size(); t += 7) std::swap(ball.triangles[t][0], ball.triangles[t][2]);
    BodyReport report;
    EXPECT_NEAR(enclosed_volume(closed_body(ball, "ball", &report)), volume, 1e-12);
    EXPECT_EQ(report.turned, (ball.triangles.size() + 6) / 7);
}

TEST(ClosedMesh, takes_a_surface_inside_another_for_a_cavity_whichever_way_it_turns)
{
    const TriangleMesh outer = ball_mesh(zero, 1.0), inner = ball_mesh({0.1, 0, 0}, 0.5);
    for (const bool turn : {false, true}) {
        BodyReport report;
        const TriangleMesh shell = closed_body(together(outer, turn ? turned(inner) : inner), "shell", &report);
        EXPECT_EQ(report.cavities, 1);
        EXPECT_NEAR(enclosed_volume(shell), enclosed_volume(outer) - enclosed_volume(inner), 1e-12);
        EXPECT_EQ(report.turned, turn ? 0U : inner.triangles.size());
    }
}

TEST(ClosedMesh, keeps_the_largest_of_several_bodies_and_says_what_it_leaves)
{
    const TriangleMesh large = ball_mesh(zero, 1.0, 3), small = ball_mesh({3, 0, 0}, 0.5, 3), loose = ball_mesh(zero, 0.2, 3);
    BodyReport report;
    const TriangleMesh cavity = ball_mesh(zero, 0.6, 3);
    const TriangleMesh body = closed_body(together(together(small, loose), together(large, cavity)), "stones", &report);
    EXPECT_EQ(report.bodies, 3) << "a stone loose in the cavity is a body of its own";
    EXPECT_EQ(report.cavities, 1);
    EXPECT_NEAR(enclosed_volume(body), enclosed_volume(large) - enclosed_volume(cavity), 1e-12);
    EXPECT_NEAR(report.dropped_volume, enclosed_volume(small) + enclosed_volume(loose), 1e-12);
}

TEST(ClosedMesh, counts_the_open_edges_of_a_mesh_with_holes)
{
    TriangleMesh ball = ball_mesh(zero, 1.0, 3);
    ball.triangles.pop_back();
    try {
        closed_body(ball, "holed.stl");
        FAIL();
    } catch (const Error& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with("holed.stl: the surface is not closed: 3 open edges")) << error.what();
    }
}

TEST(ClosedMesh, marks_the_nodes_inside_a_ball)
{
    const TriangleMesh ball = ball_mesh({0.01, -0.02, 0.03}, 1.0);
    const Eigen::Vector3i size = Eigen::Vector3i::Constant(49);
    const std::vector<std::uint8_t> solid = solid_nodes(ball, Eigen::Vector3d::Constant(-1.2), 0.05, size);
    std::size_t wrong = 0, n = 0;
    for (int k = 0; k < 49; ++k)
        for (int j = 0; j < 49; ++j)
            for (int i = 0; i < 49; ++i, ++n) {
                const double r = (Eigen::Vector3d(i, j, k) * 0.05 - Eigen::Vector3d(1.21, 1.18, 1.23)).norm();
                wrong += (r < 0.995 && !solid[n]) || (r > 1.0 && solid[n]);
            }
    EXPECT_EQ(wrong, 0U);
}

TEST(ClosedMesh, is_exact_where_rows_meet_edges_and_vertices)
{
    const TriangleMesh box = box_mesh({1, 1, 1}, {4, 3, 5});
    const Eigen::Vector3i size(7, 7, 8);
    const std::vector<std::uint8_t> solid = solid_nodes(box, zero, 1.0, size);
    // Every node strictly inside is solid, every one strictly outside is not; those on the faces go with one of the two.
    std::size_t n = 0;
    for (int k = 0; k < 8; ++k)
        for (int j = 0; j < 7; ++j)
            for (int i = 0; i < 7; ++i, ++n) {
                const bool in = i > 1 && i < 4 && j > 1 && j < 3 && k > 1 && k < 5, out = i < 1 || i > 4 || j < 1 || j > 3 || k < 1 || k > 5;
                EXPECT_TRUE(!in || solid[n]) << i << " " << j << " " << k;
                EXPECT_TRUE(!out || !solid[n]) << i << " " << j << " " << k;
            }
    EXPECT_EQ(std::ranges::count(solid, 1), 3 * 2 * 4) << "half-open: as many nodes as unit cells";
}

}  // namespace
}  // namespace coral::sdf::test
