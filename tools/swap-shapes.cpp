// swap-shapes: sample.h5 with other shapes for its grains, overlaps relaxed, centres kept.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>

#include "cli.h"
#include "core/error.h"
#include "pack/picture.h"
#include "pack/swap.h"

using namespace coral;

namespace {

constexpr int picture_pixels = 1400;

struct Options {
    std::filesystem::path input, output, figure;
    std::string coarse = "keep", fine = "keep", keep = "volume";
    pack::SwapOptions swap;
};

void declare(cli::Options& options, Options& o)
{
    options.add("input", o.input, "Sample, .h5").required();
    options.add("-o,--output", o.output, "Sample with the new shapes, .h5").required();
    options.add("--coarse", o.coarse, "What coarse grains become; level-set needs --library grains.vdb").one_of({"keep", "level-set", "sh", "sphere", "polyhedron"});
    options.add("--fine", o.fine, "What fine grains become; spheres turn into shapes drawn from the library, turned at random")
        .one_of({"keep", "sphere", "polyhedron", "sh"});
    options.add("--library", o.swap.library, "Shapes, .sh.h5 or .vdb; without it those of the sample's own coarse grains").existing_file();
    options.add("--keep", o.keep, "What each grain keeps: its apparent volume (voids filled), or its mass").one_of({"volume", "mass"});
    options.add("--degree", o.swap.degree, "Degree of harmonics that are fitted here").between(2, 30);
    options.add("--faces", o.swap.faces, "Faces of a polyhedron, at most").between(12, 60);
    options.add("--nodes", o.swap.fine_nodes, "Contact nodes on a fine grain with a new shape").between(100, 20000);
    options.flag("--drop-trapped", o.swap.drop_trapped, "Take out fines that a filled void covers, and those that find no place; else the former are moved to its surface");
    options.add("--limit", o.swap.limit, "Largest displacement of a coarse grain, and mean one of the fines, over the diameter").not_negative();
    options.add("--overlap-limit", o.swap.overlap_limit, "Largest overlap that may stay, over the smaller diameter; 0: twice the deepest of the sample, at least 5 %").not_negative();
    options.add("--figure", o.figure, "Picture of the sample, cut open, .png");
    options.flag("--restore-pressure", o.swap.restore_pressure, "Move the walls until each pair has the pressure it had");
    options.add("--steps", o.swap.max_steps, "Longest damped run [steps]").between(0, 10000000);
}

std::optional<pack::ShapeKind> kind_of(const std::string& word)
{
    for (const auto kind : {pack::ShapeKind::sphere, pack::ShapeKind::level_set, pack::ShapeKind::sh, pack::ShapeKind::polyhedron})
        if (pack::to_string(kind) == word) return kind;
    return {};
}

nlohmann::ordered_json to_json(const pack::Overlaps& o) { return {{"contacts", o.contacts}, {"deep", o.deep}, {"largest", o.largest}}; }
nlohmann::ordered_json to_json(const pack::Displacement& d) { return {{"grains", d.grains}, {"mean", d.mean}, {"median", d.median}, {"largest", d.largest}}; }

nlohmann::ordered_json to_json(const pack::Sample& sample, const pack::SwapReport& r, const Options& o)
{
    nlohmann::ordered_json json;
    json["particles"] = sample.particles.size();
    json["swapped_coarse"] = r.swapped_coarse;
    json["swapped_fine"] = r.swapped_fine;
    json["new_shapes"] = r.new_shapes;
    if (r.largest_faces > 0) json["faces"] = {r.smallest_faces, r.largest_faces};
    json["kept"] = o.keep;
    json["mass_before"] = r.mass_before;
    json["mass_after"] = r.mass_after;
    json["displacement"] = {{"coarse", to_json(r.coarse)}, {"fine", to_json(r.fine)}, {"loaded_fine", to_json(r.loaded_fine)}};
    json["strain"] = {r.strain.x(), r.strain.y(), r.strain.z()};
    json["pushed_fines"] = r.pushed_fines;
    json["trapped"] = r.trapped;
    json["wedged"] = r.wedged;
    json["trapped_dropped"] = o.swap.drop_trapped;
    json["overlaps"] = {{"before", to_json(r.before)}, {"swapped", to_json(r.swapped)}, {"after", to_json(r.after)}};
    json["springs"] = {{"before", r.springs_before}, {"kept", r.springs_kept}, {"after", sample.springs.size()}};
    json["pressure_before"] = r.pressure_before;
    json["pressure_after"] = r.pressure_after;
    json["unchanged"] = r.unchanged;
    json["relaxed"] = r.relaxed;
    json["iterations"] = r.iterations;
    json["steps"] = r.steps;
    json["kinetic_energy"] = r.kinetic_energy;
    json["unbalanced_ratio"] = r.unbalanced_ratio;
    json["porosity"] = sample.statistics.porosity;
    for (const auto& c : sample.criteria) json["criteria"][c.name] = c.verdict;
    json["seconds"] = {{"shapes", r.shapes_seconds}, {"relaxation", r.relaxation_seconds}};
    json["warnings"] = r.warnings;
    return json;
}

std::string to_text(const pack::Sample& sample, const pack::SwapReport& r, const Options& o)
{
    std::string text = fmt::format("{}: {} coarse and {} fine grains with new shapes\n", o.output.filename().string(), r.swapped_coarse, r.swapped_fine);
    const auto line = [&](const char* name, const std::string& value) { text += fmt::format("  {:32} {}\n", name, value); };
    const auto percent = [](double share) { return fmt::format("{:.3g} %", 100 * share); };
    line("kept", fmt::format("centres, orientations and {}; the mass of all grains changes by {:+.2f} %", o.keep == "mass" ? "masses" : "apparent volumes",
                             100 * (r.mass_after / r.mass_before - 1)));
    if (r.largest_faces > 0) line("faces of polyhedra", fmt::format("{} to {}", r.smallest_faces, r.largest_faces));
    const auto moved = [&](const pack::Displacement& d) { return fmt::format("mean {}, median {}, largest {} ({} grains)", percent(d.mean), percent(d.median), percent(d.largest), d.grains); };
    line("displacement of coarse over d", moved(r.coarse));
    line("displacement of fines over d", fmt::format("{}, {} above the limit", moved(r.fine), r.pushed_fines));
    line("  of those that carried load", moved(r.loaded_fine));
    if (!r.strain.isZero()) line("strain of the box", fmt::format("{} {} {}", percent(r.strain.x()), percent(r.strain.y()), percent(r.strain.z())));
    line("fines in filled voids", r.trapped.empty() ? "none" : fmt::format("{}, {}: grains {}", r.trapped.size(), o.swap.drop_trapped ? "taken out" : "moved to the surface", fmt::join(r.trapped, " ")));
    if (!r.wedged.empty()) line("fines without a place", fmt::format("{}, taken out: grains {}", r.wedged.size(), fmt::join(r.wedged, " ")));
    const auto overlaps = [&](const char* name, const pack::Overlaps& v) {
        line(name, fmt::format("{} contacts, {} deeper than 1 % of d, largest {}", v.contacts, v.deep, percent(v.largest)));
    };
    overlaps("overlaps before the swap", r.before);
    overlaps("after it", r.swapped);
    overlaps("relaxed", r.after);
    line("friction springs", fmt::format("{} before, {} kept by the new shapes, {} at the end", r.springs_before, r.springs_kept, sample.springs.size()));
    line("mean pressure on the walls", fmt::format("{} before, {} now", format_quantity(r.pressure_before, Dimension::pressure), format_quantity(r.pressure_after, Dimension::pressure)));
    line("kinetic energy at the end", fmt::format("{:.2e} J", r.kinetic_energy));
    line("unbalanced-force ratio", fmt::format("{:.2e}{}", r.unbalanced_ratio, r.unchanged ? ", contact forces as before: nothing to relax" : ""));
    for (const auto& c : sample.criteria) line(c.name.c_str(), fmt::format("{:.3f}  {}", c.value, c.verdict));
    line("time", fmt::format("{:.1f} s for {} new shapes, {:.1f} s for {} iterations and {} steps", r.shapes_seconds, r.new_shapes, r.relaxation_seconds, r.iterations, r.steps));
    return text;
}

void run(Options& o, const cli::Context& context, std::uint64_t seed)
{
    if (!std::filesystem::exists(o.input)) throw UsageError(o.input.string(), "does not exist", "make it with pack-sample");
    if (!std::filesystem::is_directory(o.output.has_parent_path() ? o.output.parent_path() : "."))
        throw UsageError(o.output.string(), "its folder does not exist", "make the folder first");
    if (!o.figure.empty()) pack::check_png(o.figure);
    if (!o.swap.library.empty() && o.coarse == "keep" && o.fine == "keep")
        throw UsageError("--library", "is given, but all grains keep their shapes", "say with --coarse or --fine what they become");
    o.swap.coarse = kind_of(o.coarse);
    o.swap.fine = kind_of(o.fine);
    o.swap.keep_mass = o.keep == "mass";
    const pack::Sample before = pack::read_sample(o.input);
    pack::SwapReport report;
    pack::Sample sample = pack::swap_shapes(before, o.swap, seed, report);
    RecordEntry entry = context.record;
    if (!o.swap.library.empty()) entry.options["library"] = o.swap.library.filename().string();  // no folders in a history
    entry.options.erase("figure");  // makes no difference to the sample
    sample.history.push_back(std::move(entry));
    pack::write_sample(sample, o.output);
    if (!o.figure.empty()) pack::write_png(pack::draw_sample(sample, picture_pixels), o.figure);
    for (const std::string& warning : report.warnings) spdlog::warn("{}", warning);
    cli::print_summary(context, to_json(sample, report, o), to_text(sample, report, o));
}

}  // namespace

int main(int argc, char** argv)
{
    Options options;
    std::uint64_t seed = 1;
    return cli::run_tool(
        argc, argv, "swap-shapes", "Give the grains of a packed sample other shapes in place", [&](coral::cli::Options& declared) { declare(declared, options); },
        [&](const cli::Context& context) { run(options, context, seed); }, &seed);
}
