// erosion-report: finished cases -> erosion.csv, figures and one page.
#include <fmt/format.h>

#include <cmath>

#include "cli.h"
#include "report/report.h"
#include "report/summary.h"

namespace {

using nlohmann::ordered_json;

struct Options {
    std::vector<std::filesystem::path> cases;
    std::filesystem::path output = "report";
    std::filesystem::path libraries = "/usr/share/javascript";
};

void declare(coral::cli::Options& options, Options& o)
{
    options.add("case", o.cases, "Case folders with the results.h5 of suffuse; several are compared").required();
    options.add("-o,--output", o.output, "Folder to write; an earlier report there is replaced");
    options.add("--libraries", o.libraries, "Folder with dygraphs/ and three/ for the interactive part (libjs-dygraphs, libjs-three)");
}

ordered_json number(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr); }

ordered_json summary_json(const coral::report::CaseData& data)
{
    const coral::report::Summary s = coral::report::summarise(data);
    return {{"case", data.name},
            {"end_time", s.end_time},
            {"eroded_mass_fraction", number(s.eroded_mass_fraction)},
            {"eroded_count", number(s.eroded_count)},
            {"fines_at_start", number(s.fines_at_start)},
            {"trapped_count", number(s.trapped_count)},
            {"hydraulic_gradient", {number(s.gradient_early), number(s.gradient_late)}},
            {"hydraulic_conductivity", {number(s.conductivity_early), number(s.conductivity_late)}},
            {"mass_balance_error", number(s.mass_error)},
            {"momentum_balance_error", number(s.momentum_error)},
            {"warnings", s.warnings}};
}

void run(const Options& o, const coral::cli::Context& context)
{
    const std::vector<coral::report::CaseData> cases = coral::report::read_cases(o.cases);
    coral::report::ReportOptions options{o.libraries, context.record};
    options.record.options.erase("libraries");  // where scripts lie on this machine does not change what the report says
    const coral::report::ReportOutcome outcome = coral::report::write_report(cases, o.output, options);
    for (const std::string& note : outcome.notes) fmt::print(stderr, "erosion-report: {}\n", note);

    ordered_json json;
    json["report"] = (o.output / "report.html").string();
    json["page_bytes"] = outcome.page_bytes;
    json["figures"] = outcome.figures;
    for (const auto& data : cases) json["cases"].push_back(summary_json(data));
    json["notes"] = outcome.notes;
    std::string human;
    for (const auto& data : cases) {
        const coral::report::Summary summary = coral::report::summarise(data);
        human += data.name + ": " + coral::report::verdict(summary) + "\n";
        for (const std::string& warning : summary.warnings) human += "  warning: " + warning + "\n";
        for (const std::string& note : data.notes) human += "  note: " + note + "\n";
    }
    human += fmt::format("{} figures and report.html ({:.1f} MB) in {}", outcome.figures.size(), 1e-6 * static_cast<double>(outcome.page_bytes), o.output.string());
    coral::cli::print_summary(context, json, human);
}

}  // namespace

int main(int argc, char** argv)
{
    Options options;
    return coral::cli::run_tool(
        argc, argv, "erosion-report", "Erosion curves, figures and one offline page from the results of suffuse",
        [&](coral::cli::Options& declared) { declare(declared, options); }, [&](const coral::cli::Context& context) { run(options, context); });
}
