// pack-sample: specification of a packing -> sample.h5, a settled and compressed gap-graded sample.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <filesystem>

#include "cli.h"
#include "core/error.h"
#include "core/output_file.h"
#include "core/text.h"
#include "pack-sample/psd_figure.h"
#include "pack/pack.h"
#include "pack/picture.h"

using namespace coral;

namespace {

constexpr int picture_pixels = 1400;

struct Options {
    std::filesystem::path input, output, grains, psd_figure, figure;
    double scale = 1, checkpoint_every = 300;
    bool resume = false;
};

void declare(cli::Options& options, Options& o)
{
    options.add("input", o.input, "Specification of the packing, .toml (keys: docs/pack-spec.md)").required();
    options.add("-o,--output", o.output, "Sample, .h5").required();
    options.add("--grains", o.grains, "Level-set grains, .vdb, in place of the files that the specification names").existing_file();
    options.add("--scale", o.scale, "Factor on the lengths of shapes that keep the size of their file [-]");
    options.add("--psd-figure", o.psd_figure, "Picture of the gradation, .png or .svg (needs gnuplot)");
    options.add("--figure", o.figure, "Picture of the sample, cut open, .png");
    options.flag("--resume", o.resume, "Go on from <output>.checkpoint, which a stopped or killed run leaves");
    options.quantity("--checkpoint-every", o.checkpoint_every, Dimension::time, "Wall time between checkpoints");
}

/// JSON has no NaN: what does not exist is null.
nlohmann::ordered_json number(double value) { return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr); }

/// Wall time of each phase, all parts of a resumed packing together.
nlohmann::ordered_json seconds_of(const pack::PackReport& r)
{
    return {{"loading", r.loading_seconds}, {"pouring", r.pouring_seconds}, {"compression", r.compression_seconds}, {"relaxation", r.relaxation_seconds}};
}

nlohmann::ordered_json to_json(const pack::Sample& sample, const pack::PackReport& report)
{
    const pack::Statistics& s = sample.statistics;
    nlohmann::ordered_json json;
    json["particles"] = sample.particles.size();
    std::size_t fines = 0;
    for (const auto& p : sample.particles) fines += p.role == pack::Role::fine;
    json["coarse"] = sample.particles.size() - fines;
    json["fine"] = fines;
    json["size"] = {sample.size.x(), sample.size.y(), sample.size.z()};
    if (const pack::Wall* side = pack::cylinder(sample)) json["diameter"] = 2 * side->radius;
    if (!sample.period.isZero(0)) json["period"] = {sample.period.x(), sample.period.y(), sample.period.z()};
    json["porosity"] = s.porosity;
    json["interparticle_porosity"] = s.interparticle_porosity;
    json["void_ratio"] = s.void_ratio;
    json["interparticle_void_ratio"] = s.interparticle_void_ratio;
    if (std::isfinite(report.relative_density)) json["relative_density"] = report.relative_density;
    json["fines_content"] = s.fines_content;
    json["gap_ratio"] = number(s.gap_ratio);
    json["coordination"] = s.coordination;
    json["coordination_coarse_coarse"] = number(s.coordination_coarse_coarse);
    json["coordination_coarse_fine"] = number(s.coordination_coarse_fine);
    json["coordination_fine_coarse"] = number(s.coordination_fine_coarse);
    json["coordination_fine_fine"] = number(s.coordination_fine_fine);
    json["rattler_fraction"] = s.rattler_fraction;
    json["kinetic_ratio"] = s.kinetic_ratio;
    json["unbalanced_ratio"] = s.unbalanced_ratio;
    json["mean_pressure"] = s.mean_pressure;
    json["max_overlap"] = s.max_overlap;
    for (const auto& w : sample.walls) json["wall_pressure"][w.name] = w.pressure;
    for (const auto& c : sample.criteria)
        json["criteria"][c.name] = {{"value", number(c.value)}, {"threshold", c.threshold}, {"verdict", c.verdict}};
    json["compressed"] = report.compressed;
    json["relaxed"] = report.relaxed;
    json["steps"] = report.steps;
    json["dem_step"] = s.dem_step;
    json["simulated_time"] = report.simulated_time;
    json["seconds"] = seconds_of(report);
    json["warnings"] = report.warnings;
    return json;
}

