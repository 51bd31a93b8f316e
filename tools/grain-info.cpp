// grain-info: what a file of the chain holds, read in full by the reader that the next tool would use.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "cli.h"
#include "core/error.h"
#include "core/hdf5.h"
#include "core/table.h"
#include "core/text.h"
#include "core/version.h"
#include "morph/stack_io.h"
#include "pack/sample.h"
#include "sdf/vdb_io.h"
#include "sh/shape_file.h"
#include "suffusion/case_file.h"
#include "suffusion/checkpoint.h"
#include "suffusion/results.h"

using namespace coral;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

constexpr std::size_t lines_shown = 12;  // of a list in the human form; --json has all

std::string metres(double value) { return format_quantity(value, Dimension::length); }
std::string percent(double value) { return fmt::format("{:.2f} %", 100 * value); }

/// What is told of a file: each fact for people and for programs.
class Report {
public:
    explicit Report(const std::string& kind)
    {
        json_["kind"] = kind;
        text_ = "  " + kind + "\n";
    }
    void add(const std::string& key, Json value, const std::string& human)
    {
        json_[key] = std::move(value);
        text_ += fmt::format("  {:<24} {}\n", key, human);
    }
    void add(const std::string& key, const std::string& value) { add(key, value, value); }
    void add(const std::string& key, std::size_t value) { add(key, value, std::to_string(value)); }
    void length(const std::string& key, double value) { add(key, value, metres(value)); }
    void share(const std::string& key, double value) { add(key, value, percent(value)); }
    /// Smallest, median and largest of lengths.
    void lengths(const std::string& key, std::vector<double> values)
    {
        if (values.empty()) return;
        std::ranges::sort(values);
        const double low = values.front(), middle = values[values.size() / 2], high = values.back();
        add(key, {low, middle, high}, fmt::format("{} to {}, median {}", metres(low), metres(high), metres(middle)));
    }
    /// One line an entry for people, the whole list for programs.
    void list(const std::string& key, const Json& values, const std::vector<std::string>& lines)
    {
        json_[key] = values;
        text_ += fmt::format("  {} ({})\n", key, lines.size());
        for (std::size_t n = 0; n < std::min(lines.size(), lines_shown); ++n) text_ += "    " + lines[n] + "\n";
        if (lines.size() > lines_shown) text_ += fmt::format("    and {} more (--json lists all)\n", lines.size() - lines_shown);
    }
    void history(const History& history)
    {
        std::vector<std::string> lines;
        for (const RecordEntry& step : history) {
            std::string options, inputs;
            for (const auto& [name, value] : step.options) options += fmt::format(" {}={}", name, value);
            for (std::size_t n = 0; n < std::min<std::size_t>(step.inputs.size(), 4); ++n) inputs += " " + step.inputs[n];
            if (step.inputs.size() > 4) inputs += fmt::format(" and {} more", step.inputs.size() - 4);
            lines.push_back(fmt::format("{} {}{}{}", step.tool, step.version, inputs, options));
        }
        list("history", Json::parse(to_json(history)), lines);
    }
    const Json& json() const { return json_; }
    const std::string& text() const { return text_; }

private:
    Json json_;
    std::string text_;
};

/// Numbers of a version, "0.1.0" -> 0, 1, 0.
std::vector<int> version_numbers(const std::string& text)
{
    std::vector<int> numbers;
    for (const std::string& part : split(text, '.')) numbers.push_back(std::atoi(part.c_str()));
    return numbers;
}

/// \throws Error when a step of the history was made by a later version than this program's
void refuse_newer(const History& history, const fs::path& file)
{
    for (const RecordEntry& step : history)
        if (version_numbers(step.version) > version_numbers(version))
            throw Error(file.string(), fmt::format("was made by {} {}, newer than this {}", step.tool, step.version, version), "use that version of the tools");
}

