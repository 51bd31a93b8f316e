#include "report/case_data.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/hdf5.h"
#include "report/example_case.h"
#include "report/summary.h"
#include "tools/run_program.h"

namespace coral::report {
namespace {

using test::ExampleCase;
using test::ScratchFolder;
using test::write_example_case;

TEST(ReadCase, holds_what_the_file_holds)
{
    const ScratchFolder scratch;
    const ExampleCase example;
    write_example_case(scratch.path() / "ls", example);
    const CaseData data = read_case(scratch.path() / "ls");
    EXPECT_EQ(data.name, "ls");
    ASSERT_EQ(data.time.size(), example.steps);
    EXPECT_DOUBLE_EQ(data.time.back(), 2.0);
    EXPECT_DOUBLE_EQ(data.find("eroded_mass_fraction")->values.back(), test::example_erosion(example, 2.0));
    EXPECT_EQ(data.find("hydraulic_conductivity")->unit, "m/s");
    EXPECT_EQ(data.find("fines_count")->width, 3u);
    EXPECT_EQ(data.find("no_such_series"), nullptr);
    EXPECT_EQ(data.tracks.id.size(), example.grains + example.fines);
    EXPECT_EQ(data.migration.path_length.size(), example.fines);
    ASSERT_EQ(data.bodies.size(), example.grains + example.fines);
    EXPECT_DOUBLE_EQ(data.bodies[0].diameter, 15e-3);
    EXPECT_DOUBLE_EQ(data.bodies[example.grains].diameter, 1.5e-3);
    ASSERT_EQ(data.criteria.size(), 3u);
    EXPECT_EQ(data.criteria[2].name, "mao");
    EXPECT_EQ(data.history.size(), 2u);
    EXPECT_DOUBLE_EQ(data.duration, 2.0);
    ASSERT_EQ(data.plates.size(), 1u);
    EXPECT_DOUBLE_EQ(data.plates[0].hole, 6e-3);
    EXPECT_TRUE(data.notes.empty()) << data.notes[0];
}

TEST(ReadCase, does_without_every_optional_part)
{
    const ScratchFolder scratch;
    ExampleCase bare;
    bare.sample = bare.trajectories = bare.optional_series = false;
    write_example_case(scratch.path() / "bare", bare);
    std::filesystem::remove(scratch.path() / "bare/case.toml");
    const CaseData data = read_case(scratch.path() / "bare");
    EXPECT_EQ(data.series.size(), 1u);
    EXPECT_TRUE(data.tracks.id.empty());
    EXPECT_TRUE(data.criteria.empty());
    ASSERT_EQ(data.notes.size(), 1u);  // the set-up kept in the results names a sample
    EXPECT_NE(data.notes[0].find("sample.h5"), std::string::npos);
}

TEST(ReadCase, says_to_run_suffuse_first_when_there_are_no_results)
{
    const ScratchFolder scratch;
    std::filesystem::create_directories(scratch.path() / "fresh");
    try {
        read_case(scratch.path() / "fresh");
        FAIL() << "no error";
    } catch (const UsageError& error) {
        FAIL() << "must end with 1, not 2: " << error.what();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("run suffuse first"), std::string::npos) << error.what();
    }
}

TEST(ReadCase, refuses_a_missing_folder_and_series_that_disagree)
{
    const ScratchFolder scratch;
    EXPECT_THROW(read_case(scratch.path() / "nowhere"), UsageError);
    std::filesystem::create_directories(scratch.path() / "torn");
    H5File h5 = H5File::create(scratch.path() / "torn/results.h5");
    h5.write("/series/time", std::vector<double>{0, 1, 2}, {3});
    h5.write("/series/coordination", std::vector<double>{4, 5}, {2});
    h5.commit();
    try {
        read_case(scratch.path() / "torn");
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("/series/coordination"), std::string::npos) << error.what();
    }
}

TEST(ReadCases, tells_folders_of_one_name_apart)
{
    const ScratchFolder scratch;
    ExampleCase bare;
    bare.sample = bare.trajectories = bare.optional_series = false;
    for (const char* study : {"slow", "fast"}) write_example_case(scratch.path() / study / "case", bare);
    const auto cases = read_cases({scratch.path() / "slow/case", scratch.path() / "fast/case", scratch.path() / "fast/case/"});
    EXPECT_EQ(cases[0].name, "slow/case");
    EXPECT_EQ(cases[1].name, "fast/case");
    EXPECT_EQ(cases[2].name, "fast/case (2)");
}

TEST(Summary, counts_fines_and_takes_the_first_finite_conductivity)
{
    const ScratchFolder scratch;
    const ExampleCase example;
    write_example_case(scratch.path() / "ls", example);
    const Summary s = summarise(read_case(scratch.path() / "ls"));
    EXPECT_EQ(s.fines_at_start, 120);
    EXPECT_EQ(s.eroded_count, std::round(120 * test::example_erosion(example, 2.0)));
    EXPECT_DOUBLE_EQ(s.conductivity_first_time, 0.05);  // at t = 0 the example has no conductivity
    EXPECT_DOUBLE_EQ(s.conductivity_first, 0.017 + 0.027 * (1 - std::exp(-0.05 / 0.6)));
    EXPECT_DOUBLE_EQ(s.conductivity_last, 0.017 + 0.027 * (1 - std::exp(-2.0 / 0.6)));
    EXPECT_LE(s.mass_error, 1e-13);
    EXPECT_TRUE(s.warnings.empty()) << s.warnings[0];
    EXPECT_EQ(verdict(s), "29.5 % of the fines' mass eroded in 2 s (35 of 120 fines); 10 trapped inside grains; "
                          "hydraulic conductivity from 1.92 to 4.3 cm/s (× 2.25).");
}

TEST(Summary, warns_of_a_run_that_stopped_early_or_lost_mass)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls");
    CaseData data = read_case(scratch.path() / "ls");
    data.duration = 4;
    data.series["mass_balance_error"].values[5] = -0.02;
    const Summary s = summarise(data);
    ASSERT_EQ(s.warnings.size(), 2u);
    EXPECT_NE(s.warnings[0].find("stopped at 2 s of 4 s"), std::string::npos);
    EXPECT_NE(s.warnings[1].find("0.02"), std::string::npos);
}

}  // namespace
}  // namespace coral::report
