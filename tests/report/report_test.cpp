#include "report/report.h"

#include <gtest/gtest.h>

#include <sys/wait.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/hdf5.h"
#include "core/output_file.h"
#include "report/example_case.h"
#include "report/page.h"
#include "report/scene.h"
#include "tools/run_program.h"

namespace coral::report {
namespace {

namespace fs = std::filesystem;
using test::ExampleCase;
using test::ScratchFolder;
using test::write_example_case;
using test::write_text;

/// A case that draws one figure only: quick.
std::vector<CaseData> bare_case(const ScratchFolder& scratch)
{
    write_example_case(scratch.path() / "bare", {.sample = false, .trajectories = false, .optional_series = false});
    return read_cases({scratch.path() / "bare"});
}

TEST(WriteReport, says_everything_without_script)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls");
    const auto outcome = write_report(read_cases({scratch.path() / "ls"}), scratch.path() / "report", {});
    const std::string page = read_text_file(scratch.path() / "report/report.html");
    EXPECT_EQ(page.size(), outcome.page_bytes);
    EXPECT_LT(page.size(), 10000000u);
    const std::string before_scripts = page.substr(0, page.find("<script"));
    for (const char* text : {"35 of 120 fines", "data:image/svg+xml;base64,", "120 × 120 × 128 of 500 um", "kenney-lau", "Greatest mass balance error",
                             "cells_per_second", "pack-sample", "hydraulic_conductivity.csv"})
        EXPECT_NE(before_scripts.find(text), std::string::npos) << text;
    // Offline: nothing is loaded from elsewhere.
    for (const char* text : {"src=\"http", "href=\"http", "src='http", "@import"}) EXPECT_EQ(page.find(text), std::string::npos) << text;
}

TEST(WriteReport, inlines_both_libraries_where_debian_has_them)
{
    if (!fs::exists("/usr/share/javascript/three/three.min.js") || !fs::exists("/usr/share/javascript/dygraphs/dygraph.min.js"))
        GTEST_SKIP() << "libjs-three or libjs-dygraphs is not installed";
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls", {.optional_series = false});
    const auto outcome = write_report(read_cases({scratch.path() / "ls"}), scratch.path() / "report", {});
    for (const std::string& note : outcome.notes) EXPECT_EQ(note.find("libjs"), std::string::npos) << note;
    const std::string page = read_text_file(scratch.path() / "report/report.html");
    EXPECT_NE(page.find("WebGLRenderer"), std::string::npos);
    EXPECT_NE(page.find("Dygraph"), std::string::npos);
    // As many ends as beginnings of script elements: no library or datum closes one early.
    const auto count = [&](const std::string& text) {
        int found = 0;
        for (std::size_t at = page.find(text); at != std::string::npos; at = page.find(text, at + 1)) ++found;
        return found;
    };
    EXPECT_EQ(count("</script"), 6);
}

TEST(WriteReport, does_without_the_libraries_and_says_so)
{
    const ScratchFolder scratch;
    ReportOptions options;
    options.libraries = scratch.path() / "none";
    const auto outcome = write_report(bare_case(scratch), scratch.path() / "report", options);
    ASSERT_EQ(outcome.notes.size(), 2u);
    EXPECT_NE(outcome.notes[0].find("libjs-dygraphs"), std::string::npos);
    EXPECT_NE(outcome.notes[1].find("libjs-three"), std::string::npos);
    const std::string page = read_text_file(scratch.path() / "report/report.html");
    EXPECT_EQ(page.find("<script"), std::string::npos);
    EXPECT_NE(page.find("libjs-three was not installed"), std::string::npos);
}

TEST(WriteReport, gives_the_same_bytes_again_and_replaces_its_own_folder)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls", {.steps = 11, .fines = 30, .optional_series = false});
    const auto cases = read_cases({scratch.path() / "ls"});
    write_report(cases, scratch.path() / "one", {});
    write_report(cases, scratch.path() / "two/", {});
    write_report(cases, scratch.path() / "two", {});
    std::size_t files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(scratch.path() / "one")) {
        if (!entry.is_regular_file()) continue;
        ++files;
        const fs::path other = scratch.path() / "two" / fs::relative(entry.path(), scratch.path() / "one");
        EXPECT_EQ(read_text_file(entry.path()), read_text_file(other)) << other;
    }
    EXPECT_GT(files, 15u);
    // Nothing is left beside.
    EXPECT_EQ(std::distance(fs::directory_iterator(scratch.path()), {}), 3);
}

TEST(WriteReport, never_replaces_a_folder_with_other_files)
{
    const ScratchFolder scratch;
    const auto cases = bare_case(scratch);
    const auto expect_refused = [&](const fs::path& folder, const std::string& what) {
        try {
            write_report(cases, folder, {});
            ADD_FAILURE() << "replaced " << folder;
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
        }
    };
    fs::create_directories(scratch.path() / "thesis");
    write_text(scratch.path() / "thesis/chapter.txt", "years of work");
    expect_refused(scratch.path() / "thesis", "chapter.txt");
    EXPECT_EQ(read_text_file(scratch.path() / "thesis/chapter.txt"), "years of work");

    fs::create_directories(scratch.path() / "other");
    write_text(scratch.path() / "other/report.html", "<!DOCTYPE html>\nsomebody else's");
    expect_refused(scratch.path() / "other", "not written by erosion-report");

    write_report(cases, scratch.path() / "mine", {});
    write_text(scratch.path() / "mine/figures/notes.txt", "mine");
    expect_refused(scratch.path() / "mine", "notes.txt");
    write_text(scratch.path() / "file", "text");
    expect_refused(scratch.path() / "file", "it is a file");
    expect_refused(scratch.path() / "no/such/place", "does not exist");
    EXPECT_THROW(write_report(cases, ".", {}), UsageError);
}