Report describe_grains(const fs::path& file)
{
    const sdf::GrainReader reader(file);
    refuse_newer(reader.history(), file);
    Report report("level sets of grains (csct2ls)");
    report.add("grains", reader.ids().size());
    std::vector<double> diameters, porosities, spacings;
    std::vector<std::string> lines;
    double volume = 0, apparent = 0, inside = 0, outside = 0;
    Json grains = Json::array();
    for (const int id : reader.ids()) {
        const sdf::GrainLevelSet grain = reader.read(id);
        diameters.push_back(grain.equivalent_diameter);
        spacings.push_back(grain.solid.spacing);
        volume += grain.volume;
        apparent += grain.apparent_volume;
        inside = std::max(inside, grain.solid.inside_limit / grain.solid.spacing);
        outside = std::max(outside, grain.solid.outside_limit / grain.solid.spacing);
        const Eigen::Vector3i& size = grain.solid.size;
        grains.push_back({{"id", id}, {"label", grain.label}, {"equivalent_diameter", grain.equivalent_diameter}, {"volume", grain.volume},
                          {"intraparticle_porosity", grain.intraparticle_porosity}, {"nodes", {size.x(), size.y(), size.z()}}});
        lines.push_back(fmt::format("grain_{}: {} wide, porosity {}, {} x {} x {} nodes", id, metres(grain.equivalent_diameter), percent(grain.intraparticle_porosity), size.x(), size.y(), size.z()));
    }
    report.lengths("spacing", spacings);
    report.add("band", {inside, outside}, fmt::format("{:.3g} nodes inside, {:.3g} outside", inside, outside));
    report.lengths("equivalent_diameter", diameters);
    if (apparent > 0) report.share("intraparticle_porosity", 1 - volume / apparent);
    report.list("each", grains, lines);
    report.history(reader.history());
    return report;
}

/// A number that JSON can hold: null for NaN.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Report describe_shapes(const fs::path& file)
{
    const sh::ShapeFile shapes = sh::read_shapes(file);
    refuse_newer(shapes.history, file);
    Report report("spherical-harmonic shapes (ls2sh)");
    report.add("shapes", shapes.shapes.size());
    std::vector<double> diameters;
    std::vector<std::string> lines;
    std::set<std::string> methods;
    int lowest = 1000, highest = 0;
    Json each = Json::array();
    for (const sh::ShapeRecord& s : shapes.shapes) {
        diameters.push_back(s.equivalent_diameter);
        methods.insert(s.surface.method);
        lowest = std::min(lowest, s.surface.degree);
        highest = std::max(highest, s.surface.degree);
        each.push_back({{"id", s.id}, {"name", s.name}, {"degree", s.surface.degree}, {"method", s.surface.method}, {"equivalent_diameter", s.equivalent_diameter}, {"volume", s.volume},
                        {"rms_error", number(s.errors.rms_error)}, {"max_error", number(s.errors.max_error)}, {"non_star_fraction", number(s.errors.non_star_fraction)}});
        lines.push_back(fmt::format("{}{}: {} wide, degree {}, {}{}", s.id, s.name.empty() ? "" : " " + s.name, metres(s.equivalent_diameter), s.surface.degree, s.surface.method,
                                    std::isfinite(s.errors.rms_error) ? fmt::format(", RMS error {}, worst {}", percent(s.errors.rms_error), percent(s.errors.max_error)) : ""));
    }
    std::string all;
    for (const std::string& method : methods) all += (all.empty() ? "" : ", ") + method;
    if (!shapes.shapes.empty()) report.add("degree", {lowest, highest}, lowest == highest ? std::to_string(lowest) : fmt::format("{} to {}", lowest, highest));
    report.add("method", all);
    report.lengths("equivalent_diameter", diameters);
    report.list("each", each, lines);
    report.history(shapes.history);
    return report;
}

