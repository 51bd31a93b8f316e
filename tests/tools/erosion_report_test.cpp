// erosion-report as a user runs it. Its pictures and page are tested in tests/report.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/output_file.h"
#include "report/example_case.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

TEST(ErosionReport, compares_cases_and_prints_their_verdicts)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls", {.optional_series = false});
    write_example_case(scratch.path() / "sh", {.erosion = 0.45, .optional_series = false});
    const ProgramResult result = run_program("erosion-report ls sh -o report --threads 1", scratch.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("ls: 29.5 % of the fines' mass eroded"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("sh: 44.2 % of the fines' mass eroded"), std::string::npos) << result.out;
    EXPECT_TRUE(read_text_file(scratch.path() / "report/erosion.csv").starts_with("case,time,eroded_mass_fraction\nls,0,0\n"));
    EXPECT_TRUE(std::filesystem::exists(scratch.path() / "report/figures/eroded_mass.svg"));
    EXPECT_TRUE(std::filesystem::exists(scratch.path() / "report/report.html"));

    const ProgramResult again = run_program("erosion-report ls sh -o report --json --threads 2", scratch.path());
    ASSERT_EQ(again.exit_code, 0) << again.err;
    const auto json = nlohmann::json::parse(again.out);
    ASSERT_EQ(json["cases"].size(), 2u);
    EXPECT_DOUBLE_EQ(json["cases"][1]["eroded_mass_fraction"].get<double>(), example_erosion({.erosion = 0.45}, 2.0));
    EXPECT_TRUE(json["cases"][1]["trapped_count"].is_null());
}

TEST(ErosionReport, ends_with_1_and_a_hint_before_suffuse_has_run)
{
    const ScratchFolder scratch;
    std::filesystem::create_directories(scratch.path() / "fresh");
    const ProgramResult result = run_program("erosion-report fresh -o report", scratch.path());
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find("run suffuse first"), std::string::npos) << result.err;
    EXPECT_FALSE(std::filesystem::exists(scratch.path() / "report"));
}

TEST(ErosionReport, ends_with_2_for_a_missing_folder)
{
    const ScratchFolder scratch;
    const ProgramResult result = run_program("erosion-report nowhere -o report", scratch.path());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("nowhere"), std::string::npos) << result.err;
}

TEST(ErosionReport, ends_with_1_for_damaged_results)
{
    const ScratchFolder scratch;
    std::filesystem::create_directories(scratch.path() / "case");
    write_text(scratch.path() / "case/results.h5", "this is no HDF5 file");
    const ProgramResult result = run_program("erosion-report case -o report", scratch.path());
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find("results.h5"), std::string::npos) << result.err;
}

TEST(ErosionReport, names_the_package_when_gnuplot_is_missing)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls", {.sample = false, .trajectories = false, .optional_series = false});
    const std::string program = std::string(CORAL_BIN_DIR) + "/erosion-report";
    const std::string command = "cd '" + scratch.path().string() + "' && PATH=/nonexistent " + program + " ls -o report 2> said; test $? -eq 1";
    EXPECT_EQ(std::system(command.c_str()), 0);
    EXPECT_NE(read_text_file(scratch.path() / "said").find("apt-get install gnuplot-nox"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(scratch.path() / "report"));
}

}  // namespace
}  // namespace coral::test
