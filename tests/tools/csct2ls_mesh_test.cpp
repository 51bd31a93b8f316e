// csct2ls --from-mesh: closed surfaces to level sets, and what it says of surfaces that are not.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/table.h"
#include "sdf/mesh_reader.h"
#include "sdf/vdb_io.h"
#include "sdf/meshes.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

namespace fs = std::filesystem;
using sdf::test::ball_mesh;

double cell(const Table& table, std::size_t row, const std::string& name)
{
    const auto at = std::ranges::find(table.columns, name);
    return std::get<double>(table.rows.at(row).at(std::size_t(at - table.columns.begin())));
}

TEST(Csct2lsFromMesh, makes_level_sets_of_the_surfaces_one_grain_a_file)
{
    const ScratchFolder folder;
    sdf::write_stl(ball_mesh({1, 2, 3}, 5.0), folder.path() / "small.stl");
    sdf::write_ply(sdf::test::together(ball_mesh({0, 0, 0}, 8.0), ball_mesh({1, 0, 0}, 4.0)), folder.path() / "hollow.ply");
    const ProgramResult result =
        run_program("csct2ls --from-mesh --mesh-unit mm small.stl hollow.ply -o g.vdb --table g.csv --voids v.csv --json", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json["grains"], 2);
    EXPECT_NEAR(json["spacing"].get<double>(), 0.016 / 75, 0.1 * 0.016 / 75);
    const Table table = read_table(folder.path() / "g.csv");
    ASSERT_EQ(table.rows.size(), 2U);
    EXPECT_EQ(cell(table, 0, "label"), 2) << "the larger one comes first, its label is its place on the command line";
    const double ball = 4.0 / 3.0 * std::numbers::pi;
    EXPECT_NEAR(cell(table, 0, "volume") / (ball * (512 - 64) * 1e-9), 1.0, 3e-3);
    EXPECT_NEAR(cell(table, 0, "closed_porosity"), 64.0 / 512.0, 2e-3);
    EXPECT_NEAR(cell(table, 1, "sphericity"), 1.0, 0.015);  // areas of voxels are within 1 %
    for (const std::size_t row : {0, 1}) EXPECT_LT(std::abs(cell(table, row, "volume_error")), 1e-3);
    const Table voids = read_table(folder.path() / "v.csv");
    ASSERT_EQ(voids.rows.size(), 1U);
    EXPECT_EQ(cell(voids, 0, "open"), 0);
    EXPECT_NEAR(cell(voids, 0, "width"), 8e-3, 2e-4);

    const sdf::GrainFile file = sdf::read_grains(folder.path() / "g.vdb");
    const Eigen::Vector3d cavity = Eigen::Vector3d(1e-3, 0, 0) - file.grains[0].centre;
    EXPECT_GT(file.grains[0].solid.sample(cavity), 0.0) << "the cavity stays";
    EXPECT_LT(file.grains[0].apparent.sample(cavity), 0.0);
    EXPECT_LT((file.grains[1].centre - Eigen::Vector3d(1e-3, 2e-3, 3e-3)).norm(), 1e-5);
    EXPECT_EQ(file.history.back().options.at("mesh-unit"), "mm");
}