/// Playwright's answer to the page of an example case; skipped where node, playwright-core, Chromium or the libraries are absent.
TEST(ReportPage, works_in_chromium_offline_without_script_and_without_webgl)
{
    if (!fs::exists("/usr/share/javascript/three/three.min.js") || !fs::exists("/usr/share/javascript/dygraphs/dygraph.min.js"))
        GTEST_SKIP() << "libjs-three or libjs-dygraphs is not installed";
    if (std::system("command -v node >/dev/null 2>&1") != 0) GTEST_SKIP() << "node is not installed";
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls");
    write_report(read_cases({scratch.path() / "ls"}), scratch.path() / "report", {});
    const fs::path script = fs::path(__FILE__).parent_path() / "browser/page_test.mjs", log = scratch.path() / "log.txt";
    const int status = std::system(("node '" + script.string() + "' '" + (scratch.path() / "report/report.html").string() + "' >'" + log.string() + "' 2>&1").c_str());
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == 77) GTEST_SKIP() << read_text_file(log);
    EXPECT_EQ(WEXITSTATUS(status), 0) << read_text_file(log);
}

TEST(WriteReport, goes_on_without_a_picture_that_cannot_be_drawn)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls");
    const auto outcome = write_report(read_cases({scratch.path() / "ls"}), scratch.path() / "report", {});
    // The example's sample.h5 holds only what the report reads: no picture can be drawn of it, and the page says so instead of failing.
    ASSERT_FALSE(outcome.notes.empty());
    EXPECT_NE(outcome.notes.back().find("no picture of ls"), std::string::npos) << outcome.notes.back();
    fs::create_directories(scratch.path() / "report/pictures");
    write_text(scratch.path() / "report/pictures/mine.txt", "mine");
    EXPECT_THROW(write_report(read_cases({scratch.path() / "ls"}), scratch.path() / "report", {}), Error);
}

TEST(SceneJson, draws_polyhedra_by_their_faces_and_fines_in_their_shapes)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls");
    {
        // The shape of the fines becomes a cube of unit volume.
        H5File h5 = H5File::create(scratch.path() / "cube.h5");
        const H5File old = H5File::open(scratch.path() / "ls/sample.h5");
        h5.write("/particles/shape", old.read_integers("/particles/shape"), {126});
        h5.write("/particles/scale", old.read_doubles("/particles/scale"), {126});
        h5.write("/particles/role", old.read_strings("/particles/role"));
        std::vector<double> corners;
        for (const double x : {-0.5, 0.5})
            for (const double y : {-0.5, 0.5})
                for (const double z : {-0.5, 0.5}) corners.insert(corners.end(), {x, y, z});
        h5.write("/shapes/1/vertices", corners, {8, 3});
        h5.set_attribute("/shapes/1", "equivalent_diameter", 1.24);
        h5.make_group("/shapes/0");
        h5.set_attribute("/shapes/0", "equivalent_diameter", 15e-3);
        h5.commit();
    }
    fs::rename(scratch.path() / "cube.h5", scratch.path() / "ls/sample.h5");
    std::string note;
    const auto scene = nlohmann::json::parse(scene_json(read_case(scratch.path() / "ls"), {.frames = 3}, note));
    EXPECT_EQ(scene["grain_mesh"].size(), 120u);
    EXPECT_EQ(scene["sphere_radius"].size(), 6u);  // the coarse grains, whose lattice is gone
    ASSERT_EQ(scene["meshes"].size(), 1u);
    EXPECT_EQ(scene["meshes"][0]["vertices"], 24);  // four to each of six faces
    EXPECT_EQ(scene["meshes"][0]["triangles"], 12);
    for (const auto& group : scene["grain_group"]) EXPECT_LT(group.get<int>(), 3);
}

TEST(SceneJson, keeps_the_first_and_the_last_time_within_its_limits)
{
    const ScratchFolder scratch;
    write_example_case(scratch.path() / "ls");
    const CaseData data = read_case(scratch.path() / "ls");
    std::string note;
    const auto scene = nlohmann::json::parse(scene_json(data, {.frames = 7}, note));
    ASSERT_EQ(scene["times"].size(), 7u);
    EXPECT_EQ(scene["times"].front(), 0.0);
    EXPECT_EQ(scene["times"].back(), 2.0);
    EXPECT_EQ(scene["grain_mesh"].size(), 6u);
    EXPECT_EQ(scene["meshes"].size(), 1u);
    EXPECT_EQ(scene["sphere_radius"].size(), 120u);
    EXPECT_NEAR(scene["sphere_radius"][0].get<double>(), 0.75e-3, 1e-9);
    // Positions, orientations and the mesh account for every word.
    const std::size_t mesh = 3 * (scene["meshes"][0]["vertices"].get<std::size_t>() + scene["meshes"][0]["triangles"].get<std::size_t>());
    EXPECT_EQ(scene["words"].get<std::size_t>(), 7 * 3 * 126 + 7 * 4 * 6 + mesh);
    EXPECT_NE(note.find("7 of 41"), std::string::npos) << note;
}

TEST(SceneJson, says_why_there_is_none)
{
    const ScratchFolder scratch;
    std::string note;
    EXPECT_TRUE(scene_json(bare_case(scratch)[0], {}, note).empty());
    EXPECT_NE(note.find("no trajectories"), std::string::npos);
}

}  // namespace
}  // namespace coral::report
