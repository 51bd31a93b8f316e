// make-sample-ct: the same bytes for the same seed, a stack that csct2ls' reader takes, and no file after an error.
#include <gtest/gtest.h>

#include "core/output_file.h"
#include "core/table.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

const std::string small = "make-sample-ct --grains 2 --sticks 1 --diameter 6mm --voxel-size 0.3mm ";

TEST(MakeSampleCt, writes_the_same_bytes_for_the_same_seed_and_any_thread_count)
{
    const ScratchFolder folder;
    ASSERT_EQ(run_program(small + "-o a.tif --truth a.csv --threads 1", folder.path()).exit_code, 0);
    ASSERT_EQ(run_program(small + "-o b.tif --truth b.csv --threads 2", folder.path()).exit_code, 0);
    ASSERT_EQ(run_program(small + "-o c.tif --truth c.csv --seed 9", folder.path()).exit_code, 0);
    const auto bytes = [&](const char* name) { return read_text_file(folder.path() / name); };
    EXPECT_EQ(bytes("a.tif"), bytes("b.tif"));
    EXPECT_EQ(bytes("a.csv"), bytes("b.csv"));
    EXPECT_NE(bytes("a.tif"), bytes("c.tif"));
}

TEST(MakeSampleCt, writes_the_truth_with_one_row_a_grain)
{
    const ScratchFolder folder;
    const ProgramResult result = run_program(small + "-o a.tif --truth a.csv --porosity 25% --json", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("\"intraparticle_porosity\""), std::string::npos);
    const Table truth = read_table(folder.path() / "a.csv");
    ASSERT_EQ(truth.rows.size(), 2u);
    EXPECT_EQ(truth.columns.front(), "label");
    EXPECT_NEAR(std::get<double>(truth.rows[0][7]), 0.25, 0.01);
}

TEST(MakeSampleCt, draws_chambers_alone_in_the_range_asked_for)
{
    const ScratchFolder folder;
    const std::string options = "--no-sponge --channels 0 --chambers 2 --chamber-radius 0.09 0.1";
    const ProgramResult result = run_program(small + "-o a.tif --truth a.csv " + options, folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Table truth = read_table(folder.path() / "a.csv");
    EXPECT_EQ(std::get<double>(truth.rows[0][10]), 2);                                     // void_count
    EXPECT_NEAR(std::get<double>(truth.rows[0][7]), 2 * 8 * 0.095 * 0.095 * 0.095, 2.5e-3);  // porosity: (2r/d)^3 each
}

TEST(MakeSampleCt, says_what_is_wrong_and_leaves_no_file)
{
    const ScratchFolder folder;
    const ProgramResult porosity = run_program(small + "-o a.tif --porosity 0.01", folder.path());
    EXPECT_EQ(porosity.exit_code, 2);
    EXPECT_NE(porosity.err.find("--porosity: chambers and channels alone take"), std::string::npos) << porosity.err;
    const ProgramResult unit = run_program(small + "-o a.tif --wall 3s", folder.path());
    EXPECT_EQ(unit.exit_code, 2);
    const ProgramResult target = run_program(small + "-o missing/a.tif", folder.path());
    EXPECT_EQ(target.exit_code, 2);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace coral::test