Report describe_sample(const fs::path& file)
{
    const pack::Sample sample = pack::read_sample(file);
    refuse_newer(sample.history, file);
    Report report("packed sample (pack-sample)");
    std::vector<double> coarse, fine;
    for (const pack::Particle& p : sample.particles) (p.role == pack::Role::fine ? fine : coarse).push_back(pack::equivalent_diameter(sample, p));
    report.add("bodies", sample.particles.size(), fmt::format("{} coarse, {} fine", coarse.size(), fine.size()));
    report.add("size", {sample.size.x(), sample.size.y(), sample.size.z()}, fmt::format("{} x {} x {}", metres(sample.size.x()), metres(sample.size.y()), metres(sample.size.z())));
    report.lengths("coarse_diameter", coarse);
    report.lengths("fine_diameter", fine);
    report.share("porosity", sample.statistics.porosity);
    report.share("interparticle_porosity", sample.statistics.interparticle_porosity);
    if (!fine.empty()) report.share("fines_content", sample.statistics.fines_content);
    report.add("contacts", sample.contacts.size());
    Json templates = Json::array(), criteria = Json::array();
    std::vector<std::string> shapes, verdicts;
    for (const pack::ShapeTemplate& s : sample.shapes) {
        templates.push_back({{"kind", pack::to_string(s.kind)}, {"name", s.name}, {"equivalent_diameter", s.equivalent_diameter}, {"nodes", s.nodes.size()}});
        shapes.push_back(fmt::format("{}: {}, {} surface nodes", pack::to_string(s.kind), s.name, s.nodes.size()));
    }
    for (const pack::Criterion& c : sample.criteria) {
        criteria.push_back({{"name", c.name}, {"value", number(c.value)}, {"threshold", c.threshold}, {"verdict", c.verdict}});
        verdicts.push_back(fmt::format("{}: {} ({:.4g} against {:.4g})", c.name, c.verdict, c.value, c.threshold));
    }
    report.list("shapes", templates, shapes);
    report.list("criteria", criteria, verdicts);
    report.history(sample.history);
    return report;
}

Report describe_results(const fs::path& file)
{
    const suffusion::Results results = suffusion::read_results(file);
    const History history = history_from_json(results.history, file.string());
    refuse_newer(history, file);
    Report report("results of a run (suffuse)");
    const std::size_t rows = results.rows();
    report.add("rows", rows);
    if (rows > 0) report.add("time", results.series.front().values[rows - 1], format_quantity(results.series.front().values[rows - 1], Dimension::time));
    report.add("tracked_bodies", results.tracked.size());
    report.add("fines", results.fines.size());
    Json last = Json::object();
    std::vector<std::string> lines;
    for (const suffusion::Column& c : results.series) {
        if (rows == 0 || c.values.size() < rows * c.width) continue;
        std::string text;
        Json numbers = Json::array();
        for (std::size_t k = 0; k < c.width; ++k) {
            const double value = c.values[(rows - 1) * c.width + k];
            numbers.push_back(number(value));
            text += fmt::format(" {:.6g}", value);
        }
        last[c.name] = {{"unit", c.unit}, {"last", numbers}};
        lines.push_back(fmt::format("{} [{}], last:{}", c.name, c.unit, text));
    }
    report.list("series", last, lines);
    report.history(history);
    return report;
}

Report describe_checkpoint(const fs::path& file)
{
    const H5File head = H5File::open(file);
    if (head.number_attribute("/", "format_version") > 1) throw Error(file.string(), "is a checkpoint of a newer version", "use the version of the tools that wrote it");
    const suffusion::Checkpoint c = suffusion::read_checkpoint(file);
    Report report("checkpoint of a run (suffuse)");
    report.add("time", c.time, format_quantity(c.time, Dimension::time));
    report.add("rows", c.rows);
    report.add("frames", c.frames);
    report.add("cells", c.cells);
    report.add("bodies", c.bodies);
    report.add("state_bytes", c.simulation.size() + c.observer.size());
    return report;
}

Report describe_hdf5(const fs::path& file)
{
    const H5File h5 = H5File::open(file);
    if (h5.has_attribute("/", "content") && h5.string_attribute("/", "content") == "coralsand harmonic shapes") return describe_shapes(file);
    if (h5.has_attribute("/", "format") && h5.exists("/particles")) return describe_sample(file);
    if (h5.has_attribute("/", "format_version") && h5.exists("/simulation")) return describe_checkpoint(file);
    if (h5.exists("/series/time")) return describe_results(file);
    throw Error(file.string(), "is an HDF5 file, but none of ours", "for a stack write FILE:/dataset");
}