TEST(Csct2lsFromMesh, gives_the_same_bytes_for_any_number_of_threads)
{
    const ScratchFolder folder;
    sdf::write_stl(sdf::test::together(ball_mesh({0, 0, 0}, 8.0), ball_mesh({2, 0, 0}, 4.0, 4)), folder.path() / "a.stl");
    for (const char* threads : {"1", "2"})
        ASSERT_EQ(run_program(std::string("csct2ls --from-mesh --mesh-unit mm a.stl --quiet -o g") + threads + ".vdb --threads " + threads, folder.path()).exit_code, 0);
    const auto bytes = [&](const char* name) {
        std::ifstream in(folder.path() / name, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    };
    EXPECT_TRUE(bytes("g1.vdb") == bytes("g2.vdb"));
}

TEST(Csct2lsFromMesh, scales_and_takes_a_tolerance)
{
    const ScratchFolder folder;
    sdf::write_stl(sdf::test::together(ball_mesh({0, 0, 0}, 8.0), ball_mesh({1, 0, 0}, 4.0)), folder.path() / "hollow.stl");
    const ProgramResult result = run_program("csct2ls --from-mesh --mesh-unit um hollow.stl -o g.vdb --scale-to 15mm --tolerance 5% --json", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const sdf::GrainLevelSet grain = sdf::read_grains(folder.path() / "g.vdb").grains[0];
    EXPECT_NEAR(grain.equivalent_diameter, 0.015, 1e-4);
    EXPECT_GT(nlohmann::json::parse(result.out)["spacing"].get<double>(), 2e-4) << "a smooth ball needs no fine grid";
}

TEST(Csct2lsFromMesh, repairs_orientation_and_leaves_other_bodies_out_with_a_word)
{
    const ScratchFolder folder;
    sdf::write_stl(sdf::test::turned(sdf::test::together(ball_mesh({0, 0, 0}, 8.0), ball_mesh({20, 0, 0}, 4.0))), folder.path() / "two.stl");
    const ProgramResult result = run_program("csct2ls --from-mesh --mesh-unit mm two.stl -o g.vdb --quiet", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("two.stl: holds 2 separate bodies; the largest is kept, 11 % of the volume is left out"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("triangles were inside out and are turned"), std::string::npos) << result.err;
    EXPECT_NEAR(sdf::read_grains(folder.path() / "g.vdb").grains[0].volume / (4.0 / 3.0 * std::numbers::pi * 512e-9), 1.0, 5e-3);
}

void expect_failure(const ScratchFolder& folder, const std::string& arguments, int code, const std::string& text)
{
    const ProgramResult result = run_program("csct2ls --quiet --from-mesh -o g.vdb " + arguments, folder.path());
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_NE(result.err.find(text), std::string::npos) << arguments << "\n  wanted: " << text << "\n  said: " << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_FALSE(fs::exists(folder.path() / "g.vdb"));
}

TEST(Csct2lsFromMesh, says_what_is_wrong_with_a_mesh)
{
    const ScratchFolder folder;
    sdf::TriangleMesh ball = ball_mesh({0, 0, 0}, 8.0, 3);
    sdf::write_stl(ball, folder.path() / "ball.stl");
    ball.triangles.resize(ball.triangles.size() - 2);
    sdf::write_stl(ball, folder.path() / "holed.stl");
    fs::copy_file(folder.path() / "ball.stl", folder.path() / "cut.stl");
    fs::resize_file(folder.path() / "cut.stl", 5000);
    write_text(folder.path() / "mesh.obj", "v 0 0 0\n");
    expect_failure(folder, "holed.stl --mesh-unit mm", 1, "holed.stl: the surface is not closed: ");
    expect_failure(folder, "cut.stl --mesh-unit mm", 1, "cut.stl: has 5000 bytes where its 512 triangles need 25684");
    expect_failure(folder, "ball.stl", 2, "--from-mesh: the files do not say the unit of their coordinates; pass --mesh-unit");
    expect_failure(folder, "ball.stl --mesh-unit inch", 2, "--mesh-unit");
    expect_failure(folder, "ball.stl --mesh-unit mm --voxel-size 30um", 2, "--voxel-size: is about voxels and goes not with --from-mesh");
    expect_failure(folder, "mesh.obj --mesh-unit mm", 2, "mesh.obj: is no mesh file by its name");
    expect_failure(folder, "absent.stl --mesh-unit mm", 2, "absent.stl: no such file");
    expect_failure(folder, "ball.stl --mesh-unit m --spacing 0.1mm", 1, "in diameter, more than 2000 spacings; check --mesh-unit");
}

/// Volumes [1e-3 m^3] and sphericities of the scanned stones as their README has them.
TEST(Csct2lsFromMesh, reads_scanned_stones)
{
    const fs::path stones = fs::path(CORAL_SOURCE_DIR) / "../shared/data/scanned-stones";
    if (!fs::exists(stones)) GTEST_SKIP() << "needs the shared data set scanned-stones";
    const ScratchFolder folder;
    std::string files;
    for (const char* stone : {"14", "17"}) files += " '" + (stones / ("stone_" + std::string(stone) + ".stl.gz")).string() + "'";
    const ProgramResult result = run_program("csct2ls --from-mesh --mesh-unit m" + files + " -o g.vdb --table g.csv --quiet", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("stone_17.stl.gz: 62612 triangles were inside out"), std::string::npos) << result.err;
    const Table table = read_table(folder.path() / "g.csv");
    ASSERT_EQ(table.rows.size(), 2U);
    EXPECT_NEAR(cell(table, 0, "volume"), 0.61e-3, 0.005e-3);
    EXPECT_NEAR(cell(table, 1, "volume"), 0.17e-3, 0.005e-3);
    EXPECT_NEAR(cell(table, 1, "convexity"), 0.853, 0.015);
    for (const std::size_t row : {0, 1}) EXPECT_LT(std::abs(cell(table, row, "volume_error")), 1e-3);
}

TEST(Csct2lsFromMesh, refuses_a_scanned_coral_colony_that_is_open_below)
{
    const fs::path colony = fs::path(CORAL_SOURCE_DIR) / "../shared/data/coral-colony-mesh/mcap.ply.gz";
    if (!fs::exists(colony)) GTEST_SKIP() << "needs the shared data set coral-colony-mesh";
    const ScratchFolder folder;
    expect_failure(folder, "'" + colony.string() + "' --mesh-unit m", 1, "mcap.ply.gz: the surface is not closed: 195 open edges");
}

}  // namespace
}  // namespace coral::test
