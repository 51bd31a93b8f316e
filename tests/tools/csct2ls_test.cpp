// csct2ls as a user runs it: what it writes, what it says, and that errors leave nothing behind.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/table.h"
#include "morph/stack_io.h"
#include "sdf/vdb_io.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

namespace fs = std::filesystem;

/// Two spheres, radii 13 and 9 voxels, the larger one hollow with radius 6; bright, in an 8-bit TIFF without calibration.
morph::VoxelStack two_spheres(std::uint32_t first = 255, std::uint32_t second = 255, std::uint32_t background = 0)
{
    morph::VoxelStack stack;
    stack.size = {60, 36, 34};
    const Eigen::Vector3d a(18.2, 17.9, 17.1), b(46.1, 18.2, 16.8);
    for (int k = 0; k < 34; ++k)
        for (int j = 0; j < 36; ++j)
            for (int i = 0; i < 60; ++i) {
                const Eigen::Vector3d p(i + 0.5, j + 0.5, k + 0.5);
                const double ra = (p - a).norm(), rb = (p - b).norm();
                stack.values.push_back(ra <= 13 && ra > 6 ? first : rb <= 9 ? second : background);
            }
    return stack;
}

std::size_t files_in(const fs::path& folder) { return std::size_t(std::distance(fs::directory_iterator(folder), fs::directory_iterator{})); }

TEST(Csct2ls, turns_a_stack_into_level_sets_table_and_meshes)
{
    const ScratchFolder folder;
    morph::write_tiff(two_spheres(), folder.path() / "stack.tif", 8);
    const ProgramResult result = run_program("csct2ls stack.tif -o grains.vdb --voxel-size 30um --spacing 30um --table grains.csv --mesh meshes --json", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json["grains"], 2);
    EXPECT_EQ(json["dropped"], 0);
    EXPECT_EQ(json["touching"], 0);
    EXPECT_GT(json["peak_memory"], 1e6);
    for (const char* stage : {"read", "segment", "split", "measure", "level_sets", "write"}) EXPECT_TRUE(json["seconds"].contains(stage)) << stage;
    EXPECT_TRUE(fs::exists(folder.path() / "meshes" / "grain_2.ply"));

    const Table table = read_table(folder.path() / "grains.csv");
    const std::string header = "id,label,voxels,volume,apparent_volume,equivalent_diameter,surface_area,intraparticle_porosity,open_porosity,closed_porosity,"
                               "void_count,largest_throat,volume_error,elongation,flatness,sphericity,convexity,roundness,touches_border";
    EXPECT_TRUE(table.to_csv().starts_with(header + ","));
    ASSERT_EQ(table.rows.size(), 2U);
    const double c = 3e-5;
    const auto cell = [&](std::size_t row, const std::string& name) {
        const auto at = std::find(table.columns.begin(), table.columns.end(), name);
        return std::get<double>(table.rows[row][std::size_t(at - table.columns.begin())]);
    };
    EXPECT_NEAR(cell(0, "equivalent_diameter"), 26 * c, 0.1 * c);
    EXPECT_NEAR(cell(0, "closed_porosity"), std::pow(6.0 / 13.0, 3), 0.003);
    EXPECT_EQ(cell(0, "void_count"), 1);
    EXPECT_NEAR(cell(1, "volume") / (4.0 / 3.0 * std::numbers::pi * std::pow(9 * c, 3)), 1.0, 0.01);
    EXPECT_LT(std::abs(cell(0, "volume_error")), 0.002);

    const sdf::GrainFile file = sdf::read_grains(folder.path() / "grains.vdb");
    ASSERT_EQ(file.grains.size(), 2U);
    EXPECT_EQ(file.history.back().tool, "csct2ls");
    EXPECT_GT(file.grains[0].solid.sample(Eigen::Vector3d::Zero()), 0.0) << "the cavity is closed";
    EXPECT_LT(file.grains[0].apparent.sample(Eigen::Vector3d::Zero()), 0.0);
    EXPECT_NEAR(file.grains[0].solid.sample({10 * c, 0, 0}), -3 * c, 0.3 * c);
}

