// csct2ls: voids one by one, what the level sets keep of them, spacing by tolerance, meshes out, grains at the border.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/table.h"
#include "morph/stack_io.h"
#include "sdf/mesh_reader.h"
#include "sdf/vdb_io.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

namespace fs = std::filesystem;

/// A ball of radius 14 (about a voxel centre: the deepest voxel is then its centre) with a closed cavity and one with a mouth of radius 2.5, both cavities of radius 5; the second is cut by the border
/// when asked for.
morph::VoxelStack two_flasks(bool at_border = false)
{
    morph::VoxelStack stack;
    stack.size = {68, 34, 34};
    std::vector<std::uint32_t> values;
    const Eigen::Vector3d a(17.5, 17.5, 17.5), b(at_border ? 56.0 : 50.1, 17.2, 16.8);
    for (int k = 0; k < 34; ++k)
        for (int j = 0; j < 34; ++j)
            for (int i = 0; i < 68; ++i) {
                const Eigen::Vector3d p(i + 0.5, j + 0.5, k + 0.5);
                const double ra = (p - a).norm(), rb = (p - b).norm();
                const bool mouth = p.z() > b.z() && std::hypot(p.x() - b.x(), p.y() - b.y()) <= 2.5;
                values.push_back(ra <= 14 && ra > 5 ? 1 : rb <= 13 && rb > 5 && !mouth ? 2 : 0);
            }
    stack.values = values;
    return stack;
}

double cell(const Table& table, std::size_t row, const std::string& name)
{
    const auto at = std::ranges::find(table.columns, name);
    return std::get<double>(table.rows.at(row).at(std::size_t(at - table.columns.begin())));
}

ScratchFolder& with_stack(ScratchFolder& folder, bool at_border = false)
{
    morph::write_tiff(two_flasks(at_border), folder.path() / "flasks.tif", 8);
    return folder;
}

