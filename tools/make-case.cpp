// make-case: from a packed sample to a suffusion case, with the plan of the run.
#include "cli.h"

#include <spdlog/spdlog.h>

#include <filesystem>

#include "core/error.h"
#include "core/hdf5.h"
#include "core/output_file.h"
#include "pack/sample.h"
#include "suffusion/plan.h"
#include "suffusion/scene.h"

namespace {

namespace fs = std::filesystem;

struct Options {
    std::string sample, output, engine = "embedded", lid = "keep";
    coral::suffusion::PlanOptions plan;
    bool explain = false;
};

void declare(coral::cli::Options& options, Options& o)
{
    using namespace coral;
    options.add("sample", o.sample, "Packed sample, sample.h5").required();
    options.add("-o,--output", o.output, "Folder of the case");
    options.quantity("--velocity", o.plan.velocity, Dimension::velocity, "Flow at the inlet, downwards");
    options.quantity("--angle", o.plan.angle, Dimension::angle, "Between flow and gravity (gravity is turned)");
    options.quantity("--hole", o.plan.hole, Dimension::length, "Edge of the filter's square holes; 0: 0.4 of the smallest coarse grain");
    options.quantity("--pitch", o.plan.pitch, Dimension::length, "Distance of their centres, made to divide the sample's width; 0: two edges");
    options.quantity("--cell", o.plan.cell, Dimension::length, "Edge of the flow cells; 0: a thirtieth of the smallest coarse grain");
    options.add("--lid", o.lid, "Upper wall of the packing: keep (holds the grains, water passes), or remove (a compressed sample springs up)").one_of({"keep", "remove"});
    options.quantity("--duration", o.plan.duration, Dimension::time, "Length of the run");
    options.quantity("--dem-step", o.plan.dem_step, Dimension::time, "Step of contact; 0: 0.3 of the critical one");
    options.add("--engine", o.engine, "Flow solver: embedded; openfoam is not supported yet");
    options.flag("--explain", o.explain, "Print the plan and the errors to expect, and write nothing");
}

nlohmann::ordered_json json_plan(const coral::suffusion::Plan& plan)
{
    nlohmann::ordered_json json{{"cell", plan.domain.cell},
                                {"cells", {plan.domain.cells.x(), plan.domain.cells.y(), plan.domain.cells.z()}},
                                {"origin", {plan.domain.origin.x(), plan.domain.origin.y(), plan.domain.origin.z()}},
                                {"size", {plan.domain.size.x(), plan.domain.size.y(), plan.domain.size.z()}},
                                {"velocity", plan.options.velocity}, {"angle", plan.options.angle}, {"hole", plan.options.hole}, {"pitch", plan.pitch},
                                {"plate_open_fraction", plan.plate_open_fraction}, {"lid", plan.options.lid}, {"duration", plan.options.duration},
                                {"flow_step", plan.flow_step}, {"dem_step", plan.dem_step}, {"memory", plan.memory}, {"run_time", plan.run_time}};
    for (const auto& p : plan.populations)
        json["populations"].push_back({{"role", p.role}, {"count", p.count}, {"smallest", p.smallest}, {"largest", p.largest},
                                       {"scheme", coral::suffusion::to_string(p.scheme)}, {"why", p.why}});
    json["warnings"] = plan.warnings;
    return json;
}

/// The case keeps its own sample, with this step added to its history.
void copy_sample(const coral::pack::Sample& sample, const coral::cli::Context& context, const fs::path& to)
{
    coral::pack::Sample copy = sample;
    copy.history.push_back(context.record);
    coral::pack::write_sample(copy, to);
}

void run(const Options& o, const coral::cli::Context& context)
{
    using namespace coral;
    if (o.engine == "openfoam") throw UsageError("--engine openfoam", "is not supported yet", "use --engine embedded");
    if (o.engine != "embedded") throw UsageError("--engine " + o.engine, "is no engine", "use embedded");
    if (o.output.empty() && !o.explain) throw UsageError("--output", "is missing", "name the folder of the case with -o, or ask for the plan with --explain");
    if (!fs::is_regular_file(o.sample)) throw UsageError(o.sample, "there is no such file", "name a sample that pack-sample wrote");
    const pack::Sample sample = pack::read_sample(o.sample);
    suffusion::PlanOptions wanted = o.plan;
    wanted.lid = o.lid == "keep";
    const suffusion::Plan plan = suffusion::make_plan(sample, wanted);
    std::string human = suffusion::explain(plan);
    if (o.explain) human += suffusion::explain_accuracy(plan, sample);
    if (!o.explain) {
        const fs::path folder = o.output;
        std::error_code failed;
        fs::create_directories(folder, failed);
        if (failed) throw Error(folder.string(), "cannot be made: " + failed.message(), "choose a folder that can be written");
        if (fs::exists(folder / "results.h5")) spdlog::warn("{} is of the case that was here before; suffuse replaces it", (folder / "results.h5").string());
        copy_sample(sample, context, folder / "sample.h5");
        write_text_file(folder / "case.toml", suffusion::case_text(plan, sample, "sample.h5"));
        human += "case      " + (folder / "case.toml").string() + "; run it with: suffuse " + folder.string() + "\n";
    }
    cli::print_summary(context, json_plan(plan), human);
}

}  // namespace

int main(int argc, char** argv)
{
    Options options;
    return coral::cli::run_tool(
        argc, argv, "make-case", "Packed sample to suffusion case", [&](coral::cli::Options& declared) { declare(declared, options); },
        [&](const coral::cli::Context& context) { run(options, context); });
}
