// pack-sample as a user runs it: a small sphere packing, its summary, and what it says about bad input.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <thread>

#include "core/output_file.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

const std::string spec =
    "[box]\nsize = [\"8mm\", \"8mm\", \"12mm\"]\n"
    "[[population]]\nrole = \"coarse\"\ndiameter = \"3mm\"\ncount = 8\n"
    "[[population]]\nrole = \"fine\"\ndiameter = \"1mm\"\nmass_fraction = 0.3\n"
    "[material.default]\nnormal_stiffness = 2e4\ntangential_stiffness = 1e4\nfriction = 0.3\n"
    "[dropping]\ntime_limit = \"30ms\"\n[compression]\npressure = \"5kPa\"\n";

TEST(PackSample, writes_a_sample_and_its_figures_as_json)
{
    const ScratchFolder folder;
    write_text(folder.path() / "spec.toml", spec);
    const ProgramResult result = run_program("pack-sample spec.toml -o sample.h5 --json --quiet --seed 3", folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "sample.h5"));
    for (const char* key : {"\"porosity\":", "\"fines_content\":", "\"coordination\":", "\"kezdi\":", "\"kenney-lau\":", "\"mao\":",
                            "\"unbalanced_ratio\":", "\"kinetic_ratio\":", "\"wall_pressure\":", "\"coarse\": 8"})
        EXPECT_NE(result.out.find(key), std::string::npos) << key << " is missing in " << result.out;
}

TEST(PackSample, draws_the_gradation_and_tells_the_relative_density)
{
    const ScratchFolder folder;
    write_text(folder.path() / "spec.toml", spec + "[density]\ne_min = 0.4\ne_max = 1.2\n");
    const ProgramResult result = run_program("pack-sample spec.toml -o sample.h5 --psd-figure psd.png --figure cut.png --seed 3", folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_GT(std::filesystem::file_size(folder.path() / "psd.png"), 1000u);
    EXPECT_GT(std::filesystem::file_size(folder.path() / "cut.png"), 10000u);
    EXPECT_NE(result.out.find("relative density"), std::string::npos) << result.out;
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 4);  // nothing is left behind
    EXPECT_EQ(run_program("pack-sample spec.toml -o sample.h5 --psd-figure psd.gif", folder.path()).exit_code, 2);
    EXPECT_EQ(run_program("pack-sample spec.toml -o sample.h5 --figure cut.gif", folder.path()).exit_code, 2);
    EXPECT_EQ(read_text_file(folder.path() / "sample.h5").find("cut.png"), std::string::npos);  // a picture does not change the sample
}

/// Packs in a process of its own and sends a signal after a while.
int stopped_after(const std::filesystem::path& folder, int milliseconds, int signal)
{
    const pid_t child = fork();
    if (child == 0) {
        std::filesystem::current_path(folder);
        const std::string tool = std::string(CORAL_BIN_DIR) + "/pack-sample";
        std::freopen("log", "a", stderr);
        execl(tool.c_str(), tool.c_str(), "spec.toml", "-o", "parts.h5", "--quiet", "--resume", "--checkpoint-every", "10ms", nullptr);
        _exit(99);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

TEST(PackSample, goes_on_after_signals_to_the_same_bytes)
{
    const ScratchFolder folder;
    write_text(folder.path() / "spec.toml", spec);
    ASSERT_EQ(run_program("pack-sample spec.toml -o whole.h5 --quiet", folder.path()).exit_code, 0);
    int parts = 0;
    // longer and longer, since a loaded machine may take all of a short time to start
    for (int wait = 200; !std::filesystem::exists(folder.path() / "parts.h5"); wait += 100, ++parts) {
        ASSERT_LT(parts, 100) << read_text_file(folder.path() / "log");
        const int signal = parts % 3 == 2 ? SIGKILL : parts % 3 == 1 ? SIGINT : SIGTERM;
        const int code = stopped_after(folder.path(), wait, signal);
        // a signal before the packing has begun ends the process as usual
        EXPECT_TRUE(code == 0 || code == 128 + signal) << code;
    }
    EXPECT_GT(parts, 1) << "never stopped on the way";
    EXPECT_NE(read_text_file(folder.path() / "log").find("parts.h5.checkpoint is written, give the same command with --resume to go on"), std::string::npos);
    EXPECT_TRUE(read_text_file(folder.path() / "parts.h5") == read_text_file(folder.path() / "whole.h5"));
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "parts.h5.checkpoint"));
}

