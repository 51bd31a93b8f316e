#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "report/case_data.h"
#include "report/example_case.h"
#include "report/figure.h"
#include "tools/run_program.h"

namespace coral::report {
namespace {

using test::ExampleCase;
using test::ScratchFolder;
using test::write_example_case;

std::vector<CaseData> two_cases(const ScratchFolder& scratch)
{
    ExampleCase faster;
    faster.erosion = 0.5;
    write_example_case(scratch.path() / "it's \"odd\", <b>", ExampleCase{});
    write_example_case(scratch.path() / "faster", faster);
    return read_cases({scratch.path() / "it's \"odd\", <b>", scratch.path() / "faster"});
}

const Figure& find(const std::vector<Figure>& figures, const std::string& name)
{
    const auto it = std::ranges::find(figures, name, &Figure::name);
    if (it == figures.end()) throw std::runtime_error("no figure " + name);
    return *it;
}

TEST(ErosionTable, starts_with_case_time_and_eroded_mass_and_holds_every_series)
{
    const ScratchFolder scratch;
    const auto cases = two_cases(scratch);
    const Table table = erosion_table(cases);
    ASSERT_GE(table.columns.size(), 17u);
    EXPECT_EQ(table.columns[0], "case");
    EXPECT_EQ(table.columns[1], "time");
    EXPECT_EQ(table.columns[2], "eroded_mass_fraction");
    for (const char* name : {"fines_count_bottom", "hydraulic_conductivity", "momentum_balance_error"})
        EXPECT_NE(std::ranges::find(table.columns, name), table.columns.end()) << name;
    ASSERT_EQ(table.rows.size(), 82u);
    EXPECT_EQ(std::get<double>(table.rows[81][2]), test::example_erosion({.erosion = 0.5}, 2.0));
    // What the run did not have is an empty cell, not a number.
    const auto k = static_cast<std::size_t>(std::ranges::find(table.columns, "hydraulic_conductivity") - table.columns.begin());
    EXPECT_EQ(std::get<std::string>(table.rows[0][k]), "");
}

TEST(Figures, sort_trapped_fines_by_the_width_of_their_way_out)
{
    const ScratchFolder scratch;
    auto cases = two_cases(scratch);
    const auto throats = [&] {
        const auto figures = make_figures(cases);
        const auto it = std::ranges::find(figures, "trapped_by_throat", &Figure::name);
        return it == figures.end() ? Figure() : *it;
    };
    EXPECT_TRUE(throats().table.rows.empty());
    cases[0].trapped.way_out = {0, 0.95, 1.0, 1.05, 3.0};
    const Figure figure = throats();
    ASSERT_EQ(figure.table.rows.size(), figure.categories.size());
    const auto count = [&](const std::string& bin) {
        const auto k = static_cast<std::size_t>(std::ranges::find(figure.categories, bin) - figure.categories.begin());
        return std::get<double>(figure.table.rows.at(k).back());
    };
    EXPECT_EQ(count("< 0.5"), 1);
    EXPECT_EQ(count("0.8-1"), 1);
    EXPECT_EQ(count("1-1.2"), 2);
    EXPECT_EQ(count("> 1.5"), 1);
    EXPECT_EQ(count("0.5-0.8"), 0);
}

TEST(Figures, of_a_full_case_answer_those_of_the_paper)
{
    const ScratchFolder scratch;
    const auto figures = make_figures(two_cases(scratch));
    for (const char* name : {"eroded_mass", "fines_per_layer", "fines_left", "hydraulic_gradient", "hydraulic_conductivity", "flow_velocity", "fluid_forces",
                             "contact_anisotropy", "migration_distance", "migration_top_layer", "fine_speeds", "balance_errors", "particle_size_distribution"})
        EXPECT_NO_THROW(find(figures, name)) << name;
}

TEST(Figures, leave_out_what_a_case_did_not_measure)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "bare", {.sample = false, .trajectories = false, .optional_series = false});
    const auto figures = make_figures(read_cases({scratch.path() / "bare"}));
    ASSERT_EQ(figures.size(), 1u);
    EXPECT_EQ(figures[0].name, "eroded_mass");
}

TEST(Figures, draw_no_speed_inside_grains_without_voids)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "filled");
    auto cases = read_cases({scratch.path() / "filled"});
    cases[0].series["intraparticle_volume"] = {"m3", 1, std::vector<double>(cases[0].time.size(), 0.0)};
    const auto figures = make_figures(cases);
    const Figure& speeds = find(figures, "flow_velocity");
    ASSERT_EQ(speeds.panels[0].curves.size(), 1u);
    EXPECT_EQ(speeds.panels[0].curves[0].column, "velocity_interparticle");
}

TEST(MigrationDistance, falls_from_all_but_one_fine_to_none)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls");
    const auto cases = read_cases({scratch.path() / "ls"});
    const auto figures = make_figures(cases);
    const Table& table = find(figures, "migration_distance").table;
    ASSERT_EQ(table.rows.size(), 119u);
    EXPECT_EQ(std::get<double>(table.rows.front()[2]), 119);
    EXPECT_EQ(std::get<double>(table.rows.back()[2]), 1);
    for (const auto& row : table.rows) {
        const double d = std::get<double>(row[1]);
        const auto farther = std::ranges::count_if(cases[0].migration.path_length, [&](double path) { return path > d; });
        EXPECT_LE(farther, std::get<double>(row[2]));
    }
}

TEST(DrawFigures, draws_svg_and_png_of_every_figure_with_odd_names)
{
    const ScratchFolder scratch;
    const auto figures = make_figures(two_cases(scratch));
    const auto folder = scratch.path() / "drawn";
    std::filesystem::create_directories(folder);
    draw_figures(figures, folder);
    for (const Figure& figure : figures)
        for (const char* kind : {".csv", ".gp", ".svg", ".png"}) EXPECT_GT(std::filesystem::file_size(folder / (figure.name + kind)), 50u) << figure.name << kind;
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), static_cast<std::ptrdiff_t>(4 * figures.size()));
}

TEST(DrawFigures, curves_of_a_case_with_an_odd_name_are_drawn)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "it's \"odd\", <b>");
    write_example_case(scratch.path() / "plain");
    const auto folder = scratch.path() / "drawn";
    std::filesystem::create_directories(folder);
    const auto size_of = [&](const std::string& name) {
        const auto figures = make_figures(read_cases({scratch.path() / name}));
        draw_figures({find(figures, "eroded_mass")}, folder);
        return std::filesystem::file_size(folder / "eroded_mass.svg");
    };
    // One case has no legend, so the pictures are equal; without its curve the odd one would be far smaller.
    EXPECT_EQ(size_of("it's \"odd\", <b>"), size_of("plain"));
}

TEST(GnuplotScript, draws_constant_zero_and_series_that_are_zero_on_a_log_axis)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "flat");
    auto cases = read_cases({scratch.path() / "flat"});
    for (const char* name : {"kinetic_energy", "eroded_mass_fraction", "mass_balance_error"}) std::ranges::fill(cases[0].series[name].values, 0.0);
    const auto folder = scratch.path() / "drawn";
    std::filesystem::create_directories(folder);
    EXPECT_NO_THROW(draw_figures(make_figures(cases), folder));
}

}  // namespace
}  // namespace coral::report
