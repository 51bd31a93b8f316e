// ls2sh: level sets of grains -> spherical harmonics of their apparent shapes, with the errors of the fit.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <optional>

#include "cli.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/table.h"
#include "sdf/vdb_io.h"
#include "sh/shape_file.h"

using namespace coral;

namespace {

struct Options {
    std::filesystem::path input, output, table, convergence;
    int degree = 10;
    double tolerance = 0.0;
    bool degree_given = false, force = false, skip = false;
};

constexpr int lowest_degree = 2, highest_degree = 30;  // searched for a tolerance when no degree bounds it

/// \return the option --degree
cli::Option declare(cli::Options& options, Options& o)
{
    options.add("input", o.input, "Level sets of grains, .vdb of csct2ls").required().existing_file();
    options.add("-o,--output", o.output, "Harmonic shapes, .sh.h5").required();
    const cli::Option degree = options.add("--degree", o.degree, "Degree of the harmonics; with --tolerance the highest tried (then 30)").between(2, 60);
    options.quantity("--tolerance", o.tolerance, Dimension::number, "Lowest degree whose RMS error is below this share of the equivalent diameter (2%); 0 takes --degree");
    options.add("--table", o.table, "Errors per grain, .csv");
    options.add("--convergence", o.convergence, "Errors per grain and degree from 2, .csv");
    options.flag("--force", o.force, "Fit grains that are far from star-shaped by their outer envelope");
    options.flag("--skip", o.skip, "Leave such grains out");
    return degree;
}

struct Fitted {
    sh::ShapeRecord shape;
    std::vector<std::pair<int, sh::FitErrors>> by_degree;
    double outer_excess = 0.0, seconds = 0.0;
    bool centre_inside = true, met = true;
    std::string refusal;  ///< why the grain must not be fitted; empty when it may
};

std::string why_refused(const sh::RadialSamples& samples)
{
    if (!samples.centre_inside) return "its centroid lies outside it";
    if (samples.non_star_fraction > sh::non_star_refusal)
        return fmt::format("{:.1f} % of the directions from its centroid cross the surface more than once", 100 * samples.non_star_fraction);
    return {};
}

Fitted fit_grain(const sdf::GrainLevelSet& grain, const Options& o)
{
    const auto start = std::chrono::steady_clock::now();
    const int bound = o.tolerance > 0 && !o.degree_given ? highest_degree : o.degree;
    Fitted f;
    f.shape.id = grain.id;
    const sh::RadialSamples samples = sh::cast_rays(grain.apparent, bound);
    f.refusal = why_refused(samples);
    f.shape.errors.non_star_fraction = samples.non_star_fraction;
    f.centre_inside = samples.centre_inside;
    if (!f.refusal.empty() && !o.force) return f;
    if (std::ranges::find(samples.radii, 0.0) != samples.radii.end())
        throw Error(fmt::format("grain {}", grain.id), "some directions from its centroid miss it: no radius describes it", "--skip leaves it out");

    const sh::FitReference reference(grain.apparent);
    f.outer_excess = samples.outer_volume / reference.volume() - 1.0;
    const auto evaluate = [&](int degree) {
        f.shape.surface = sh::fit(samples, degree, reference.volume());
        f.shape.errors = reference.errors(f.shape.surface, samples);
    };
    if (o.tolerance > 0 || !o.convergence.empty()) {
        std::optional<sh::ShapeRecord> chosen;
        for (int degree = lowest_degree; degree <= bound; ++degree) {
            evaluate(degree);
            f.by_degree.emplace_back(degree, f.shape.errors);
            if (o.tolerance > 0 && !chosen && f.shape.errors.rms_error <= o.tolerance) chosen = f.shape;
            if (chosen && o.convergence.empty()) break;
        }
        if (chosen) f.shape = *chosen;
        f.met = chosen || o.tolerance <= 0;
    } else {
        evaluate(o.degree);
    }
    f.shape.volume = sh::body_properties(f.shape.surface).volume;
    f.shape.solid_volume = grain.volume;
    f.shape.equivalent_diameter = grain.equivalent_diameter;
    f.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return f;
}

std::vector<Fitted> fit_all(const sdf::GrainReader& reader, const Options& o)
{
    std::vector<Fitted> fitted(reader.ids().size());
    Progress progress("grains", double(fitted.size()));
    std::mutex mutex;
    std::size_t done = 0;
    parallel_blocks(fitted.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            fitted[n] = fit_grain(reader.read(reader.ids()[n]), o);
            const std::lock_guard lock(mutex);
            progress.update(double(++done));
        }
    });
    progress.finish();
    return fitted;
}

/// Warns of shapes that harmonics hold badly; takes refused grains out or stops. Returns how many were taken out.
std::size_t sort_out(std::vector<Fitted>& fitted, const Options& o)
{
    std::string refused;
    for (const Fitted& f : fitted) {
        if (!f.refusal.empty()) {
            if (o.force) spdlog::warn("grain {}: {}; fitted by its outer envelope, volume {:+.1f} % before scaling", f.shape.id, f.refusal, 100 * f.outer_excess);
            else if (o.skip) spdlog::warn("grain {}: {}; left out", f.shape.id, f.refusal);
            else refused += fmt::format("{}grain {}: {}", refused.empty() ? "" : "; ", f.shape.id, f.refusal);
            continue;
        }
        if (f.shape.errors.non_star_fraction > sh::non_star_warning)
            spdlog::warn("grain {}: {:.1f} % of the directions cross its surface more than once; the outermost crossing is fitted", f.shape.id, 100 * f.shape.errors.non_star_fraction);
        if (!f.met) spdlog::warn("grain {}: RMS error {:.2f} % at degree {}, above the tolerance", f.shape.id, 100 * f.shape.errors.rms_error, f.shape.surface.degree);
    }
    if (!refused.empty()) throw Error(o.input.filename().string(), "not star-shaped: " + refused, "--force fits the outer envelope, --skip leaves them out");
    if (o.force) return 0;
    return std::erase_if(fitted, [](const Fitted& f) { return !f.refusal.empty(); });
}