TEST(PackSample, ends_with_1_on_a_checkpoint_it_cannot_use)
{
    const ScratchFolder folder;
    write_text(folder.path() / "spec.toml", spec);
    write_text(folder.path() / "sample.h5.checkpoint", "no checkpoint");
    const ProgramResult result = run_program("pack-sample spec.toml -o sample.h5 --resume --quiet", folder.path());
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find("sample.h5.checkpoint: is not an HDF5 file"), std::string::npos) << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "sample.h5"));
}

TEST(PackSample, reports_every_wrong_key_of_a_specification_and_ends_with_2)
{
    const ScratchFolder folder;
    write_text(folder.path() / "spec.toml", "[box]\nsize = [\"8mm\", \"8mm\", \"12kg\"]\n[[population]]\nrole = \"coarse\"\ndiametre = \"3mm\"\ncount = 8\n");
    const ProgramResult result = run_program("pack-sample spec.toml -o sample.h5", folder.path());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("spec.toml:2:"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("did you mean 'diameter'"), std::string::npos) << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "sample.h5"));
}

TEST(PackSample, ends_with_2_on_a_scale_that_scales_nothing)
{
    const ScratchFolder folder;
    write_text(folder.path() / "spec.toml", spec);
    const ProgramResult result = run_program("pack-sample spec.toml -o sample.h5 --scale 2", folder.path());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("diameters of its own"), std::string::npos) << result.err;
    EXPECT_EQ(run_program("pack-sample spec.toml -o sample.h5 --scale 0", folder.path()).exit_code, 2);
}

TEST(PackSample, ends_with_1_on_a_damaged_mesh)
{
    const ScratchFolder folder;
    write_text(folder.path() / "stone.stl", "this is no mesh");
    write_text(folder.path() / "spec.toml", "[box]\nsize = [0.02, 0.02, 0.02]\n[[population]]\nrole = \"coarse\"\nshape = \"polyhedron\"\nfile = \"stone.stl\"\nunit = \"mm\"\ncount = 2\n");
    const ProgramResult result = run_program("pack-sample spec.toml -o sample.h5", folder.path());
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_NE(result.err.find("stone.stl"), std::string::npos) << result.err;
}

TEST(PackSample, ends_with_1_on_a_damaged_grain_file)
{
    const ScratchFolder folder;
    write_text(folder.path() / "grains.vdb", "this is no level set");
    write_text(folder.path() / "spec.toml", "[box]\nsize = [0.02, 0.02, 0.02]\n[[population]]\nrole = \"coarse\"\nshape = \"level-set\"\nfile = \"grains.vdb\"\ncount = 2\n");
    const ProgramResult result = run_program("pack-sample spec.toml -o sample.h5", folder.path());
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_NE(result.err.find("grains.vdb"), std::string::npos) << result.err;
}

TEST(PackSample, ends_with_2_on_a_specification_that_is_no_text)
{
    const ScratchFolder folder;
    write_text(folder.path() / "sample.h5", std::string("\x89HDF\0\0", 6));
    const ProgramResult result = run_program("pack-sample sample.h5 -o out.h5", folder.path());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("sample.h5: is no text"), std::string::npos) << result.err;
}

TEST(PackSample, ends_with_2_when_the_specification_or_the_output_folder_is_missing)
{
    const ScratchFolder folder;
    EXPECT_EQ(run_program("pack-sample none.toml -o sample.h5", folder.path()).exit_code, 2);
    write_text(folder.path() / "spec.toml", spec);
    const ProgramResult result = run_program("pack-sample spec.toml -o none/sample.h5", folder.path());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("folder does not exist"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace coral::test