std::string to_text(const pack::Sample& sample, const pack::PackReport& report, const std::filesystem::path& output)
{
    const pack::Statistics& s = sample.statistics;
    std::size_t fines = 0;
    for (const auto& p : sample.particles) fines += p.role == pack::Role::fine;
    std::string text = fmt::format("{}: {} coarse and {} fine grains in {}\n", output.filename().string(), sample.particles.size() - fines,
                                   fines, pack::describe_enclosure(sample));
    const auto line = [&](const char* name, const std::string& value) { text += fmt::format("  {:32} {}\n", name, value); };
    line("porosity", fmt::format("{:.4f} with intraparticle voids, {:.4f} without", s.porosity, s.interparticle_porosity));
    line("void ratio", fmt::format("{:.4f} with intraparticle voids, {:.4f} without", s.void_ratio, s.interparticle_void_ratio));
    if (std::isfinite(report.relative_density)) line("relative density", fmt::format("{:.1f} %", 100 * report.relative_density));
    line("fines content by mass", fmt::format("{:.4f}, gap ratio {:.2f}", s.fines_content, s.gap_ratio));
    line("coordination number", fmt::format("{:.2f} (coarse-coarse {:.2f}, coarse-fine {:.2f}, fine-coarse {:.2f}, fine-fine {:.2f})", s.coordination,
                                            s.coordination_coarse_coarse, s.coordination_coarse_fine, s.coordination_fine_coarse, s.coordination_fine_fine));
    line("grains with under two contacts", fmt::format("{:.1f} %", 100 * s.rattler_fraction));
    line("mean pressure on the walls", format_quantity(s.mean_pressure, Dimension::pressure));
    for (const auto& w : sample.walls) line("", fmt::format("{}  {}", w.name, format_quantity(w.pressure, Dimension::pressure)));
    line("unbalanced-force ratio", fmt::format("{:.2e}", s.unbalanced_ratio));
    line("kinetic over elastic energy", fmt::format("{:.2e}", s.kinetic_ratio));
    line("largest overlap over diameter", fmt::format("{:.2e} between grains, {:.2e} at walls", s.max_overlap, s.max_wall_overlap));
    for (const auto& c : sample.criteria) line(c.name.c_str(), fmt::format("{:.3f}  {}: {}", c.value, c.verdict, c.definition));
    line("time", fmt::format("{} steps, {:.2f} s simulated; {:.1f} s loading, {:.1f} s pouring, {:.1f} s compressing, {:.1f} s relaxing", report.steps,
                             report.simulated_time, report.loading_seconds, report.pouring_seconds, report.compression_seconds, report.relaxation_seconds));
    return text;
}

pack::PackControl control_of(const Options& o, const std::filesystem::path& checkpoint)
{
    cli::catch_stop_signals();
    pack::PackControl control;
    control.checkpoint = checkpoint;
    control.resume = o.resume;
    control.checkpoint_every = o.checkpoint_every;
    control.interrupted = cli::stop_asked;
    control.message = [](const std::string& text) { spdlog::info("{}", text); };
    return control;
}

void report_stop(const cli::Context& context, const pack::PackReport& report, const std::filesystem::path& checkpoint)
{
    const bool kept = std::filesystem::exists(checkpoint);
    spdlog::warn("interrupted; {}", kept ? checkpoint.string() + " is written, give the same command with --resume to go on" : "nothing had been packed yet");
    nlohmann::ordered_json json{{"complete", false}, {"interrupted", true}, {"seconds", seconds_of(report)}};
    if (kept) json["checkpoint"] = checkpoint.string();
    cli::print_summary(context, json, "stopped before the end" + std::string(kept ? " (go on with --resume)" : ""));
}

void run(const Options& o, const cli::Context& context, std::uint64_t seed)
{
    if (!(o.scale > 0)) throw UsageError("--scale", "must be greater than zero, is " + coral::to_text(o.scale), "1 keeps the size of the file");
    pack::Spec spec = pack::read_spec(o.input, o.grains);
    if (o.scale != 1) pack::scale_grains(spec, o.scale);
    if (!std::filesystem::is_directory(o.output.has_parent_path() ? o.output.parent_path() : "."))
        throw UsageError(o.output.string(), "its folder does not exist", "make the folder first");
    if (!o.psd_figure.empty()) tool::check_psd_figure(o.psd_figure);
    if (!o.figure.empty()) pack::check_png(o.figure);
    if (o.checkpoint_every < 0) throw UsageError("--checkpoint-every", "is negative", "take a time such as 300s");
    const std::filesystem::path checkpoint = o.output.string() + ".checkpoint";
    pack::PackReport report;
    pack::Sample sample = pack::pack(spec, seed, report, control_of(o, checkpoint));
    if (report.interrupted) {
        report_stop(context, report, checkpoint);
        return;
    }
    RecordEntry entry = context.record;
    for (const char* option : {"resume", "checkpoint-every"}) entry.options.erase(option);
    if (!o.grains.empty()) entry.options["grains"] = o.grains.filename().string();  // no folders in a history
    for (const char* option : {"psd-figure", "figure"}) entry.options.erase(option);  // make no difference to the sample
    entry.options["specification"] = read_text_file(o.input);  // a file name alone would not repeat the run
    if (std::isfinite(report.relative_density)) entry.options["relative_density"] = coral::to_text(report.relative_density);
    sample.history.push_back(std::move(entry));
    pack::write_sample(sample, o.output);
    std::error_code ignored;
    std::filesystem::remove(checkpoint, ignored);
    if (!o.psd_figure.empty()) tool::draw_psd(sample, o.psd_figure);
    if (!o.figure.empty()) pack::write_png(pack::draw_sample(sample, picture_pixels), o.figure);
    for (const std::string& warning : report.warnings) spdlog::warn("{}", warning);
    cli::print_summary(context, to_json(sample, report), to_text(sample, report, o.output));
}

}  // namespace

int main(int argc, char** argv)
{
    Options options;
    std::uint64_t seed = 1;
    return cli::run_tool(
        argc, argv, "pack-sample", "Pour, compress and relax grains to a gap-graded sample", [&](coral::cli::Options& declared) { declare(declared, options); },
        [&](const cli::Context& context) { run(options, context, seed); }, &seed);
}
