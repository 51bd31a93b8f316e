// suffuse on hand-written scenes: theory, balances, equal bytes for any thread count, a killed run that goes on.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "core/hdf5.h"
#include "core/output_file.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

namespace fs = std::filesystem;

/// Two layers of coarse grains over a plate, fines between, water from above: resolved, semi-resolved, eroding.
std::string erosion_scene(const std::string& duration, const std::string& time_keys = "")
{
    std::string text = R"(
[domain]
origin = [0, 0, "-3.75mm"]
size = ["16mm", "16mm", "22mm"]
cell = "1mm"
[boundary]
"z+" = { type = "inlet", velocity = [0, 0, -0.15] }
"z-" = { type = "outlet", pressure = 0 }
[fluid]
kinematic_viscosity = 1e-6
[material.default]
normal_stiffness = 4e3
tangential_stiffness = 2e3
friction = 0.5
[[wall]]
type = "plate"
z = 0
hole = "5mm"
pitch = "8mm"
thickness = "1.5mm"
[output]
interval = "2ms"
[time]
duration = ")" + duration + "\"\n" + time_keys;
    const auto body = [&](double d, double x, double y, double z, const char* role) {
        text += "[[body]]\nshape = { type = \"sphere\", diameter = " + std::to_string(d) + " }\nposition = [" + std::to_string(x) + ", " + std::to_string(y) + ", " + std::to_string(z) +
                "]\nrole = \"" + role + "\"\n";
    };
    body(0.0095, 0.0048, 0.0048, 0.0049, "coarse");
    body(0.0095, 0.0112, 0.0112, 0.0125, "coarse");
    for (int n = 0; n < 12; ++n) body(0.002, 0.0110 + 0.0022 * (n % 2), 0.0015 + 0.0023 * (n / 2 % 3), 0.0015 + 0.0024 * (n / 6), "fine");
    for (int n = 0; n < 6; ++n) body(0.0022, 0.002 + 0.0024 * (n % 3), 0.0115 + 0.0024 * (n / 3), 0.002, "fine");
    return text;
}

void expect_equal_results(const fs::path& a, const fs::path& b)
{
    const H5File first = H5File::open(a), second = H5File::open(b);
    for (const std::string group : {"/series", "/trajectories", "/migration"}) {
        ASSERT_EQ(first.members(group), second.members(group));
        for (const std::string& name : first.members(group))
            EXPECT_EQ(first.read_doubles(group + "/" + name), second.read_doubles(group + "/" + name)) << group << "/" << name;
    }
}

