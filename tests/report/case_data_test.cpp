#include "report/case_data.h"

#include <gtest/gtest.h>

#include <algorithm>
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

TEST(CaseData, a_sample_of_another_run_is_left_out_with_a_note)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls");
    write_example_case(scratch.path() / "other", {.fines = 60});
    std::filesystem::copy_file(scratch.path() / "other/sample.h5", scratch.path() / "ls/sample.h5", std::filesystem::copy_options::overwrite_existing);
    const CaseData data = read_case(scratch.path() / "ls");
    EXPECT_TRUE(data.criteria.empty());
    EXPECT_TRUE(data.sample.empty());
    ASSERT_EQ(data.notes.size(), 1u);
    EXPECT_NE(data.notes[0].find("is another one than the run's (60 fines, not 120)"), std::string::npos) << data.notes[0];
}

TEST(Summary, counts_fines_and_takes_medians_early_and_late)
{
    const ScratchFolder scratch;
    const ExampleCase example;
    write_example_case(scratch.path() / "ls", example);
    CaseData data = read_case(scratch.path() / "ls");
    data.series["hydraulic_conductivity"].values[1] = -0.3;  // the flow starts up
    data.series["hydraulic_conductivity"].values[4] = 5;     // a spike in the early window
    const Summary s = summarise(data);
    EXPECT_EQ(s.fines_at_start, 120);
    EXPECT_EQ(s.eroded_count, std::round(120 * test::example_erosion(example, 2.0)));
    // Outputs every 0.05 s: the early window holds 0.1 ... 0.3 s with 0.2 s spiked, so the median is the value at 0.25 s.
    EXPECT_DOUBLE_EQ(s.conductivity_early, 0.017 + 0.027 * (1 - std::exp(-0.25 / 0.6)));
    EXPECT_DOUBLE_EQ(s.conductivity_late, 0.017 + 0.027 * (1 - std::exp(-1.9 / 0.6)));
    EXPECT_DOUBLE_EQ(s.conductivity_least, 0.017 + 0.027 * (1 - std::exp(-0.1 / 0.6)));
    EXPECT_LE(s.mass_error, 1e-13);
    EXPECT_TRUE(s.warnings.empty()) << s.warnings[0];
    EXPECT_EQ(verdict(s), "29.5 % of the fines' mass eroded in 2 s (35 of 120 fines); 10 trapped inside grains; "
                          "hydraulic conductivity from 2.62 to 4.29 cm/s (× 1.64).");
}

TEST(Summary, of_a_run_without_fines_claims_no_erosion)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "dry", {.fines = 0, .optional_series = true});
    CaseData data = read_case(scratch.path() / "dry");
    std::ranges::fill(data.series["eroded_mass_fraction"].values, 0.0);
    std::ranges::fill(data.series["fines_count"].values, 0.0);
    std::ranges::fill(data.series["eroded_count"].values, 0.0);
    EXPECT_TRUE(verdict(summarise(data)).starts_with("Ran to 2 s without fines")) << verdict(summarise(data));
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

TEST(Summary, warns_of_energy_that_comes_from_nowhere_and_of_swallowed_fines)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls");
    CaseData data = read_case(scratch.path() / "ls");
    const std::size_t steps = data.series["kinetic_energy"].steps();
    const auto constant = [&](double value) { return Series{.unit = "J", .width = 1, .values = std::vector<double>(steps, value)}; };
    data.series["elastic_energy"] = constant(0.3);
    data.series["energy_closure"] = constant(2e-3);
    data.series["swallowed_count"] = constant(0);
    EXPECT_TRUE(summarise(data).warnings.empty());
    data.series["energy_closure"].values[3] = -6e-3;
    data.series["swallowed_count"].values.back() = 2;
    const Summary s = summarise(data);
    ASSERT_EQ(s.warnings.size(), 2u);
    EXPECT_NE(s.warnings[0].find("2 fines were pressed wholly into"), std::string::npos) << s.warnings[0];
    EXPECT_NE(s.warnings[1].find("off by up to 2 %"), std::string::npos) << s.warnings[1];
}

}  // namespace
}  // namespace coral::report
