// validate: runs the scenes of pipeline/validation and prints target, value, error, tolerance and time of each in one table.
#include "cli.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "core/error.h"
#include "core/table.h"
#include "fluid/drag.h"
#include "suffusion/case_file.h"
#include "suffusion/results.h"
#include "suffusion/run.h"

namespace {

namespace fs = std::filesystem;
using coral::suffusion::Case;
using coral::suffusion::Column;
using coral::suffusion::Results;

struct Options {
    std::string scenes, output;
    std::vector<std::string> only, skip;
};

/// One comparison of a scene.
struct Check {
    std::string what, unit;
    double target, value, tolerance;
    bool relative = true;  ///< the error is divided by the target
    double error() const { return relative ? std::abs(value / target - 1) : std::abs(value - target); }
    bool passes() const { return error() <= tolerance; }
};

const std::vector<double>& column(const std::vector<Column>& columns, const std::string& name)
{
    for (const Column& c : columns)
        if (c.name == name) return c.values;
    throw coral::Error("results.h5", "has no column " + name);
}

double greatest(const std::vector<double>& values)
{
    double result = 0;
    for (const double v : values) result = std::max(result, std::abs(v));
    return result;
}

std::vector<Check> balances(const Results& r)
{
    return {{"mass balance", "1", 0, greatest(column(r.series, "mass_balance_error")), 1e-10, false},
            {"momentum balance", "1", 0, greatest(column(r.series, "momentum_balance_error")), 1e-6, false}};
}

std::vector<Check> free_fall(const Case& c, const Results& r)
{
    const std::vector<double>& x = column(r.trajectories, "position");
    const double t = column(r.series, "time").back();
    return {{"fall after 1 s", "m", 0.5 * c.gravity.z() * t * t, x.back(), 1e-6}};
}

std::vector<Check> elastic_bounce(const Case&, const Results& r)
{
    const std::vector<double>&kinetic = column(r.series, "kinetic_energy"), &elastic = column(r.series, "elastic_energy");
    const std::vector<double>& v = column(r.trajectories, "velocity");
    double bounces = 0, worst = 0, sign = v[0] > 0 ? 1 : -1;
    for (std::size_t n = 0; n < kinetic.size(); ++n) {
        // Between bounces: inside one the energies of a leapfrog step waver by (omega dt)^2/4 and come back.
        if (elastic[n] == 0) worst = std::max(worst, std::abs(kinetic[n] / kinetic[0] - 1));
        if (v[6 * n] * sign < 0) sign = -sign, ++bounces;
    }
    return {{"energy kept, worst between bounces", "1", 0, worst, 1e-3, false}, {"bounces, at least 1000", "1", 0, std::max(0.0, 1000 - bounces), 0, false}};
}

std::vector<Check> cubic_array(const Case& c, const Results& r)
{
    const double radius = 0.5 * c.bodies[0].diameter, mu = c.fluid->density * c.fluid->kinematic_viscosity;
    const double force = c.fluid->density * c.fluid->body_acceleration.x() * c.domain->size.prod();
    const std::vector<double>& u = column(r.series, "mean_velocity");
    const std::vector<double>& f = column(r.trajectories, "fluid_force");
    const double speed = u[u.size() - 3];
    std::vector<Check> checks{{"drag factor K (Zick and Homsy)", "1", 7.442, force / (6 * std::numbers::pi * mu * radius * speed), 0.05},
                              {"force on the sphere", "N", force, f[f.size() - 3], 1e-3}};
    for (const Check& b : balances(r)) checks.push_back(b);
    return checks;
}

std::vector<Check> ten_cate(const Case&, const Results& r)
{
    std::vector<Check> checks{{"peak speed (ten Cate E4)", "m/s", 0.1226, greatest(column(r.trajectories, "speed")), 0.05}};
    for (const Check& b : balances(r)) checks.push_back(b);
    return checks;
}

/// Weight in water against the drag of one sphere. A lone grain counts its own volume in the void fraction it feels, and falls up to a fifth too slowly.
std::vector<Check> fine_settling(const Case& c, const Results& r)
{
    const double d = c.bodies[0].diameter, rho = c.fluid->density, nu = c.fluid->kinematic_viscosity;
    const double weight = (c.materials.at("default").density - rho) * std::numbers::pi / 6 * d * d * d * c.gravity.norm();
    double low = 0, high = 10;
    for (int i = 0; i < 100; ++i) {
        const double mid = 0.5 * (low + high);
        (coral::fluid::drag_coefficient(coral::fluid::DragLaw::schiller_naumann, 1, mid, d, rho, nu) * mid < weight ? low : high) = mid;
    }
    std::vector<Check> checks{{"terminal speed (Schiller and Naumann)", "m/s", low, column(r.trajectories, "speed").back(), 0.1}};
    for (const Check& b : balances(r)) checks.push_back(b);
    return checks;
}

std::vector<Check> small_erosion(const Case&, const Results& r)
{
    const std::vector<double>& eroded = column(r.series, "eroded_mass_fraction");
    double greatest_fall = 0;
    for (std::size_t n = 1; n < eroded.size(); ++n) greatest_fall = std::max(greatest_fall, eroded[n - 1] - eroded[n]);
    std::vector<Check> checks{{"erosion never decreases", "1", 0, greatest_fall, 0, false}, {"some fines eroded", "1", 0, eroded.back() > 0 ? 0. : 1., 0, false}};
    for (const Check& b : balances(r)) checks.push_back(b);
    return checks;
}

struct Scene {
    const char* name;
    std::vector<Check> (*judge)(const Case&, const Results&);
};
const std::vector<Scene> scenes{{"free-fall", free_fall},         {"elastic-bounce", elastic_bounce}, {"cubic-array", cubic_array},  {"fine-settling", fine_settling},
                                {"small-erosion", small_erosion}, {"ten-cate-e4-coarse", ten_cate},   {"ten-cate-e4", ten_cate}};

void declare(coral::cli::Options& options, Options& o)
{
    options.add("scenes", o.scenes, "Folder with one case folder a scene (pipeline/validation)").required();
    options.add("-o,--output", o.output, "Folder for the runs and validation.csv").required();
    options.add("--only", o.only, "Scenes to run");
    options.add("--skip", o.skip, "Scenes to leave out (ten-cate-e4 takes minutes)");
}

Results run_scene(const Options& o, const std::string& name, const coral::cli::Context& context)
{
    const fs::path from = fs::path(o.scenes) / name, to = fs::path(o.output) / name;
    fs::create_directories(to);
    fs::copy_file(from / "case.toml", to / "case.toml", fs::copy_options::overwrite_existing);
    coral::suffusion::RunOptions options;
    options.record = context.record;
    coral::suffusion::run_case(to, options);
    return coral::suffusion::read_results(to / "results.h5");
}

void run(const Options& o, const coral::cli::Context& context)
{
    if (!fs::is_directory(o.scenes)) throw coral::UsageError(o.scenes, "is no folder", "name pipeline/validation");
    for (const std::string& name : o.only)
        if (std::ranges::none_of(scenes, [&](const Scene& s) { return s.name == name; })) throw coral::UsageError("--only", "there is no scene " + name);
    coral::Table table{{"scene", "check", "unit", "target", "value", "error", "tolerance", "passed", "seconds"}, {}};
    std::string human = fmt::format("{:<20} {:<38} {:>11} {:>11} {:>9} {:>9} {:>7}\n", "scene", "check", "target", "value", "error", "tolerance", "time");
    bool all = true;
    for (const Scene& scene : scenes) {
        if (!o.only.empty() && std::ranges::find(o.only, scene.name) == o.only.end()) continue;
        if (std::ranges::find(o.skip, scene.name) != o.skip.end()) continue;
        const auto start = std::chrono::steady_clock::now();
        const Results results = run_scene(o, scene.name, context);
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        for (const Check& check : scene.judge(coral::suffusion::read_case(fs::path(o.output) / scene.name), results)) {
            all &= check.passes();
            table.add({std::string(scene.name), check.what, check.unit, check.target, check.value, check.error(), check.tolerance, (long long)check.passes(), seconds});
            human += fmt::format("{:<20} {:<38} {:>11.5g} {:>11.5g} {:>9.1e} {:>9.1e} {:>5.0f} s {}\n", scene.name, check.what, check.target, check.value, check.error(), check.tolerance,
                                 seconds, check.passes() ? "passed" : "FAILED");
        }
    }
    table.write(fs::path(o.output) / "validation.csv");
    nlohmann::ordered_json json{{"passed", all}};
    for (const auto& row : table.rows)
        json["checks"].push_back({{"scene", std::get<std::string>(row[0])}, {"check", std::get<std::string>(row[1])}, {"target", std::get<double>(row[3])},
                                  {"value", std::get<double>(row[4])}, {"error", std::get<double>(row[5])}, {"tolerance", std::get<double>(row[6])}, {"passed", std::get<long long>(row[7]) == 1}});
    coral::cli::print_summary(context, json, human);
    if (!all) throw coral::Error("validate", "a check failed", "see the table");
}

}  // namespace

int main(int argc, char** argv)
{
    Options options;
    return coral::cli::run_tool(
        argc, argv, "validate", "Runs the validation scenes and compares them with theory and experiment", [&](coral::cli::Options& declared) { declare(declared, options); },
        [&](const coral::cli::Context& context) { run(options, context); });
}