TEST(Csct2lsVoids, lists_every_void_with_its_throat_and_depth)
{
    ScratchFolder folder;
    with_stack(folder);
    const ProgramResult result = run_program("csct2ls flasks.tif -o g.vdb --voxel-size 30um --spacing 30um --voids voids.csv --table grains.csv --quiet", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Table voids = read_table(folder.path() / "voids.csv"), grains = read_table(folder.path() / "grains.csv");
    EXPECT_TRUE(voids.to_csv().starts_with("id,void,volume,open,throat_diameter,depth,x,y,z,width,voxels\n"));
    ASSERT_EQ(voids.rows.size(), 2U);
    const double c = 3e-5;
    EXPECT_EQ(cell(voids, 0, "id"), 1);
    EXPECT_EQ(cell(voids, 0, "open"), 0);
    EXPECT_EQ(cell(voids, 0, "throat_diameter"), 0);
    EXPECT_NEAR(cell(voids, 0, "depth"), 14 * c, c);
    for (const char* axis : {"x", "y", "z"}) EXPECT_NEAR(cell(voids, 0, axis), 0, 0.1 * c) << "the cavity is concentric";
    EXPECT_EQ(cell(voids, 1, "id"), 2);
    EXPECT_EQ(cell(voids, 1, "open"), 1);
    EXPECT_NEAR(cell(voids, 1, "throat_diameter"), 5 * c, 1.1 * c);
    EXPECT_EQ(cell(voids, 1, "throat_diameter"), cell(grains, 1, "largest_throat"));
    EXPECT_GT(cell(voids, 1, "z"), 0) << "the mouth is on the upper side";
    for (const std::size_t row : {0, 1}) {
        EXPECT_NEAR(cell(grains, row, "void_volume_retained"), 1, 0.01);
        EXPECT_GT(cell(grains, row, "void_overlap"), 0.88) << "of a cavity 10 voxels wide about a voxel centre, 30 of 515 voxels lie right on its surface";
        EXPECT_EQ(cell(grains, row, "void_count"), 1);
    }
    EXPECT_TRUE(grains.columns.at(grains.columns.size() - 2) == "void_volume_retained" && grains.columns.back() == "void_overlap");
}

TEST(Csct2lsVoids, come_with_scaled_sizes)
{
    ScratchFolder folder;
    with_stack(folder);
    const ProgramResult result = run_program("csct2ls flasks.tif -o g.vdb --voxel-size 30um --scale-to 14mm --voids voids.csv --quiet", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NEAR(cell(read_table(folder.path() / "voids.csv"), 0, "depth"), 7e-3, 0.6e-3);
}

TEST(Csct2lsTolerance, takes_the_coarsest_spacing_that_keeps_the_voids)
{
    ScratchFolder folder;
    with_stack(folder);
    const std::string command = "csct2ls flasks.tif -o g.vdb --voxel-size 30um --json --table grains.csv ";
    const ProgramResult loose = run_program(command + "--tolerance 30%", folder.path()), strict = run_program(command + "--tolerance 6%", folder.path());
    ASSERT_EQ(strict.exit_code, 0) << strict.err;
    const auto coarse = nlohmann::json::parse(loose.out), fine = nlohmann::json::parse(strict.out);
    EXPECT_GT(coarse["spacing"].get<double>(), fine["spacing"].get<double>());
    EXPECT_GE(fine["void_overlap"].get<double>(), 0.94);
    EXPECT_LE(fine["open_void_cut_off"].get<double>(), 0.06);
    EXPECT_NE(strict.err.find("--tolerance 6 %: level-set spacing"), std::string::npos) << strict.err;
    EXPECT_NE(strict.err.find("is too coarse"), std::string::npos) << strict.err;
    // The record tells the spacing that was taken.
    EXPECT_EQ(std::stod(sdf::read_grains(folder.path() / "g.vdb").history.back().options.at("spacing")), fine["spacing"].get<double>());
}

TEST(Csct2lsTolerance, says_when_no_spacing_meets_it)
{
    ScratchFolder folder;
    with_stack(folder);
    const ProgramResult result = run_program("csct2ls flasks.tif -o g.vdb --voxel-size 30um --tolerance 0.01% --quiet", folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("not met even at 30 um"), std::string::npos) << result.err;
}

TEST(Csct2lsTolerance, goes_not_with_a_spacing)
{
    ScratchFolder folder;
    with_stack(folder);
    const ProgramResult result = run_program("csct2ls flasks.tif -o g.vdb --voxel-size 30um --tolerance 1% --spacing 60um", folder.path());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("--tolerance: goes not with --spacing; give one of the two"), std::string::npos) << result.err;
    EXPECT_FALSE(fs::exists(folder.path() / "g.vdb"));
}

TEST(Csct2lsMesh, writes_stl_in_millimetres_and_ply_in_metres)
{
    ScratchFolder folder;
    with_stack(folder);
    ASSERT_EQ(run_program("csct2ls flasks.tif -o g.vdb --voxel-size 30um --mesh stl --mesh-format stl --quiet", folder.path()).exit_code, 0);
    ASSERT_EQ(run_program("csct2ls flasks.tif -o g.vdb --voxel-size 30um --mesh ply --quiet", folder.path()).exit_code, 0);
    const double stl = sdf::enclosed_volume(sdf::read_mesh(folder.path() / "stl" / "grain_1.stl", 1e-3));
    const double ply = sdf::enclosed_volume(sdf::read_mesh(folder.path() / "ply" / "grain_1.ply", 1.0));
    EXPECT_NEAR(stl / ply, 1.0, 1e-5);
    EXPECT_NEAR(ply / sdf::read_grains(folder.path() / "g.vdb").grains[0].volume, 1.0, 0.01);
    EXPECT_EQ(run_program("csct2ls flasks.tif -o g.vdb --voxel-size 30um --mesh m --mesh-format obj", folder.path()).exit_code, 2);
}

TEST(Csct2lsBorder, drops_keeps_or_flags_grains_that_the_stack_cuts)
{
    ScratchFolder folder;
    with_stack(folder, true);
    const auto run = [&](const std::string& border) {
        const ProgramResult result = run_program("csct2ls flasks.tif -o g.vdb --voxel-size 30um --table g.csv --json --quiet --border " + border, folder.path());
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return nlohmann::json::parse(result.out);
    };
    const auto dropped = run("drop"), kept = run("keep");
    EXPECT_EQ(dropped["grains"], 1);
    EXPECT_EQ(dropped["dropped_border"], 1);
    EXPECT_EQ(kept["grains"], 2);
    const auto flagged = run("flag");
    EXPECT_EQ(flagged["grains"], 2);
    EXPECT_EQ(flagged["border"], 1);
    const Table table = read_table(folder.path() / "g.csv");
    ASSERT_EQ(table.rows.size(), 2U);
    EXPECT_EQ(cell(table, 0, "touches_border") + cell(table, 1, "touches_border"), 1);
    EXPECT_EQ(flagged["intraparticle_porosity"], dropped["intraparticle_porosity"]) << "statistics are of whole grains";
    EXPECT_NE(flagged["intraparticle_porosity"], kept["intraparticle_porosity"]);
}

}  // namespace
}  // namespace coral::test
