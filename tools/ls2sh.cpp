// ls2sh: level sets of grains -> spherical harmonics of their apparent shapes, with the errors of the fit; or shapes that others
// publish -> the same file.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <optional>

#include "cli.h"
#include "core/error.h"
#include "core/output_file.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/table.h"
#include "core/units.h"
#include "sdf/vdb_io.h"
#include "sh/import.h"
#include "sh/shape_file.h"

using namespace coral;

namespace {

struct Options {
    std::filesystem::path input, output, table, convergence;
    std::vector<std::filesystem::path> import;
    int degree = 10;
    double tolerance = 0.0, unit = 0.0, scale_to = 0.0;
    bool degree_given = false, force = false, skip = false;
};

constexpr int lowest_degree = 2, highest_degree = 30;  // searched for a tolerance when no degree bounds it

/// What run() must know beyond the values: which options were given.
struct Given {
    cli::Option input, degree;
};

Given declare(cli::Options& options, Options& o)
{
    Given given;
    given.input = options.add("input", o.input, "Level sets of grains, .vdb of csct2ls").existing_file();
    options.add("-o,--output", o.output, "Harmonic shapes, .sh.h5").required();
    given.degree = options.add("--degree", o.degree, "Degree of the harmonics; with --tolerance the highest tried (then 30); with --import the highest kept (then that of the file)").between(2, 60);
    options.quantity("--tolerance", o.tolerance, Dimension::number, "Lowest degree whose RMS error is below this share of the equivalent diameter (2%); 0 takes --degree");
    options.add("--table", o.table, "Errors per grain, .csv");
    options.add("--convergence", o.convergence, "Errors per grain and degree from 2, .csv");
    options.flag("--force", o.force, "Fit grains that are far from star-shaped by their outer envelope; their method is then outer-envelope");
    options.flag("--skip", o.skip, "Leave such grains out");
    options.add("--import", o.import, "Instead of level sets: published shapes. Coefficients of TSQUARE with its table of figures (files or a folder), or a table of the Sand Atlas (ellipsoids)");
    options.quantity("--unit", o.unit, Dimension::length, "With --import: length of one unit of files that do not say it (1mm)");
    options.quantity("--scale-to", o.scale_to, Dimension::length, "With --import: equivalent diameter every shape is scaled to; 0 keeps sizes");
    return given;
}

constexpr const char* envelope_method = "outer-envelope";

struct Fitted {
    sh::ShapeRecord shape;
    std::vector<std::pair<int, sh::FitErrors>> by_degree;  ///< NaN where the radius of a degree is not positive
    double outer_excess = 0.0, seconds = 0.0;
    bool centre_inside = true, met = true;
    std::string refusal;  ///< why the grain must not be fitted; empty when it may
    bool has_surface = false;  ///< false: not even --force has anything to give
};

std::string why_refused(const sh::RadialSamples& samples)
{
    if (!samples.centre_inside) return "its centroid lies outside it";
    if (samples.non_star_fraction > sh::non_star_refusal)
        return fmt::format("{:.1f} % of the directions from its centroid cross the surface more than once", 100 * samples.non_star_fraction);
    return {};
}

sh::FitErrors no_errors(double non_star_fraction)
{
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    return {unknown, unknown, unknown, unknown, unknown, unknown, non_star_fraction};
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
    if (std::ranges::find(samples.radii, 0.0) != samples.radii.end()) {
        f.refusal = "some directions from its centroid miss it";
        return f;
    }
    const sh::FitReference reference(grain.apparent);
    f.outer_excess = samples.outer_volume / reference.volume() - 1.0;
    // Low degrees of a long grain can have no positive radius: no surface, and no reason to stop the others.
    const auto evaluate = [&](int degree) {
        f.shape.surface = sh::fit(samples, degree, reference.volume());
        if (!f.refusal.empty()) f.shape.surface.method = envelope_method;
        const bool is_surface = sh::body_properties(f.shape.surface).smallest_radius > 0;
        f.shape.errors = is_surface ? reference.errors(f.shape.surface, samples) : no_errors(samples.non_star_fraction);
        return is_surface;
    };
    if (o.tolerance > 0 || !o.convergence.empty()) {
        std::optional<sh::ShapeRecord> chosen;
        bool is_surface = false;
        for (int degree = lowest_degree; degree <= bound; ++degree) {
            is_surface = evaluate(degree);
            f.by_degree.emplace_back(degree, f.shape.errors);
            if (o.tolerance > 0 && !chosen && f.shape.errors.rms_error <= o.tolerance) chosen = f.shape;
            if (chosen && o.convergence.empty()) break;
        }
        if (chosen) f.shape = *chosen;
        f.has_surface = chosen || is_surface;
        f.met = chosen || o.tolerance <= 0;
    } else {
        f.has_surface = evaluate(o.degree);
    }
    if (!f.has_surface) {
        f.refusal = fmt::format("degree {} gives a radius that is not positive", bound);
        return f;
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
    constexpr std::size_t listed = 5;
    std::string refused;
    std::size_t count = 0;
    for (const Fitted& f : fitted) {
        if (!f.refusal.empty()) {
            if (o.force && f.has_surface) spdlog::warn("grain {}: {}; fitted by its outer envelope, volume {:+.1f} % before scaling", f.shape.id, f.refusal, 100 * f.outer_excess);
            else if (o.skip) spdlog::warn("grain {}: {}; left out", f.shape.id, f.refusal);
            else if (++count <= listed) refused += fmt::format("{}grain {}: {}", refused.empty() ? "" : "; ", f.shape.id, f.refusal);
            continue;
        }
        if (f.shape.errors.non_star_fraction > sh::non_star_warning)
            spdlog::warn("grain {}: {:.1f} % of the directions cross its surface more than once; the outermost crossing is fitted", f.shape.id, 100 * f.shape.errors.non_star_fraction);
        if (!f.met) spdlog::warn("grain {}: RMS error {:.2f} % at degree {}, above the tolerance", f.shape.id, 100 * f.shape.errors.rms_error, f.shape.surface.degree);
    }
    if (count > 0)
        throw Error(o.input.filename().string(), fmt::format("not star-shaped: {}{}", refused, count > listed ? fmt::format(" and {} more", count - listed) : ""),
                    "no radius about one centre describes them: keep the level set, or take another degree, or --skip leaves them out, or --force fits the outer envelope where there is one");
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
                 "centroid_shift", "outer_volume_excess", "forced"}, {}};
    for (const Fitted& f : fitted) {
        std::vector<Cell> row = {static_cast<long long>(f.shape.id), static_cast<long long>(f.shape.surface.degree), f.shape.surface.method};
        for (Cell& cell : error_cells(f.shape.errors)) row.push_back(std::move(cell));
        row.insert(row.end(), {f.seconds, f.shape.errors.centroid_shift, f.outer_excess, static_cast<long long>(!f.refusal.empty())});
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
    json["forced"] = std::ranges::count_if(fitted, [](const Fitted& f) { return !f.refusal.empty(); });
    json["degree_lowest"] = fitted.empty() ? 0 : lowest;
    json["degree_highest"] = highest;
    json["rms_error_mean"] = rms;
    json["max_error"] = worst;
    json["area_error_mean"] = area;
    for (const Fitted& f : fitted)
        json["shapes"].push_back({{"id", f.shape.id}, {"degree", f.shape.surface.degree}, {"method", f.shape.surface.method}, {"rms_error", f.shape.errors.rms_error},
                                  {"max_error", f.shape.errors.max_error}, {"non_star_fraction", f.shape.errors.non_star_fraction}, {"seconds", f.seconds}});
    std::string human = fmt::format("{} grains", fitted.size());
    if (!fitted.empty())
        human += fmt::format(", degree {}\nRMS error {:.2f} % of the equivalent diameter ({:.3f} mm) in the mean, worst point {:.2f} %, area {:+.1f} % in the mean",
                             lowest == highest ? std::to_string(lowest) : fmt::format("{} to {}", lowest, highest), 100 * rms, millimetres, 100 * worst, 100 * area);
    cli::print_summary(context, json, human + "\n" + o.output.string() + "\n");
}

Table import_table(const sh::ImportedSet& set)
{
    Table table{{"id", "degree", "method", "rms_error", "max_error", "volume_error", "area_error", "inertia_error", "non_star_fraction", "seconds", "name", "volume",
                 "area", "published_volume", "published_area", "published_degree", "named_degree"}, {}};
    for (const sh::ImportedShape& s : set.shapes) {
        std::vector<Cell> row = {static_cast<long long>(s.record.id), static_cast<long long>(s.record.surface.degree), s.record.surface.method};
        for (Cell& cell : error_cells(s.record.errors)) row.push_back(std::move(cell));
        row.insert(row.end(), {0.0, s.name, s.record.volume, s.area, s.figures.volume, s.figures.area, static_cast<long long>(s.figures.degree),
                               static_cast<long long>(s.figures.named_degree)});
        table.add(std::move(row));
    }
    return table;
}

/// Says where a shape is not what was published, and why.
void warn_of_differences(const sh::ImportedSet& set)
{
    constexpr double worth_saying = 0.005;
    std::size_t other_area = 0;
    for (const sh::ImportedShape& s : set.shapes) {
        if (s.figures.degree != s.figures.named_degree)
            spdlog::warn("{}: the published figures are those of degree {}, not of the {} that the table names", s.name, s.figures.degree, s.figures.named_degree);
        if (s.record.surface.method == "ellipsoid") {
            other_area += std::abs(s.record.errors.area_error) > worth_saying;
            continue;
        }
        if (std::abs(s.record.errors.volume_error) > worth_saying || std::abs(s.record.errors.area_error) > worth_saying)
            spdlog::warn("{}: volume {:+.2f} %, area {:+.2f} % against the published figures, which are of degree {}; here it is {}", s.name,
                         100 * s.record.errors.volume_error, 100 * s.record.errors.area_error, s.figures.degree, s.record.surface.degree);
    }
    if (other_area) spdlog::warn("{} ellipsoids have another area than published: that one is of the voxel surface, with its steps and inner walls", other_area);
    if (set.left_out) spdlog::warn("{} rows left out: no volume or no axes", set.left_out);
    if (set.too_slender) spdlog::warn("{} rows left out: too slender for this degree; --degree takes a higher one", set.too_slender);
    for (const std::string& name : set.without_unit) spdlog::warn("{}: left out, no table names it and its unit is not known; --unit gives it", name);
}

void summarise_import(const sh::ImportedSet& set, const Options& o, const cli::Context& context)
{
    double volume = 0, area = 0;
    int lowest = 1000, highest = 0;
    std::size_t compared = 0;
    nlohmann::ordered_json shapes;
    for (const sh::ImportedShape& s : set.shapes) {
        const sh::FitErrors& e = s.record.errors;
        lowest = std::min(lowest, s.record.surface.degree);
        highest = std::max(highest, s.record.surface.degree);
        compared += std::isfinite(e.volume_error);
        if (std::abs(e.volume_error) > volume) volume = std::abs(e.volume_error);
        if (s.record.surface.method != "ellipsoid" && std::abs(e.area_error) > area) area = std::abs(e.area_error);  // see warn_of_differences
        shapes.push_back({{"id", s.record.id}, {"name", s.name}, {"degree", s.record.surface.degree}, {"volume", s.record.volume}, {"area", s.area},
                          {"equivalent_diameter", s.record.equivalent_diameter}, {"volume_error", e.volume_error}, {"area_error", e.area_error}});
    }
    nlohmann::ordered_json json = {{"output", o.output.filename().string()}, {"shapes_imported", set.shapes.size()}, {"left_out", set.left_out + set.too_slender + set.without_unit.size()},
                                   {"degree_lowest", lowest}, {"degree_highest", highest}, {"compared", compared}, {"volume_error", volume}, {"area_error", area}};
    json["shapes"] = shapes;
    std::string human = fmt::format("{} shapes, degree {}\n", set.shapes.size(), lowest == highest ? std::to_string(lowest) : fmt::format("{} to {}", lowest, highest));
    if (compared) human += fmt::format("{} compared with their published figures: volume within {:.2g} %{}\n", compared, 100 * volume, area > 0 ? fmt::format(", area within {:.2g} %", 100 * area) : "");
    cli::print_summary(context, json, human + o.output.string() + "\n");
}

/// Before any work: the folders are there and writable.
void check_outputs(const Options& o)
{
    for (const std::filesystem::path& file : {o.output, o.table, o.convergence})
        if (!file.empty()) OutputFile{file};
}

void run_import(const Options& o, bool degree_given, const cli::Context& context)
{
    if (o.tolerance > 0 || !o.convergence.empty() || o.force || o.skip) throw UsageError("--import", "there is nothing to fit", "leave out --tolerance, --convergence, --force and --skip");
    if (o.unit < 0 || o.scale_to < 0) throw UsageError("--unit, --scale-to", "must be lengths greater than zero");
    check_outputs(o);
    const sh::ImportedSet set = sh::import_shapes(o.import, {o.unit, o.scale_to, degree_given ? o.degree : 0});
    warn_of_differences(set);
    RecordEntry record = context.record;
    record.options.erase("import");  // the inputs name the files, without their folders
    record.options.erase("tolerance");
    if (o.unit == 0) record.options.erase("unit");
    if (o.scale_to == 0) record.options.erase("scale-to");
    if (!degree_given) record.options.erase("degree");
    for (const std::filesystem::path& file : o.import) record.inputs.push_back(file.lexically_normal().filename().string());
    std::vector<sh::ShapeRecord> shapes;
    for (const sh::ImportedShape& s : set.shapes) shapes.push_back(s.record);
    sh::write_shapes(o.output, shapes, {record});
    if (!o.table.empty()) import_table(set).write(o.table);
    summarise_import(set, o, context);
}

void run(const Options& o, const cli::Context& context)
{
    if (o.unit != 0 || o.scale_to != 0) throw UsageError("--unit, --scale-to", "belong to --import", "level sets have their size");
    if (o.force && o.skip) throw UsageError("--force, --skip", "exclude each other");
    if (o.tolerance < 0 || o.tolerance >= 1) throw UsageError("--tolerance", "must lie between 0 and 1", "2% is a usual value");
    check_outputs(o);
    const sdf::GrainReader reader(o.input);
    std::vector<Fitted> fitted = fit_all(reader, o);
    const std::size_t left_out = sort_out(fitted, o);
    if (fitted.empty()) spdlog::warn("{}: no grain to fit", o.input.filename().string());

    History history = reader.history();
    RecordEntry record = context.record;
    for (const char* of_import : {"import", "unit", "scale-to"}) record.options.erase(of_import);
    history.push_back(record);
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
    Given given;
    return cli::run_tool(
        argc, argv, "ls2sh", "Level sets of grains, or published shapes, to spherical harmonics",
        [&](cli::Options& declared) { given = declare(declared, o); },
        [&](const cli::Context& context) {
            o.degree_given = given.degree.given();
            if (given.input.given() == !o.import.empty()) throw UsageError("input", "give the level sets of csct2ls, or --import with published files");
            if (o.import.empty()) run(o, context);
            else run_import(o, o.degree_given, context);
        });
}