Report describe_case(const fs::path& path)
try {
    const suffusion::Case c = suffusion::read_case(path);
    Report report("case (make-case, suffuse)");
    if (c.sample) report.add("sample", c.sample->filename().string());
    if (c.domain) {
        report.add("domain", {c.domain->size.x(), c.domain->size.y(), c.domain->size.z()}, fmt::format("{} x {} x {}", metres(c.domain->size.x()), metres(c.domain->size.y()), metres(c.domain->size.z())));
        if (c.fluid) report.add("cells", {c.domain->cells.x(), c.domain->cells.y(), c.domain->cells.z()}, fmt::format("{} x {} x {} of {}", c.domain->cells.x(), c.domain->cells.y(), c.domain->cells.z(), metres(c.domain->cell)));
    }
    report.add("fluid", c.fluid.has_value(), c.fluid ? fmt::format("{:g} kg/m3, {:g} m2/s", c.fluid->density, c.fluid->kinematic_viscosity) : "none (dry)");
    report.add("bodies", c.bodies.size(), fmt::format("{}{}", c.bodies.size(), c.sample ? " besides those of the sample" : ""));
    report.add("walls", c.walls.size());
    report.add("duration", c.time.duration, format_quantity(c.time.duration, Dimension::time));
    for (const char* part : {"results.h5", "checkpoint.h5"})
        if (const bool there = fs::exists(c.folder / part); there) report.add(part, there, "present: grain-info " + (c.folder / part).string());
    return report;
} catch (const UsageError& error) {
    // A case with errors is bad input here, not a bad command line; the first error of several makes one line.
    const std::string text = error.what();
    const auto more = std::ranges::count(text, '\n');
    throw Error("", text.substr(0, text.find('\n')) + (more > 0 ? fmt::format(" (and {} more)", more) : ""));
}

/// Tables of ours by columns they start with, and who writes them.
struct KnownTable {
    const char* beginning;
    const char* kind;
};
constexpr KnownTable known_tables[] = {
    {"id,label,voxels,volume", "table of grains (csct2ls --table)"},
    {"id,degree,method,rms_error,max_error,volume_error,area_error,inertia_error,non_star_fraction,seconds", "table of harmonic shapes (ls2sh --table)"},
    {"id,degree,method,rms_error", "errors by degree (ls2sh --convergence)"},
    {"id,void,volume", "table of voids (csct2ls --voids)"},
    {"case,time", "series of cases (erosion-report)"},
    {"label,kind,volume,apparent_volume", "true figures of a made sample (make-sample-ct)"},
};

Report describe_table(const fs::path& file)
{
    const Table table = read_table(file);
    std::string columns;
    for (const std::string& name : table.columns) columns += name + ",";
    const auto known = std::ranges::find_if(known_tables, [&](const KnownTable& k) { return columns.starts_with(k.beginning); });
    if (known == std::end(known_tables)) throw Error(file.string(), "is a table, but none of ours (its columns: " + columns.substr(0, std::min<std::size_t>(columns.size() - 1, 60)) + ")");
    Report report(known->kind);
    report.add("rows", table.rows.size());
    Json ranges = Json::object();
    std::vector<std::string> lines;
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
        std::vector<double> values;
        for (const auto& row : table.rows)
            if (const double* value = std::get_if<double>(&row[c]); value && std::isfinite(*value)) values.push_back(*value);
        std::ranges::sort(values);
        if (values.empty()) {
            ranges[table.columns[c]] = nullptr;
            lines.push_back(table.columns[c]);
            continue;
        }
        ranges[table.columns[c]] = {values.front(), values[values.size() / 2], values.back()};
        lines.push_back(fmt::format("{}: {:.6g} to {:.6g}, median {:.6g}", table.columns[c], values.front(), values.back(), values[values.size() / 2]));
    }
    report.list("columns", ranges, lines);
    return report;
}

