#include "report/pool.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/error.h"
#include "report/example_case.h"
#include "report/figure.h"
#include "tools/run_program.h"

namespace coral::report {
namespace {

using test::ExampleCase;
using test::ScratchFolder;
using test::write_example_case;

/// Three repeats whose erosion tends to 0.2, 0.3 and 0.7, and another case.
std::vector<CaseData> repeats(const ScratchFolder& scratch)
{
    std::vector<std::filesystem::path> given;
    int seed = 0;
    for (const double erosion : {0.2, 0.3, 0.7}) {
        ExampleCase example;
        example.erosion = erosion;
        const auto folder = scratch.path() / ("seed" + std::to_string(++seed));
        write_example_case(folder, example);
        given.push_back("with voids=" + folder.string());
    }
    write_example_case(scratch.path() / "other");
    given.push_back(scratch.path() / "other");
    return read_cases(given);
}

TEST(Labels, name_cases_and_their_repeats)
{
    const ScratchFolder scratch;
    const auto cases = repeats(scratch);
    EXPECT_EQ(cases[0].name, "with voids (seed1)");
    EXPECT_EQ(cases[2].name, "with voids (seed3)");
    EXPECT_EQ(cases[3].name, "other");
    EXPECT_EQ(cases[3].label, "");
    // Alone with its label, a case is called by it; a folder whose name holds the sign is a folder.
    write_example_case(scratch.path() / "a=b");
    const auto named = read_cases({"only=" + (scratch.path() / "other").string(), scratch.path() / "a=b"});
    EXPECT_EQ(named[0].name, "only");
    EXPECT_EQ(named[1].name, "a=b");
}

TEST(PoolRepeats, takes_mean_and_range_at_every_time)
{
    const ScratchFolder scratch;
    const auto pooled = pool_repeats(repeats(scratch));
    ASSERT_EQ(pooled.size(), 2u);
    EXPECT_EQ(pooled[0].name, "with voids");
    EXPECT_EQ(pooled[0].repeats, 3u);
    EXPECT_EQ(pooled[1].repeats, 1u);
    const auto at = [](double erosion, double t) { return test::example_erosion({.erosion = erosion}, t); };
    EXPECT_NEAR(pooled[0].find("eroded_mass_fraction")->values.back(), at(0.4, 2.0), 1e-12);
    EXPECT_NEAR(pooled[0].low.at("eroded_mass_fraction").values.back(), at(0.2, 2.0), 1e-12);
    EXPECT_NEAR(pooled[0].high.at("eroded_mass_fraction").values.back(), at(0.7, 2.0), 1e-12);
    EXPECT_EQ(pooled[0].migration.path_length.size(), 360u);
    // A run that stopped early shortens the whole; other output times are refused.
    auto cut = repeats(scratch);
    cut[1].time.resize(11);
    for (auto& [name, series] : cut[1].series) series.values.resize(11 * series.width);
    EXPECT_EQ(pool_repeats(cut)[0].time.size(), 11u);
    cut[1].time[5] += 0.01;
    EXPECT_THROW(pool_repeats(cut), Error);
}

TEST(PoolRepeats, figures_draw_the_mean_with_its_band_and_count_the_fines_of_one_run)
{
    const ScratchFolder scratch;
    const auto figures = make_figures(repeats(scratch));
    const auto eroded = std::ranges::find(figures, "eroded_mass", &Figure::name);
    ASSERT_NE(eroded, figures.end());
    EXPECT_EQ(eroded->cases, (std::vector<std::string>{"with voids", "other"}));
    EXPECT_EQ(eroded->table.columns, (std::vector<std::string>{"case", "time", "eroded_mass_fraction", "eroded_mass_fraction_low", "eroded_mass_fraction_high"}));
    EXPECT_NE(gnuplot_script(*eroded).find("filledcurves"), std::string::npos);
    const auto migration = std::ranges::find(figures, "migration_distance", &Figure::name);
    EXPECT_NEAR(std::get<double>(migration->table.rows[0][2]), 359.0 / 3, 1e-12);
}

}  // namespace
}  // namespace coral::report