TEST(Csct2ls, gives_the_same_bytes_for_any_number_of_threads)
{
    const ScratchFolder folder;
    morph::write_tiff(two_spheres(), folder.path() / "stack.tif", 8);
    for (const char* threads : {"1", "3"})
        ASSERT_EQ(run_program(std::string("csct2ls stack.tif -o g") + threads + ".vdb --voxel-size 30um --table t" + threads + ".csv --threads " + threads, folder.path()).exit_code, 0);
    const auto bytes = [&](const char* name) {
        std::ifstream in(folder.path() / name, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    };
    EXPECT_EQ(bytes("t1.csv"), bytes("t3.csv"));
    EXPECT_EQ(bytes("g1.vdb"), bytes("g3.vdb"));
}

TEST(Csct2ls, scales_grains_to_one_diameter)
{
    const ScratchFolder folder;
    morph::write_tiff(two_spheres(3, 70000), folder.path() / "labels.tif", 32);
    const ProgramResult result = run_program("csct2ls labels.tif -o grains.vdb --voxel-size 30um --scale-to 15mm --table grains.csv --json", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    for (const sdf::GrainLevelSet& grain : sdf::read_grains(folder.path() / "grains.vdb").grains) EXPECT_NEAR(grain.equivalent_diameter, 0.015, 2e-4);
}

TEST(Csct2ls, takes_dark_solid_and_splits_touching_grains)
{
    const ScratchFolder folder;
    morph::VoxelStack stack = two_spheres(0, 0, 255);
    for (int i = 30; i < 40; ++i)  // a neck between the two
        for (int j = 16; j < 20; ++j)
            for (int k = 15; k < 19; ++k) stack.values.set(stack.index(i, j, k), 0);
    morph::write_tiff(stack, folder.path() / "stack.tif", 8);
    const std::string command = "csct2ls stack.tif -o grains.vdb --voxel-size 30um --solid dark --json";
    const auto whole = nlohmann::json::parse(run_program(command, folder.path()).out);
    EXPECT_EQ(whole["grains"], 1);
    const auto split = nlohmann::json::parse(run_program(command + " --split watershed --throat 400um", folder.path()).out);
    EXPECT_EQ(split["grains"], 2);
    EXPECT_EQ(split["touching"], 2);
}

/// Runs, expects the code, one line naming `text`, and no file beside `before` of them.
void expect_failure(const ScratchFolder& folder, const std::string& arguments, int code, const std::string& text)
{
    const std::size_t before = files_in(folder.path());
    const ProgramResult result = run_program("csct2ls --quiet " + arguments + " -o grains.vdb --table grains.csv --mesh meshes", folder.path());
    EXPECT_EQ(result.exit_code, code) << arguments << "\n" << result.err;
    EXPECT_NE(result.err.find(text), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(files_in(folder.path()), before) << arguments;
}

TEST(Csct2ls, wrong_command_lines_end_with_2)
{
    const ScratchFolder folder;
    morph::write_tiff(two_spheres(), folder.path() / "stack.tif", 8);
    expect_failure(folder, "stack.tif", 2, "--voxel-size");
    expect_failure(folder, "absent.tif --voxel-size 30um", 2, "no such file");
    expect_failure(folder, "stack.tif --voxel-size 30", 2, "30um");
    expect_failure(folder, "stack.tif --voxel-size 30um --band 9", 2, "--band");
    expect_failure(folder, "stack.tif --voxel-size 30um --solid 7", 2, "0, 255");
}

TEST(Csct2ls, damaged_inputs_end_with_1)
{
    const ScratchFolder folder;
    const fs::path cut = folder.path() / "cut.tif";
    morph::write_tiff(two_spheres(), cut, 8);
    fs::resize_file(cut, fs::file_size(cut) / 2);
    expect_failure(folder, "cut.tif --voxel-size 30um", 1, "cut.tif: page");
    morph::VoxelStack zero = two_spheres();
    zero.values = morph::VoxelValues(zero.count(), 0);
    morph::write_tiff(zero, folder.path() / "zero.tif", 8);
    expect_failure(folder, "zero.tif --voxel-size 30um", 1, "every voxel is 0");
    fs::create_directory(folder.path() / "slices");
    for (int k : {1, 2, 4}) {
        morph::VoxelStack slice;
        slice.size = {8, 8, 1};
        slice.values = morph::VoxelValues(64, 1);
        morph::write_tiff(slice, folder.path() / "slices" / ("s" + std::to_string(k) + ".tif"), 8);
    }
    expect_failure(folder, "slices --voxel-size 30um", 1, "slice 3 is missing");
}

TEST(Csct2ls, reads_a_real_particle)
{
    const fs::path rock = fs::path(CORAL_SOURCE_DIR) / "../shared/data/tsquare-rock/rock_73x105x115.tif";
    if (!fs::exists(rock)) GTEST_SKIP() << "needs the shared data set tsquare-rock";
    const ScratchFolder folder;
    const ProgramResult result = run_program("csct2ls '" + rock.string() + "' -o rock.vdb --voxel-size 5um --spacing 20um --border keep --json", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json["grains"], 1);
    EXPECT_EQ(json["border"], 1);
    EXPECT_NEAR(json["equivalent_diameter_median"].get<double>(), 94.4 * 5e-6, 0.01 * 94.4 * 5e-6);
}

}  // namespace
}  // namespace coral::test
