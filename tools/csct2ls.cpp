// CT stack (or meshes) to level sets: grains.vdb, grains.csv, voids and meshes.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "cli.h"
#include "core/error.h"
#include "core/output_file.h"
#include "core/progress.h"
#include "core/text.h"
#include "csct2ls/convert.h"
#include "csct2ls/from_mesh.h"
#include "csct2ls/mesh_folder.h"
#include "csct2ls/options.h"
#include "csct2ls/report.h"
#include "csct2ls/spacing.h"
#include "morph/segmentation.h"
#include "morph/stack_io.h"
#include "morph/watershed.h"
#include "sdf/vdb_io.h"

namespace coral::csct2ls {
namespace {

/// Labels of all grains; the stack is taken apart on the way.
struct Labelled {
    morph::VoxelValues labels;
    Eigen::Vector3i size;
    Eigen::Vector3d voxel_size;
    std::string decision;
    double closing_radius = 0;  ///< of the watershed [m]
};

Labelled label(const Options& o, morph::VoxelStack&& stack, Stages& stages)
{
    Labelled out;
    out.size = stack.size;
    out.voxel_size = stack.voxel_size = choose_voxel_size(o, stack);
    if (out.voxel_size.maxCoeff() > 2.0 * out.voxel_size.minCoeff()) spdlog::warn("voxels of {}: more than 2:1, thin parts suffer", edges_text(out.voxel_size));
    morph::SegmentationOptions options;
    options.mode = o.labels == "auto" ? morph::LabelMode::automatic : o.labels == "binary" ? morph::LabelMode::binary : morph::LabelMode::labels;
    options.solid = o.solid;
    options.threshold = o.threshold;
    morph::Segmentation segmentation = morph::segment(std::move(stack), options);
    out.decision = segmentation.decision;
    spdlog::info("{}", out.decision);
    stages.lap("segment");
    if (!segmentation.binary) {
        if (o.split == "watershed") throw UsageError("--split watershed", "the stack holds labels, which are kept as they are", "leave it out, or pass --labels binary");
        out.labels = std::move(segmentation.labels);
    } else if (o.split == "watershed") {
        morph::WatershedResult grains = morph::split_touching_grains(segmentation.solid, {0.5 * o.throat});
        out.labels = std::move(grains.labels);
        out.closing_radius = grains.closing_radius;
        spdlog::info("watershed: {} bodies; voids narrower than {} were closed first (--throat sets it)", grains.grains,
                     short_length(2.0 * grains.closing_radius));
    } else {
        out.labels = morph::connected_components(segmentation.solid.voxels, segmentation.solid.size, 1, morph::Connectivity::full).labels;
    }
    stages.lap("split");
    return out;
}

/// Labels, boxes and measures; the labels are gone when it returns.
morph::Extraction grains_of_stack(const Options& o, Source& source, Stages& stages)
{
    morph::VoxelStack voxels = morph::read_stack(o.stack, parse_layout(o));
    stages.lap("read");
    const Labelled stack = label(o, std::move(voxels), stages);
    source = {stack.size, stack.voxel_size, stack.decision, stack.closing_radius};

    morph::ExtractionOptions options;
    options.keep_border = o.border != "drop";
    options.minimum_diameter = o.minimum_diameter;
    options.closing_radius = 0.5 * o.throat;
    options.scale_to = o.scale_to;
    options.list_voids = !o.voids.empty();
    Progress progress("grains", double(stack.labels.visit([](auto values) { return std::ranges::count_if(values, [](auto l) { return l != 0; }); })));
    morph::Extraction extraction = morph::extract_grains(stack.labels, stack.size, stack.voxel_size, options, [&](double done) { progress.update(done); });
    progress.finish();
    stages.lap("measure");
    return extraction;
}

void require_grains(const Options& o, const morph::Extraction& extraction)
{
    if (!extraction.grains.empty()) return;
    const auto dropped = [&](morph::DropReason reason) { return std::ranges::count(extraction.dropped, reason, &morph::Dropped::reason); };
    using enum morph::DropReason;
    throw Error(o.stack.front(),
                fmt::format("no grain is left: {} dropped ({} at the border, {} too small, {} too thin, {} too coarse)", extraction.dropped.size(),
                            dropped(border), dropped(small), dropped(thin), dropped(coarse)),
                "see --border keep, --min-diameter, --spacing and --split");
}

/// What to convert, and the spacing to convert it at.
struct Work {
    Source source;
    morph::Extraction extraction;
    std::vector<sdf::TriangleMesh> surfaces;
    double spacing = 0;
    /// The stack is gone by now. Meshes have none to hold the memory against: they take what they need.
    Shapes shapes() const
    {
        const double voxels = source.size.cast<double>().prod();
        return {extraction.grains, surfaces, voxels > 0 ? std::max(1.5 * voxels, 256.0 * 1024 * 1024) : std::numeric_limits<double>::infinity()};
    }
};

Work prepare(const Options& o, const sdf::LevelSetOptions& options, Stages& stages)
{
    Work work;
    double edge = 0;
    if (o.from_mesh) {
        MeshGrains meshes = grains_of_meshes(o, work.source, stages);
        work.extraction = std::move(meshes.extraction);
        work.surfaces = std::move(meshes.surfaces);
        edge = meshes.edge;
    } else {
        work.extraction = grains_of_stack(o, work.source, stages);
        edge = typical_edge(work.source.voxel_size, work.extraction.grains);
    }
    require_grains(o, work.extraction);
    work.spacing = o.tolerance > 0 ? edge : choose_spacing(o, edge);
    if (!o.from_mesh) drop_coarse(work.extraction, work.source.voxel_size, work.spacing);
    require_grains(o, work.extraction);
    if (o.tolerance > 0) {
        work.spacing = spacing_within(o.tolerance, edge, work.shapes(), options);
        stages.lap("spacing");
    }
    return work;
}

/// All files are written under temporary names first and appear together at the end.
void run(const Options& o, const cli::Context& context)
{
    check(o);
    sdf::GrainWriter writer(o.output);
    MeshFolder meshes(o.mesh, o.mesh_format);
    Stages stages;
    sdf::LevelSetOptions options;
    std::tie(options.inside_band, options.outside_band) = parse_band(o.band);
    const Work work = prepare(o, options, stages);
    const std::vector<morph::Grain>& grains = work.extraction.grains;
    options.spacing = work.spacing;
    RecordEntry entry = context.record;
    entry.options["spacing"] = to_text(options.spacing);
    writer.set_history({entry});

    std::vector<std::size_t> all(grains.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    const std::vector<Converted> converted = convert_all(work.shapes(), all, options, "level sets", [&](std::size_t g, sdf::GrainLevelSet& grain) {
        grain.id = int(g) + 1;
        grain.label = grains[g].box.label;
        if (meshes.wanted()) meshes.write(sdf::extract_mesh(grain.solid), grain.id);
        writer.add(grain);
    });
    warn_of_losses(grains, converted, options.spacing);
    stages.lap("level_sets");

    TextFile table(o.table), voids(o.voids);
    if (table.wanted()) table.write(grain_table(grains, converted).to_csv());
    if (voids.wanted()) voids.write(void_table(grains, converted).to_csv());
    writer.commit();
    table.commit();
    voids.commit();
    meshes.commit();
    stages.lap("write");
    const nlohmann::ordered_json json = summary_of(work.source, work.extraction, converted, options.spacing, stages, o.border != "flag");
    cli::print_summary(context, json, human_summary(o, json));
}

}  // namespace
}  // namespace coral::csct2ls

int main(int argc, char** argv)
{
    coral::csct2ls::Options options;
    return coral::cli::run_tool(
        argc, argv, "csct2ls", "CT stack of grains to level sets, with intraparticle voids and with the apparent shape",
        [&](coral::cli::Options& declared) { coral::csct2ls::declare(declared, options); }, [&](const coral::cli::Context& context) { coral::csct2ls::run(options, context); });
}
