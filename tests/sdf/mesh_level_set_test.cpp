#include "sdf/mesh_level_set.h"

#include <gtest/gtest.h>

#include "core/parallel.h"
#include "meshes.h"
#include "sdf/closed_mesh.h"
#include "sdf/mass_properties.h"

namespace coral::sdf::test {
namespace {

LevelSetOptions at_spacing(double spacing)
{
    LevelSetOptions options;
    options.spacing = spacing;
    return options;
}

TEST(MeshLevelSet, of_a_ball_is_its_distance)
{
    const Eigen::Vector3d centre(0.013, -0.021, 0.037);
    LevelSetReport report;
    const DistanceGrid grid = level_set_from_mesh(ball_mesh(centre, 1.0, 6), at_spacing(0.05), &report);
    const DistanceError error = distance_error(grid, sphere(centre, 1.0), 0.2, 0.05);
    EXPECT_LT(error.rms, 0.03);
    EXPECT_EQ(error.wrong_signs, 0);
    EXPECT_NEAR(report.volume / report.voxel_volume, 1.0, 5e-4);
    EXPECT_EQ(report.solid_components, 1);
    EXPECT_NEAR(grid.outside_limit, 9 * 0.05, 1e-6);
}

TEST(MeshLevelSet, keeps_a_closed_cavity)
{
    const TriangleMesh shell = closed_body(together(ball_mesh(Eigen::Vector3d::Zero(), 1.0), ball_mesh({0.1, 0, 0}, 0.5)), "shell");
    const DistanceGrid grid = level_set_from_mesh(shell, at_spacing(0.04));
    EXPECT_NEAR(grid.sample({0.1, 0, 0}), 9 * 0.04, 1e-4) << "void, beyond the band";
    EXPECT_NEAR(grid.sample({0.1 + 0.4, 0, 0}), 0.1, 0.25 * 0.04);
    EXPECT_NEAR(grid.sample({-0.7, 0, 0}), -0.24, 5e-3) << "solid between the two surfaces, clamped to six nodes";
    EXPECT_NEAR(solid_volume(grid) / enclosed_volume(shell), 1.0, 1e-3);
}

TEST(MeshLevelSet, keeps_a_slit_open_that_is_a_node_wide)
{
    // A box with a blind slit 1.3 spacings wide, as one closed surface: two slabs and a back wall, drawn as the surface of their union.
    TriangleMesh mesh;
    const double w = 0.13, depth = 0.7;
    const auto quad = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
        const int n = int(mesh.vertices.size());
        mesh.vertices.insert(mesh.vertices.end(), {a, b, c, d});
        mesh.triangles.emplace_back(n, n + 1, n + 2);
        mesh.triangles.emplace_back(n, n + 2, n + 3);
    };
    // Outline in x-z, a U lying on its side, swept along y from 0 to 1.
    const std::vector<Eigen::Vector2d> outline = {{0, 0}, {1, 0}, {1, 0.5 - w / 2}, {1 - depth, 0.5 - w / 2}, {1 - depth, 0.5 + w / 2}, {1, 0.5 + w / 2}, {1, 1}, {0, 1}};
    for (std::size_t n = 0; n < outline.size(); ++n) {
        const Eigen::Vector2d p = outline[n], q = outline[(n + 1) % outline.size()];
        quad({p.x(), 0, p.y()}, {q.x(), 0, q.y()}, {q.x(), 1, q.y()}, {p.x(), 1, p.y()});
    }
    for (const double y : {0.0, 1.0}) {  // caps, triangulated by hand round the slit
        const auto at = [&](std::size_t n) { return Eigen::Vector3d(outline[n].x(), y, outline[n].y()); };
        for (const auto& t : {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 7}, {4, 5, 6}, {4, 6, 7}}) {
            const int n = int(mesh.vertices.size());
            for (const std::size_t corner : t) mesh.vertices.push_back(at(corner));
            mesh.triangles.emplace_back(n, n + 1, n + 2);
        }
    }
    // Corners are shared by position, as a reader joins them.
    TriangleMesh welded;
    std::map<std::array<double, 3>, int> known;
    for (Eigen::Vector3i t : mesh.triangles) {
        for (int c = 0; c < 3; ++c) {
            const Eigen::Vector3d p = mesh.vertices[std::size_t(t[c])];
            const auto [place, added] = known.emplace(std::array{p.x(), p.y(), p.z()}, int(welded.vertices.size()));
            if (added) welded.vertices.push_back(p);
            t[c] = place->second;
        }
        welded.triangles.push_back(t);
    }
    const TriangleMesh body = closed_body(welded, "slit");
    EXPECT_NEAR(enclosed_volume(body), 1.0 - w * depth, 1e-12);
    const DistanceGrid grid = level_set_from_mesh(body, at_spacing(0.1));
    for (const double x : {0.5, 0.7, 0.9}) EXPECT_GT(grid.sample({x, 0.5, 0.5}), 0.0) << x;
    EXPECT_LT(grid.sample({0.15, 0.5, 0.5}), 0.0);
}

TEST(MeshLevelSet, of_a_grain_holds_the_solid_in_the_apparent_shape)
{
    const Eigen::Vector3d centre(3, 4, 5);
    const TriangleMesh shell = closed_body(together(ball_mesh(centre, 1.0), ball_mesh(centre, 0.5)), "shell");
    const Mask filled = voxelise(sphere(centre - Eigen::Vector3d(1.9, 2.9, 3.9), 1.0), Eigen::Vector3i::Constant(111), Eigen::Vector3d::Constant(0.02));
    GrainMask apparent = filled.view;
    apparent.first_centre = {1.9, 2.9, 3.9};
    const GrainLevelSet grain = grain_from_mesh(shell, apparent, at_spacing(0.04));
    EXPECT_LT((grain.centre - centre).norm(), 1e-3);
    EXPECT_NEAR(grain.volume / (sphere_volume(1) - sphere_volume(0.5)), 1.0, 5e-3);
    EXPECT_NEAR(grain.apparent_volume / sphere_volume(1), 1.0, 5e-3);
    EXPECT_NEAR(grain.intraparticle_porosity, 0.125, 3e-3);
    EXPECT_GT(grain.solid.sample(Eigen::Vector3d::Zero()), 0.0);
    EXPECT_LT(grain.apparent.sample(Eigen::Vector3d::Zero()), 0.0);
}

}  // namespace
}  // namespace coral::sdf::test
