// ls2sh --import as a user runs it: published coefficients and tables become shapes that pack-sample can use.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/table.h"
#include "sh/shape_file.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

namespace fs = std::filesystem;
const fs::path shared = fs::path(CORAL_SOURCE_DIR) / "../shared/data";
const char* ball = "0 0 10 0\n1 1 0 0\n1 0 0 0\n1 -1 0 0\n2 2 0.3 0.1\n2 1 0 0\n2 0 0.4 0\n2 -1 0 0\n2 -2 0.3 -0.1\n";

TEST(Ls2shImport, writes_shapes_that_pack_sample_packs)
{
    const ScratchFolder folder;
    write_text(folder.path() / "stone.dat", ball);
    const ProgramResult result = run_program("ls2sh --import stone.dat -o stones.sh.h5 --scale-to 3mm --table t.csv --quiet", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const sh::ShapeFile file = sh::read_shapes(folder.path() / "stones.sh.h5");
    ASSERT_EQ(file.shapes.size(), 1u);
    EXPECT_EQ(file.shapes[0].name, "stone.dat");
    EXPECT_EQ(file.shapes[0].surface.method, "tsquare");
    EXPECT_NEAR(file.shapes[0].equivalent_diameter, 3e-3, 1e-12);
    EXPECT_TRUE(std::isnan(file.shapes[0].errors.rms_error)) << "there is nothing it could be compared with";
    ASSERT_EQ(file.history.size(), 1u);
    EXPECT_EQ(file.history[0].inputs, std::vector<std::string>{"stone.dat"});
    EXPECT_EQ(read_table(folder.path() / "t.csv").rows.size(), 1u);

    write_text(folder.path() / "spec.toml",
               "[box]\nsize = [\"8mm\", \"8mm\", \"12mm\"]\n[[population]]\nrole = \"coarse\"\nshape = \"sh\"\nfile = \"stones.sh.h5\"\ndiameter = \"3mm\"\ncount = 4\n"
               "[material.default]\nnormal_stiffness = 2e4\ntangential_stiffness = 1e4\nfriction = 0.3\n[dropping]\ntime_limit = \"10ms\"\n[compression]\npressure = \"5kPa\"\n");
    const ProgramResult packed = run_program("pack-sample spec.toml -o sample.h5 --quiet --seed 1", folder.path());
    EXPECT_EQ(packed.exit_code, 0) << packed.err;
    EXPECT_TRUE(fs::exists(folder.path() / "sample.h5"));
}

TEST(Ls2shImport, asks_for_the_unit_and_names_file_and_line_of_bad_input)
{
    const ScratchFolder folder;
    const auto expect = [&](const std::string& arguments, int code, const std::string& part) {
        const ProgramResult result = run_program("ls2sh -o out.sh.h5 " + arguments, folder.path());
        EXPECT_EQ(result.exit_code, code) << arguments << ": " << result.err;
        EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
        EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
        EXPECT_FALSE(fs::exists(folder.path() / "out.sh.h5"));
    };
    write_text(folder.path() / "stone.dat", ball);
    write_text(folder.path() / "cut.dat", std::string(ball).substr(0, 40));
    write_text(folder.path() / "other.dat", "hello\n");
    write_text(folder.path() / "voxels.txt", "Xsize: 10\nYsize: 10\n");
    expect("--import stone.dat", 2, "stone.dat: does not say the unit of its lengths; give it, as in --unit 1mm");
    expect("--import cut.dat --unit 1mm", 1, "cut.dat");
    expect("--import other.dat --unit 1mm", 1, "other.dat:1: expected coefficients 'n m Re(a_nm) Im(a_nm)'");
    expect("--import voxels.txt --unit 1mm", 1, "voxels.txt: holds voxels, not coefficients; csct2ls");
    expect("--import absent.dat --unit 1mm", 1, "absent.dat");
    expect("--import stone.dat --unit 1mm --tolerance 2%", 2, "nothing to fit");
    expect("", 2, "--import");
    expect("--import stone.dat --unit 1kg", 2, "--unit");
}

TEST(Ls2shImport, reads_all_95_stones_of_the_florida_set_with_their_table)
{
    if (!fs::exists(shared / "sh-fdot57")) GTEST_SKIP() << "needs the shared data set sh-fdot57";
    const ScratchFolder folder;
    const ProgramResult result = run_program("ls2sh --import '" + (shared / "sh-fdot57").string() + "' -o stones.sh.h5 --json", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json["shapes_imported"], 95);
    EXPECT_EQ(json["compared"], 95);
    EXPECT_LE(json["volume_error"].get<double>(), 5e-3);
    EXPECT_LE(json["area_error"].get<double>(), 5e-3);
    EXPECT_NE(result.err.find("L-anm-00002.dat: the published figures are those of degree 12, not of the 14"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("cement-anm.dat: left out"), std::string::npos) << result.err;
}

TEST(Ls2shImport, takes_the_grains_of_a_sand_atlas_table_as_ellipsoids)
{
    const fs::path table = shared / "sand-atlas-shapes/caicos-0000001.csv";
    if (!fs::exists(table)) GTEST_SKIP() << "needs the shared data set sand-atlas-shapes";
    const ScratchFolder folder;
    const ProgramResult result = run_program("ls2sh --import '" + table.string() + "' -o ooids.sh.h5 --json", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json["shapes_imported"], 75);
    EXPECT_LE(json["volume_error"].get<double>(), 5e-3);
    EXPECT_NE(result.err.find("another area than published"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace coral::test
