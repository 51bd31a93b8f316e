// suffuse: runs a case (flow, resolved grains, fines, contact) and writes its erosion curve.
#include "cli.h"

#include <spdlog/spdlog.h>

#include <limits>

#include "core/error.h"
#include "core/text.h"
#include "suffusion/run.h"

namespace {

struct Options {
    std::string path;
    double until = std::numeric_limits<double>::infinity();
    bool resume = false, no_timing = false;
};

void declare(coral::cli::Options& options, Options& o)
{
    using namespace coral;
    options.add("case", o.path, "Folder with case.toml, or a .toml file").required();
    options.quantity("--until", o.until, Dimension::time, "Stop here with a checkpoint; the results stay those of a run to the end");
    options.flag("--resume", o.resume, "Go on from checkpoint.h5");
    options.flag("--no-timing", o.no_timing, "Leave wall-clock times out of results.h5: equal runs then give equal files");
}

double value_of(const std::vector<coral::suffusion::Measure>& measures, const std::string& name)
{
    for (const auto& m : measures)
        if (m.name == name) return m.value;
    return 0;
}

std::string human_summary(const coral::suffusion::RunSummary& s)
{
    const auto last = [&](const char* name) { return value_of(s.last, name); };
    const auto speed = [&](const char* name) { return value_of(s.performance, name); };
    std::string text = fmt::format("time          {:.6g} s of {:.6g} s{}\n", s.time, s.duration, s.complete ? "" : " (stopped; go on with --resume)");
    text += fmt::format("bodies        {} ({} fines)\n", s.bodies, s.fines);
    if (s.fines > 0)
        text += fmt::format("eroded        {:.2f} % of the fine mass ({:.0f} fines), trapped in voids {:.0f}\n", 100 * last("eroded_mass_fraction"), last("eroded_count"), last("trapped_count"));
    if (speed("cells") > 0)
        text += fmt::format("flow          hydraulic gradient {:.4g}, conductivity {:.4g} m/s\nbalance       mass {:.1e}, momentum {:.1e} (greatest of any step)\n",
                            last("hydraulic_gradient"), last("hydraulic_conductivity"), s.max_mass_error, s.max_momentum_error);
    if (speed("flow_steps") > 0)
        text += fmt::format("flow steps    {:.0f}, {:.2f} ms each: predictor {:.1f} s, pressure {:.1f} s, correction {:.1f} s, grains {:.1f} s, fines {:.1f} s\n", speed("flow_steps"),
                            speed("milliseconds_per_flow_step"), speed("seconds_predictor"), speed("seconds_poisson"), speed("seconds_correction"), speed("seconds_grains"),
                            speed("seconds_fines"));
    if (speed("dem_steps") > 0)
        text += fmt::format("contact steps {:.0f}, {:.4f} ms each: pairs {:.1f} s, integration {:.1f} s, lists {:.1f} s\n", speed("dem_steps"), speed("milliseconds_per_dem_step"),
                            speed("seconds_contact_pairs"), speed("seconds_contact_integration"), speed("seconds_contact_lists"));
    return text + "results       " + s.results.string() + "\n";
}

nlohmann::ordered_json json_summary(const coral::suffusion::RunSummary& s)
{
    nlohmann::ordered_json json{{"time", s.time}, {"duration", s.duration}, {"complete", s.complete}, {"interrupted", s.interrupted}, {"bodies", s.bodies}, {"fines", s.fines},
                                {"max_mass_balance_error", s.max_mass_error}, {"max_momentum_balance_error", s.max_momentum_error}, {"results", s.results.string()}};
    for (const auto& m : s.last) json["last"][m.name] = m.value;
    for (const auto& m : s.performance) json["performance"][m.name] = m.value;
    return json;
}

void run(const Options& o, const coral::cli::Context& context)
{
    if (!(o.until > 0)) throw coral::UsageError("--until", "is " + coral::to_text(o.until) + " s", "give a time above zero");
    coral::cli::catch_stop_signals();
    coral::suffusion::RunOptions options;
    options.until = o.until;
    options.resume = o.resume;
    options.timing = !o.no_timing;
    options.record = context.record;
    options.interrupted = coral::cli::stop_asked;
    options.message = [](const std::string& text) { spdlog::info("{}", text); };
    const coral::suffusion::RunSummary summary = coral::suffusion::run_case(o.path, options);
    if (summary.interrupted) spdlog::warn("interrupted at t = {} s; checkpoint written, go on with: suffuse {} --resume", coral::to_text(summary.time), o.path);
    coral::cli::print_summary(context, json_summary(summary), human_summary(summary));
}

}  // namespace

int main(int argc, char** argv)
{
    Options options;
    return coral::cli::run_tool(
        argc, argv, "suffuse", "Case to erosion curve: flow, grains and fines, coupled", [&](coral::cli::Options& declared) { declare(declared, options); },
        [&](const coral::cli::Context& context) { run(options, context); });
}