Report describe_stack(const std::string& path)
{
    const morph::VoxelStack stack = morph::read_stack(std::vector{path});
    Report report("stack of voxels");
    report.add("size", {stack.size.x(), stack.size.y(), stack.size.z()}, fmt::format("{} x {} x {} voxels (x, y, z)", stack.size.x(), stack.size.y(), stack.size.z()));
    const Eigen::Vector3d& edge = stack.voxel_size;
    if (edge.minCoeff() > 0) report.add("voxel_size", {edge.x(), edge.y(), edge.z()}, fmt::format("{} x {} x {}", metres(edge.x()), metres(edge.y()), metres(edge.z())));
    else report.add("voxel_size", nullptr, "not in the file: give --voxel-size to csct2ls");
    if (!stack.reals.empty()) {
        const auto [low, high] = std::ranges::minmax(stack.reals);
        report.add("values", {low, high}, fmt::format("real grey values from {:g} to {:g}", low, high));
        return report;
    }
    constexpr std::size_t most = 1000;  // more are grey values or many grains: the number does not matter
    std::set<std::uint32_t> distinct;
    for (const std::uint32_t value : stack.values)
        if (distinct.size() <= most) distinct.insert(value);
    const std::uint32_t largest = stack.values.largest();
    report.add("type", largest < 256 ? "whole numbers, 8 bits hold them" : largest < 65536 ? "whole numbers, 16 bits hold them" : "whole numbers, 32 bits hold them");
    report.add("largest_value", std::size_t(largest));
    report.add("distinct_values", distinct.size(), distinct.size() > most ? fmt::format("more than {}", most) : std::to_string(distinct.size()));
    return report;
}

/// Whether a folder or a file is a case, by name.
bool is_case(const fs::path& path) { return fs::is_directory(path) ? fs::exists(path / "case.toml") : path.extension() == ".toml"; }

Report describe(const std::string& name)
{
    const fs::path path = name;
    if (!fs::exists(path)) return describe_stack(name);  // "file.h5:/dataset", or no such file
    if (is_case(path)) return describe_case(path);
    if (fs::is_directory(path)) return describe_stack(name);
    if (fs::file_size(path) == 0) throw Error(name, "is empty");
    const std::string extension = path.extension().string();
    if (extension == ".vdb") return describe_grains(path);
    if (extension == ".csv") return describe_table(path);
    std::string magic(8, '\0');
    std::ifstream(path, std::ios::binary).read(magic.data(), 8);
    if (magic == "\x89HDF\r\n\x1a\n" || extension == ".h5") return describe_hdf5(path);
    try {
        return describe_stack(name);
    } catch (const UsageError&) {
        throw Error(name, "is no file of ours and no stack", "known are .vdb, .h5, .csv, case.toml, case folders and stacks (.tif, .nrrd, .mhd, .mha, folders of slices)");
    }
}

void run(const std::vector<std::string>& files, const cli::Context& context)
{
    Json all = Json::array();
    std::string text;
    for (const std::string& file : files) {
        Report report = [&] {
            try {
                return describe(file);
            } catch (const UsageError& error) {
                throw Error("", error.what());  // the file is wrong, not the command line
            }
        }();
        Json json = {{"file", fs::path(file).lexically_normal().string()}};
        json.update(report.json());
        all.push_back(std::move(json));
        text += file + "\n" + report.text();
    }
    cli::print_summary(context, {{"files", all}}, text);
}

}  // namespace

int main(int argc, char** argv)
{
    std::vector<std::string> files;
    return cli::run_tool(
        argc, argv, "grain-info", "What a file of the chain holds",
        [&](cli::Options& options) { options.add("files", files, "Files: .vdb, .sh.h5, sample.h5, results.h5, checkpoint.h5, case folder or case.toml, tables, stacks").required(); },
        [&](const cli::Context& context) { run(files, context); });
}