std::vector<Cell> error_cells(const sh::FitErrors& e)
{
    return {e.rms_error, e.max_error, e.volume_error, e.area_error, e.inertia_error, e.non_star_fraction};
}

Table shape_table(const std::vector<Fitted>& fitted)
{
    Table table{{"id", "degree", "method", "rms_error", "max_error", "volume_error", "area_error", "inertia_error", "non_star_fraction", "seconds",
                 "centroid_shift", "outer_volume_excess"}, {}};
    for (const Fitted& f : fitted) {
        std::vector<Cell> row = {static_cast<long long>(f.shape.id), static_cast<long long>(f.shape.surface.degree), f.shape.surface.method};
        for (Cell& cell : error_cells(f.shape.errors)) row.push_back(std::move(cell));
        row.insert(row.end(), {f.seconds, f.shape.errors.centroid_shift, f.outer_excess});
        table.add(std::move(row));
    }
    return table;
}

Table convergence_table(const std::vector<Fitted>& fitted)
{
    Table table{{"id", "degree", "method", "rms_error", "max_error", "volume_error", "area_error", "inertia_error", "non_star_fraction"}, {}};
    for (const Fitted& f : fitted)
        for (const auto& [degree, errors] : f.by_degree) {
            std::vector<Cell> row = {static_cast<long long>(f.shape.id), static_cast<long long>(degree), f.shape.surface.method};
            for (Cell& cell : error_cells(errors)) row.push_back(std::move(cell));
            table.add(std::move(row));
        }
    return table;
}

void summarise(const std::vector<Fitted>& fitted, std::size_t left_out, const Options& o, const cli::Context& context)
{
    double rms = 0, worst = 0, area = 0, millimetres = 0;
    int lowest = 1000, highest = 0;
    for (const Fitted& f : fitted) {
        rms += f.shape.errors.rms_error / double(fitted.size());
        area += f.shape.errors.area_error / double(fitted.size());
        millimetres += 1e3 * f.shape.errors.rms_error * f.shape.equivalent_diameter / double(fitted.size());
        worst = std::max(worst, f.shape.errors.max_error);
        lowest = std::min(lowest, f.shape.surface.degree);
        highest = std::max(highest, f.shape.surface.degree);
    }
    nlohmann::ordered_json json;
    json["output"] = o.output.filename().string();
    json["grains"] = fitted.size();
    json["left_out"] = left_out;
    json["degree_lowest"] = fitted.empty() ? 0 : lowest;
    json["degree_highest"] = highest;
    json["rms_error_mean"] = rms;
    json["max_error"] = worst;
    json["area_error_mean"] = area;
    for (const Fitted& f : fitted)
        json["shapes"].push_back({{"id", f.shape.id}, {"degree", f.shape.surface.degree}, {"rms_error", f.shape.errors.rms_error},
                                  {"max_error", f.shape.errors.max_error}, {"non_star_fraction", f.shape.errors.non_star_fraction}, {"seconds", f.seconds}});
    std::string human = fmt::format("{} grains", fitted.size());
    if (!fitted.empty())
        human += fmt::format(", degree {}\nRMS error {:.2f} % of the equivalent diameter ({:.3f} mm) in the mean, worst point {:.2f} %, area {:+.1f} % in the mean",
                             lowest == highest ? std::to_string(lowest) : fmt::format("{} to {}", lowest, highest), 100 * rms, millimetres, 100 * worst, 100 * area);
    cli::print_summary(context, json, human + "\n" + o.output.string() + "\n");
}

void run(const Options& o, const cli::Context& context)
{
    if (o.force && o.skip) throw UsageError("--force, --skip", "exclude each other");
    if (o.tolerance < 0 || o.tolerance >= 1) throw UsageError("--tolerance", "must lie between 0 and 1", "2% is a usual value");
    const sdf::GrainReader reader(o.input);
    std::vector<Fitted> fitted = fit_all(reader, o);
    const std::size_t left_out = sort_out(fitted, o);
    if (fitted.empty()) spdlog::warn("{}: no grain to fit", o.input.filename().string());

    History history = reader.history();
    history.push_back(context.record);
    std::vector<sh::ShapeRecord> shapes;
    for (const Fitted& f : fitted) shapes.push_back(f.shape);
    sh::write_shapes(o.output, shapes, history);
    if (!o.table.empty()) shape_table(fitted).write(o.table);
    if (!o.convergence.empty()) convergence_table(fitted).write(o.convergence);
    summarise(fitted, left_out, o, context);
}

}  // namespace

int main(int argc, char** argv)
{
    Options o;
    cli::Option degree;
    return cli::run_tool(
        argc, argv, "ls2sh", "Level sets of grains to spherical harmonics of their apparent shapes",
        [&](cli::Options& declared) { degree = declare(declared, o); },
        [&](const cli::Context& context) {
            o.degree_given = degree.given();
            run(o, context);
        });
}