TEST(Suffuse, sphere_falls_as_g_t_squared_over_2_without_fluid)
{
    const ScratchFolder folder;
    write_text(folder.path() / "case.toml", "[[body]]\nshape = { type = \"sphere\", diameter = 0.015 }\nposition = [0, 0, 0]\n[time]\nduration = 0.5\n[output]\ninterval = 0.1\n");
    const ProgramResult run = run_program("suffuse . --quiet", folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const H5File results = H5File::open(folder.path() / "results.h5");
    const std::vector<double> time = results.read_doubles("/series/time"), x = results.read_doubles("/trajectories/position");
    ASSERT_EQ(time.size(), 6u);
    for (std::size_t n = 1; n < time.size(); ++n) EXPECT_NEAR(x[3 * n + 2] / (-0.5 * 9.81 * time[n] * time[n]), 1, 1e-6);
    EXPECT_EQ(results.string_attribute("/series/time", "unit"), "s");
}

TEST(Suffuse, two_spheres_keep_their_energy_over_a_thousand_bounces)
{
    const ScratchFolder folder;
    fs::copy_file(fs::path(CORAL_SOURCE_DIR) / "pipeline/validation/elastic-bounce/case.toml", folder.path() / "case.toml");
    const ProgramResult run = run_program("suffuse . --quiet", folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const H5File results = H5File::open(folder.path() / "results.h5");
    const std::vector<double> kinetic = results.read_doubles("/series/kinetic_energy"), elastic = results.read_doubles("/series/elastic_energy");
    const std::vector<double> v = results.read_doubles("/trajectories/velocity");
    int bounces = 0;
    for (std::size_t n = 1; n < kinetic.size(); ++n) {
        // Between bounces: inside one the energies of a leapfrog step waver by (omega dt)^2/4 and come back.
        if (elastic[n] == 0) {
            EXPECT_NEAR(kinetic[n] / kinetic[0], 1, 1e-3);
        }
        bounces += v[6 * n] * v[6 * (n - 1)] < 0;
    }
    EXPECT_GE(bounces, 1000);
}

TEST(Suffuse, erosion_never_decreases_and_both_balances_close)
{
    const ScratchFolder folder;
    write_text(folder.path() / "case.toml", erosion_scene("60ms"));
    const ProgramResult run = run_program("suffuse . --json", folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_NE(run.out.find("\"complete\": true"), std::string::npos);
    const H5File results = H5File::open(folder.path() / "results.h5");
    const std::vector<double> eroded = results.read_doubles("/series/eroded_mass_fraction");
    EXPECT_TRUE(std::is_sorted(eroded.begin(), eroded.end()));
    EXPECT_GT(eroded.back(), 0);
    for (const double e : results.read_doubles("/series/mass_balance_error")) EXPECT_LT(e, 1e-10);
    for (const double e : results.read_doubles("/series/momentum_balance_error")) EXPECT_LT(e, 1e-6);
    const std::vector<double> layers = results.read_doubles("/series/fines_count"), count = results.read_doubles("/series/eroded_count");
    for (std::size_t n = 0; n < count.size(); ++n) EXPECT_EQ(layers[3 * n] + layers[3 * n + 1] + layers[3 * n + 2] + count[n], 18);
    EXPECT_GT(results.read_doubles("/series/hydraulic_gradient").back(), 0);
    EXPECT_TRUE(results.exists("/performance/milliseconds_per_flow_step"));
}

TEST(Suffuse, stops_where_the_way_of_the_inlet_is_blocked)
{
    const ScratchFolder folder;
    write_text(folder.path() / "case.toml", R"(
[domain]
size = ["8mm", "8mm", "20mm"]
cell = "1mm"
[boundary]
"z+" = { type = "inlet", velocity = [0, 0, -0.1] }
"z-" = { type = "outlet", pressure = 0 }
[fluid]
kinematic_viscosity = 1e-6
[[body]]
shape = { type = "sphere", diameter = "13mm" }
position = ["4mm", "4mm", "8mm"]
motion = "fixed"
role = "coarse"
[output]
interval = "20ms"
[time]
duration = "1s"
)");
    const ProgramResult run = run_program("suffuse . --quiet", folder.path());
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_NE(run.err.find("its way from the inlet is blocked"), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("open a way to the outlet"), std::string::npos) << run.err;
    EXPECT_TRUE(fs::exists(folder.path() / "checkpoint.h5")) << "nothing is left to look at";
    EXPECT_GT(H5File::open(folder.path() / "results.h5").read_doubles("/series/time").size(), 1u);
}

TEST(Suffuse, gives_the_same_bytes_for_one_and_two_threads)
{
    const ScratchFolder folder;
    for (const char* name : {"one", "two"}) {
        fs::create_directories(folder.path() / name / "case");
        write_text(folder.path() / name / "case" / "case.toml", erosion_scene("20ms"));
    }
    ASSERT_EQ(run_program("suffuse case --no-timing --quiet --threads 1", folder.path() / "one").exit_code, 0);
    ASSERT_EQ(run_program("suffuse case --no-timing --quiet --threads 2", folder.path() / "two").exit_code, 0);
    EXPECT_EQ(read_text_file(folder.path() / "one/case/results.h5"), read_text_file(folder.path() / "two/case/results.h5"));
}

TEST(Suffuse, stopped_and_resumed_run_ends_as_one_never_stopped)
{
    const ScratchFolder folder;
    for (const char* name : {"whole", "parts"}) {
        fs::create_directories(folder.path() / name);
        write_text(folder.path() / name / "case.toml", erosion_scene("20ms"));
    }
    ASSERT_EQ(run_program("suffuse whole --quiet", folder.path()).exit_code, 0);
    ASSERT_EQ(run_program("suffuse parts --quiet --until 7.1ms", folder.path()).exit_code, 0);
    const ProgramResult rest = run_program("suffuse parts --resume", folder.path());
    ASSERT_EQ(rest.exit_code, 0) << rest.err;
    EXPECT_NE(rest.err.find("resumed at t = 0.007"), std::string::npos) << rest.err;
    expect_equal_results(folder.path() / "whole/results.h5", folder.path() / "parts/results.h5");
    const H5File whole = H5File::open(folder.path() / "whole/results.h5"), parts = H5File::open(folder.path() / "parts/results.h5");
    for (const char* name : {"flow_steps", "dem_steps", "contacts"}) {
        const std::string path = std::string("/performance/") + name;
        EXPECT_EQ(whole.read_doubles(path), parts.read_doubles(path)) << name;
    }
}

TEST(Suffuse, run_in_single_precision_resumes_as_one_never_stopped_and_may_go_on_in_double)
{
    const ScratchFolder folder;
    const auto scene = [](const char* precision) {
        std::string text = erosion_scene("10ms");
        return text.insert(text.find("[fluid]\n") + 8, "precision = \"" + std::string(precision) + "\"\n");
    };
    for (const char* name : {"whole", "parts"}) {
        fs::create_directories(folder.path() / name);
        write_text(folder.path() / name / "case.toml", scene("single"));
    }
    ASSERT_EQ(run_program("suffuse whole --quiet", folder.path()).exit_code, 0);
    ASSERT_EQ(run_program("suffuse parts --quiet --until 3.1ms", folder.path()).exit_code, 0);
    fs::copy(folder.path() / "parts", folder.path() / "double");
    ASSERT_EQ(run_program("suffuse parts --quiet --resume", folder.path()).exit_code, 0);
    expect_equal_results(folder.path() / "whole/results.h5", folder.path() / "parts/results.h5");
    write_text(folder.path() / "double" / "case.toml", scene("double"));
    ASSERT_EQ(run_program("suffuse double --quiet --resume", folder.path()).exit_code, 0);
    const auto error = [&](const char* name) { return H5File::open(folder.path() / name / "results.h5").read_doubles("/series/mass_balance_error").back(); };
    EXPECT_LT(error("double"), 1e-12);
    EXPECT_GT(error("parts"), 1e-12);
    EXPECT_LT(error("parts"), 1e-4);
}

TEST(Suffuse, resumed_run_goes_on_with_the_contact_step_of_the_changed_case)
{
    const ScratchFolder folder;
    const auto dem_steps = [&] { return H5File::open(folder.path() / "results.h5").read_doubles("/performance/dem_steps")[0]; };
    write_text(folder.path() / "case.toml", erosion_scene("4ms", "dem_step = \"2us\"\n"));
    ASSERT_EQ(run_program("suffuse . --quiet --until 2ms", folder.path()).exit_code, 0);
    const std::string kept = read_text_file(folder.path() / "results.h5");
    EXPECT_EQ(run_program("suffuse . --quiet --until -5s", folder.path()).exit_code, 2);
    EXPECT_EQ(read_text_file(folder.path() / "results.h5"), kept) << "a stop before the start replaces nothing";
    const double first = dem_steps();
    EXPECT_NEAR(first, 1000, 60) << "each flow step holds a whole number of them";
    write_text(folder.path() / "case.toml", erosion_scene("4ms", "dem_step = \"1us\"\n"));
    const ProgramResult rest = run_program("suffuse . --resume", folder.path());
    ASSERT_EQ(rest.exit_code, 0) << rest.err;
    EXPECT_NE(rest.err.find("case.toml has changed"), std::string::npos) << rest.err;
    EXPECT_NEAR(dem_steps() - first, 2000, 60);
}

TEST(Suffuse, killed_run_goes_on_from_its_checkpoint_to_the_same_series)
{
    const ScratchFolder folder;
    for (const char* name : {"whole", "killed"}) {
        fs::create_directories(folder.path() / name);
        write_text(folder.path() / name / "case.toml", erosion_scene("30ms") + "\n");
    }
    std::string often = read_text_file(folder.path() / "killed/case.toml");
    often.replace(often.find("interval = \"2ms\""), 16, "interval = \"2ms\"\ncheckpoint = 0.01");
    write_text(folder.path() / "killed/case.toml", often);
    ASSERT_EQ(run_program("suffuse whole --quiet", folder.path()).exit_code, 0);
    const pid_t child = fork();
    if (child == 0) {
        const std::string tool = std::string(CORAL_BIN_DIR) + "/suffuse", run = (folder.path() / "killed").string();
        execl(tool.c_str(), tool.c_str(), run.c_str(), "--quiet", static_cast<char*>(nullptr));
        _exit(127);
    }
    // A checkpoint appears whole or not at all: kill as soon as there is one.
    for (int i = 0; i < 20000 && !fs::exists(folder.path() / "killed/checkpoint.h5"); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(fs::exists(folder.path() / "killed/checkpoint.h5"));
    ASSERT_TRUE(WIFSIGNALED(status)) << "the run ended before it could be killed";
    ASSERT_EQ(run_program("suffuse killed --resume --quiet", folder.path()).exit_code, 0);
    expect_equal_results(folder.path() / "whole/results.h5", folder.path() / "killed/results.h5");
}

TEST(Suffuse, interrupted_run_writes_a_checkpoint_and_ends_with_0)
{
    const ScratchFolder folder;
    write_text(folder.path() / "case.toml", erosion_scene("10s"));
    const pid_t child = fork();
    if (child == 0) {
        const std::string tool = std::string(CORAL_BIN_DIR) + "/suffuse", run = folder.path().string();
        execl(tool.c_str(), tool.c_str(), run.c_str(), "--quiet", static_cast<char*>(nullptr));
        _exit(127);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    kill(child, SIGTERM);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
    EXPECT_TRUE(fs::exists(folder.path() / "checkpoint.h5"));
    EXPECT_TRUE(fs::exists(folder.path() / "results.h5"));
}

TEST(Suffuse, runs_fluid_only_and_writes_frames)
{
    const ScratchFolder folder;
    write_text(folder.path() / "case.toml", R"(
[domain]
size = [0.01, 0.01, 0.01]
cell = 0.001
[boundary]
"x-" = { type = "inlet", velocity = [0.1, 0, 0] }
"x+" = { type = "outlet" }
[fluid]
density = 1000
[time]
duration = 0.01
[output]
interval = 0.002
frames = 0.005
)");
    const ProgramResult run = run_program("suffuse . --quiet", folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const H5File results = H5File::open(folder.path() / "results.h5");
    EXPECT_NEAR(results.read_doubles("/series/mean_velocity").at(3 * 5), 0.1, 1e-9);
    EXPECT_TRUE(fs::exists(folder.path() / "frames/fluid_00002.vti"));
    EXPECT_TRUE(fs::exists(folder.path() / "frames/fluid.pvd"));
    EXPECT_FALSE(fs::exists(folder.path() / "frames/bodies.pvd"));
}

TEST(Suffuse, says_in_one_line_what_is_wrong_and_leaves_no_output)
{
    const ScratchFolder folder;
    EXPECT_EQ(run_program("suffuse no_such_case", folder.path()).exit_code, 2);
    std::string closed = erosion_scene("1ms");
    closed.replace(closed.find("[0, 0, -0.15]"), 13, "[0, 0, 0]");
    write_text(folder.path() / "case.toml", closed);
    const ProgramResult run = run_program("suffuse .", folder.path());
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_NE(run.err.find("the inlet is closed"), std::string::npos) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_FALSE(fs::exists(folder.path() / "results.h5"));
}

TEST(Suffuse, refuses_a_damaged_checkpoint_with_1)
{
    const ScratchFolder folder;
    write_text(folder.path() / "case.toml", erosion_scene("1ms"));
    write_text(folder.path() / "checkpoint.h5", "not HDF5");
    const ProgramResult run = run_program("suffuse . --resume", folder.path());
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_NE(run.err.find("checkpoint.h5"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace coral::test
