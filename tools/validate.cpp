// validate: runs the scenes of pipeline/validation and prints target, value, error, tolerance and time of each in one table.
#include "cli.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "core/error.h"
#include "core/output_file.h"
#include "core/table.h"
#include "fluid/drag.h"
#include "suffusion/case_file.h"
#include "suffusion/results.h"
#include "suffusion/run.h"
#include "suffusion/shapes.h"
#include "validate/check.h"

namespace {

namespace fs = std::filesystem;
using coral::validate::Check;
using coral::validate::balance_tolerance;
using coral::validate::StudyOptions;
using coral::suffusion::Case;
using coral::suffusion::Column;
using coral::suffusion::Results;

struct Options {
    std::string scenes, output, grains;
    std::vector<std::string> only, skip;
    bool heavy = false;
    std::string precision = "double";
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
    return {{"mass balance", "1", 0, greatest(column(r.series, "mass_balance_error")), balance_tolerance(1e-10), false},
            {"momentum balance", "1", 0, greatest(column(r.series, "momentum_balance_error")), balance_tolerance(1e-6), false}};
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

/// Weight in water against the drag of one body: a sphere's by Schiller and Naumann, another's by the law of the case, turned as it is let go.
std::vector<Check> fine_settling(const Case& c, const Results& r)
{
    using coral::fluid::DragLaw;
    const coral::suffusion::BodySpec& body = c.bodies[0];
    const bool sphere = body.shape == coral::suffusion::ShapeKind::sphere;
    const auto shape = coral::suffusion::make_shape(body, c.folder, 0);
    const double d = sphere ? body.diameter : 2 * shape->equivalent_radius(), rho = c.fluid->density, nu = c.fluid->kinematic_viscosity;
    const coral::fluid::DragShape seen = coral::suffusion::Outline(*shape).along(body.orientation.conjugate() * c.gravity);
    const DragLaw law = sphere ? DragLaw::schiller_naumann : coral::fluid::drag_law_from_name(c.fluid->drag);
    const double weight = (c.materials.at("default").density - rho) * std::numbers::pi / 6 * d * d * d * c.gravity.norm();
    double low = 0, high = 10;
    for (int i = 0; i < 100; ++i) {
        const double mid = 0.5 * (low + high);
        (coral::fluid::drag_coefficient(law, 1, mid, d, rho, nu, seen) * mid < weight ? low : high) = mid;
    }
    std::vector<Check> checks{{"terminal speed in water", "m/s", low, column(r.trajectories, "speed").back(), 0.03, true, sphere ? "Schiller and Naumann 1933" : c.fluid->drag, d / c.domain->cell}};
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

/// A folder with a case, run as suffuse runs it, and what its results are held against.
struct Scene {
    const char* name;
    std::vector<Check> (*judge)(const Case&, const Results&);
    bool heavy = false;
};
const std::vector<Scene> scenes{{"free-fall", free_fall},         {"elastic-bounce", elastic_bounce}, {"cubic-array", cubic_array},        {"fine-settling", fine_settling},
                                {"fine-settling-third", fine_settling}, {"fine-settling-sixfold", fine_settling}, {"brick-settling", fine_settling},
                                {"small-erosion", small_erosion}, {"ten-cate-e4-coarse", ten_cate},   {"ten-cate-e4", ten_cate, true}};

/// A study makes its own cases, at several resolutions.
struct Study {
    const char* name;
    std::vector<Check> (*run)(const StudyOptions&);
};
const std::vector<Study> studies{{"falling-fine", coral::validate::falling_fine},
                                 {"ergun-bed", coral::validate::ergun_bed},
                                 {"ergun-walls", coral::validate::ergun_walls},
                                 {"two-schemes", coral::validate::two_schemes},
                                 {"cubic-arrays", coral::validate::cubic_arrays},
                                 {"array-positions", coral::validate::array_positions},
                                 {"array-time-step", coral::validate::array_time_step},
                                 {"centred-arrays", coral::validate::centred_arrays},
                                 {"random-bed", coral::validate::random_bed},
                                 {"fixed-sphere", coral::validate::fixed_sphere},
                                 {"rotating-sphere", coral::validate::rotating_sphere},
                                 {"closed-shell", coral::validate::closed_shell},
                                 {"ten-cate", coral::validate::ten_cate_tank},
                                 {"rising-sphere", coral::validate::rising_sphere},
                                 {"two-spheres", coral::validate::two_spheres},
                                 {"coral-grain", coral::validate::coral_grain}};

void declare(coral::cli::Options& options, Options& o)
{
    options.add("scenes", o.scenes, "Folder with one case folder a scene (pipeline/validation)").required();
    options.add("-o,--output", o.output, "Folder for the runs and validation.csv").required();
    options.add("--only", o.only, "Scenes and studies to run, heavy ones too");
    options.add("--skip", o.skip, "Scenes and studies to leave out");
    options.flag("--heavy", o.heavy, "Also what takes minutes: fine resolutions, the large tank");
    options.add("--precision", o.precision, "Of the flow's fields: double or single").one_of({"double", "single"});
    options.add("--grains", o.grains, "Level sets (csct2ls) for the settling grain; left out without");
}

Results run_scene(const Options& o, const std::string& name, const coral::cli::Context& context)
{
    const fs::path from = fs::path(o.scenes) / name, to = fs::path(o.output) / name;
    fs::create_directories(to);
    std::string text = coral::read_text_file(from / "case.toml");
    const std::string section = "[fluid]\n";
    if (const std::size_t at = text.find(section); at != std::string::npos) text.insert(at + section.size(), "precision = \"" + o.precision + "\"\n");
    coral::write_text_file(to / "case.toml", text);
    coral::suffusion::RunOptions options;
    options.record = context.record;
    coral::suffusion::run_case(to, options);
    return coral::suffusion::read_results(to / "results.h5");
}

/// The table as it grows: a line is on the screen as soon as its scene has run.
class Report {
public:
    Report(const fs::path& file, bool show) : file_(file), show_(show)
    {
        print(fmt::format("{:<16} {:<48} {:>6} {:>10} {:>10} {:>8} {:>8} {:>8}  {:<7} {}\n", "scene", "check", "cells", "target", "value", "error", "within", "time", "", "source of the target"));
    }
    void add(const std::string& scene, const std::vector<Check>& checks, double seconds)
    {
        for (const Check& c : checks) {
            const double time = c.seconds > 0 ? c.seconds : seconds;
            const bool shown = c.tolerance == coral::validate::shown_only;
            all_passed_ &= c.passes();
            table_.add({scene, c.what, c.unit, c.resolution, c.target, c.value, c.error(), c.tolerance, (long long)c.passes(), time, c.source});
            const std::string error = c.relative ? fmt::format("{:+.2f} %", 100 * c.error()) : fmt::format("{:.1e}", c.error());
            const std::string within = shown ? "" : c.relative ? fmt::format("{:.1f} %", 100 * c.tolerance) : fmt::format("{:.0e}", c.tolerance);
            print(fmt::format("{:<16} {:<48} {:>6} {:>10.5g} {:>10.5g} {:>8} {:>8} {:>6.0f} s  {:<7} {}\n", scene, c.what, c.resolution > 0 ? fmt::format("{:.1f}", c.resolution) : "", c.target, c.value,
                              error, within, time, shown ? "" : c.passes() ? "passed" : "FAILED", c.source));
        }
        table_.write(file_);
    }
    bool all_passed() const { return all_passed_; }
    nlohmann::ordered_json json() const
    {
        nlohmann::ordered_json json{{"passed", all_passed_}};
        for (const auto& row : table_.rows) {
            nlohmann::ordered_json check;
            for (std::size_t c = 0; c < table_.columns.size(); ++c) std::visit([&](const auto& value) { check[table_.columns[c]] = value; }, row[c]);
            check["passed"] = std::get<long long>(row[8]) == 1;
            json["checks"].push_back(check);
        }
        return json;
    }

private:
    void print(const std::string& line) const
    {
        if (!show_) return;
        std::fputs(line.c_str(), stdout);
        std::fflush(stdout);
    }
    fs::path file_;
    bool show_, all_passed_ = true;
    coral::Table table_{{"scene", "check", "unit", "resolution", "target", "value", "error", "tolerance", "passed", "seconds", "source"}, {}};
};

void run(const Options& o, const coral::cli::Context& context)
{
    if (!fs::is_directory(o.scenes)) throw coral::UsageError(o.scenes, "is no folder", "name pipeline/validation");
    const auto known = [](const std::string& name) {
        return std::ranges::any_of(scenes, [&](const Scene& s) { return s.name == name; }) || std::ranges::any_of(studies, [&](const Study& s) { return s.name == name; });
    };
    for (const std::string& name : o.only)
        if (!known(name)) throw coral::UsageError("--only", "there is no scene " + name);
    for (const std::string& name : o.skip)
        if (!known(name)) throw coral::UsageError("--skip", "there is no scene " + name);
    const auto wanted = [&](const char* name, bool heavy) {
        if (std::ranges::find(o.skip, name) != o.skip.end()) return false;
        return o.only.empty() ? o.heavy || !heavy : std::ranges::find(o.only, name) != o.only.end();
    };
    fs::create_directories(o.output);
    coral::validate::precision = o.precision == "single" ? coral::fluid::Precision::float32 : coral::fluid::Precision::float64;
    Report report(fs::path(o.output) / "validation.csv", !context.json && !context.quiet);
    for (const Scene& scene : scenes) {
        if (!wanted(scene.name, scene.heavy)) continue;
        const double begin = coral::validate::processor_seconds();
        const Results results = run_scene(o, scene.name, context);
        const double seconds = coral::validate::processor_seconds() - begin;
        report.add(scene.name, scene.judge(coral::suffusion::read_case(fs::path(o.output) / scene.name), results), seconds);
    }
    const StudyOptions study_options{o.output, o.scenes, o.grains, o.heavy};
    for (const Study& study : studies)
        if (wanted(study.name, false)) report.add(study.name, study.run(study_options), 0);
    coral::cli::print_summary(context, report.json(), report.all_passed() ? "every check passed" : "a check failed");
    if (!report.all_passed()) throw coral::Error("validate", "a check failed", "see the table");
}

}  // namespace

int main(int argc, char** argv)
{
    Options options;
    return coral::cli::run_tool(
        argc, argv, "validate", "Runs the validation scenes and studies and compares them with theory and experiment", [&](coral::cli::Options& declared) { declare(declared, options); },
        [&](const coral::cli::Context& context) { run(options, context); });
}
