// Packings and runs: samples, cases, results and checkpoints.
#include <fmt/format.h>

#include <algorithm>

#include "cli.h"
#include "core/error.h"
#include "grain-info/describe.h"
#include "pack/sample.h"
#include "suffusion/case_file.h"
#include "suffusion/checkpoint.h"
#include "suffusion/results.h"

namespace coral::grain_info {

Report describe_sample(const std::filesystem::path& file)
{
    const pack::Sample sample = pack::read_sample(file, pack::SampleDetail::without_apparent_grids);
    Report report("packed sample (pack-sample)");
    std::vector<double> coarse, fine;
    for (const pack::Particle& p : sample.particles) (p.role == pack::Role::fine ? fine : coarse).push_back(pack::equivalent_diameter(sample, p));
    report.add("bodies", sample.particles.size(), fmt::format("{} coarse, {} fine", coarse.size(), fine.size()));
    report.add("size", {sample.size.x(), sample.size.y(), sample.size.z()}, pack::describe_enclosure(sample));
    if (!sample.period.isZero(0)) report.add("period", {sample.period.x(), sample.period.y(), sample.period.z()}, fmt::format("{}, {}, {} (0: walls)", metres(sample.period.x()), metres(sample.period.y()), metres(sample.period.z())));
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

Report describe_results(const std::filesystem::path& file)
{
    const suffusion::Results results = suffusion::read_results(file);
    const History history = history_from_json(results.history, file.string());
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

Report describe_checkpoint(const std::filesystem::path& file)
{
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

Report describe_case(const std::filesystem::path& path)
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
        if (const bool there = std::filesystem::exists(c.folder / part); there) report.add(part, there, "present: grain-info " + (c.folder / part).string());
    return report;
} catch (const UsageError& error) {
    // A case with errors is bad input here, not a bad command line; the first error of several makes one line.
    const std::string text = error.what();
    const auto more = std::ranges::count(text, '\n');
    throw Error("", text.substr(0, text.find('\n')) + (more > 0 ? fmt::format(" (and {} more)", more) : ""));
}

}  // namespace coral::grain_info
