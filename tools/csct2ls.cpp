// CT stack to level sets: grains.vdb, grains.csv and meshes.
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <mutex>
#include <numeric>

#include "cli.h"
#include "core/error.h"
#include "core/output_file.h"
#include "core/progress.h"
#include "core/table.h"
#include "core/text.h"
#include "morph/extraction.h"
#include "morph/segmentation.h"
#include "morph/stack_io.h"
#include "morph/watershed.h"
#include "sdf/mesh.h"
#include "sdf/vdb_io.h"

namespace coral {
namespace {

namespace fs = std::filesystem;

struct Options {
    std::vector<std::string> stack;
    fs::path output, table, mesh;
    std::string voxel_size, band = "6,9", labels = "auto", solid = "bright", threshold, split = "none", border = "drop", shape, type = "u8";
    double spacing = 0, throat = 0, minimum_diameter = 0, scale_to = 0;
};

void declare(cli::Options& options, Options& o)
{
    options.add("STACK", o.stack, "TIFF stack, .nrrd, .mhd/.mha, .raw, file.h5:/dataset, folder or list of TIFF slices").required();
    options.add("-o,--output", o.output, "Level sets of the grains, .vdb").required();
    options.add("--voxel-size", o.voxel_size, "Voxel edge, or x,y,z edges, such as 30um; wins over the file's own");
    options.quantity("--spacing", o.spacing, Dimension::length, "Node spacing of the level sets; 0 takes twice the voxel edge, or D/75 with --scale-to");
    options.add("--band", o.band, "True distances kept inside,outside the surface [nodes]");
    options.add("--labels", o.labels, "What the numbers are; auto: two values are a mask, more are labels").one_of({"auto", "binary", "labels"});
    options.add("--solid", o.solid, "Solid phase of a mask or grey stack: bright, dark or the value itself");
    options.add("--threshold", o.threshold, "Grey value between void and solid, or otsu");
    options.add("--split", o.split, "Splitting of touching grains in a mask").one_of({"none", "watershed"});
    options.quantity("--throat", o.throat, Dimension::length, "Widest throat closed by the apparent shape, in the CT; 0 takes a fifth of each grain's diameter");
    options.add("--border", o.border, "Grains cut by the border of the stack").one_of({"drop", "keep"});
    options.quantity("--min-diameter", o.minimum_diameter, Dimension::length, "Smallest grain kept, equivalent diameter in the CT; 0 takes 8 voxels");
    options.quantity("--scale-to", o.scale_to, Dimension::length, "Equivalent diameter every grain is scaled to; 0 keeps sizes");
    options.add("--table", o.table, "Descriptors of the grains, .csv");
    options.add("--mesh", o.mesh, "Folder for a mesh per grain, grain_<id>.ply");
    options.add("--shape", o.shape, "Size nx,ny,nz of a .raw file");
    options.add("--type", o.type, "Numbers of a .raw file").one_of({"u8", "u16", "u32", "i8", "i16", "i32", "f32", "f64"});
}

/// Seconds since the last lap, by stage.
class Stages {
public:
    void lap(const std::string& stage)
    {
        const auto now = std::chrono::steady_clock::now();
        seconds_[stage] = std::chrono::duration<double>(now - last_).count();
        last_ = now;
    }
    const nlohmann::ordered_json& seconds() const { return seconds_; }

private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
    nlohmann::ordered_json seconds_ = nlohmann::ordered_json::object();
};

Eigen::Vector3d parse_voxel_size(const std::string& text)
{
    const std::vector<std::string> pieces = split(text, ',');
    if (pieces.size() != 1 && pieces.size() != 3) throw UsageError("--voxel-size " + text, "needs one edge or three", "such as 30um or 30um,30um,60um");
    Eigen::Vector3d edges;
    for (int a = 0; a < 3; ++a) edges[a] = parse_quantity(pieces[pieces.size() == 3 ? std::size_t(a) : 0], Dimension::length, "--voxel-size");
    if (edges.minCoeff() <= 0 || edges.maxCoeff() > 0.01)
        throw UsageError("--voxel-size " + text, "must lie between 0 and 1 cm (a bare number is in metres)", "such as 30um");
    return edges;
}

std::string edges_text(const Eigen::Vector3d& edges)
{
    const auto one = [](double edge) { return format_quantity(edge, Dimension::length); };
    return edges.minCoeff() == edges.maxCoeff() ? one(edges.x()) : one(edges.x()) + " x " + one(edges.y()) + " x " + one(edges.z());
}

/// The option wins over the file; without either there is nothing to go by.
Eigen::Vector3d choose_voxel_size(const Options& o, const morph::VoxelStack& stack)
{
    if (o.voxel_size.empty()) {
        if (stack.voxel_size.minCoeff() <= 0) throw UsageError(stack.name, "the file does not say its voxel size", "pass --voxel-size, such as --voxel-size 30um");
        return stack.voxel_size;
    }
    const Eigen::Vector3d edges = parse_voxel_size(o.voxel_size);
    if (stack.voxel_size.minCoeff() > 0 && (edges - stack.voxel_size).cwiseAbs().maxCoeff() > 0.01 * edges.maxCoeff())
        spdlog::warn("{}: the file says a voxel of {}, --voxel-size {} is used", stack.name, edges_text(stack.voxel_size), edges_text(edges));
    return edges;
}

std::pair<double, double> parse_band(const std::string& text)
{
    const std::vector<std::string> pieces = split(text, ',');
    if (pieces.size() != 2) throw UsageError("--band " + text, "needs two numbers: inside,outside", "such as 6,9");
    const double inside = parse_quantity(pieces[0], Dimension::number, "--band"), outside = parse_quantity(pieces[1], Dimension::number, "--band");
    if (inside < 2 || outside < 2 || inside > 100 || outside > 100) throw UsageError("--band " + text, "must lie between 2 and 100 nodes");
    return {inside, outside};
}

std::optional<morph::RawLayout> parse_layout(const Options& o)
{
    if (o.shape.empty()) return {};
    const std::vector<std::string> pieces = split(o.shape, ',');
    morph::RawLayout layout;
    layout.type = o.type;
    for (int a = 0; a < 3 && pieces.size() == 3; ++a) layout.size[a] = std::atoi(pieces[std::size_t(a)].c_str());
    if (layout.size.minCoeff() < 1) throw UsageError("--shape " + o.shape, "needs three positive numbers nx,ny,nz");
    return layout;
}

/// Everything the command line can get wrong, found before any work.
void check(const Options& o)
{
    if (!o.voxel_size.empty()) parse_voxel_size(o.voxel_size);
    parse_band(o.band);
    for (const auto& [name, value] : {std::pair{"--spacing", o.spacing}, {"--throat", o.throat}, {"--min-diameter", o.minimum_diameter}, {"--scale-to", o.scale_to}})
        if (value < 0) throw UsageError(name, "must not be negative");
    for (const fs::path& file : {o.output, o.table})
        if (!file.empty()) OutputFile{file};  // the folder is there and writable
    if (o.split == "watershed" && o.labels == "labels") throw UsageError("--split watershed", "goes not with --labels labels", "given labels are kept as they are");
}

/// Length for people: four digits.
std::string short_length(double length)
{
    if (length <= 0) return "0 m";
    const double unit = std::pow(10.0, std::floor(std::log10(length)) - 3);
    return format_quantity(std::round(length / unit) * unit, Dimension::length);
}

/// Labels of all grains; the stack is taken apart on the way.
struct Labelled {
    std::vector<std::uint32_t> labels;
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

double median(std::vector<double> values)
{
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

/// Spacing in use: the option, else twice the voxel edge, or D/75 of scaled grains but not below their median voxel edge.
double choose_spacing(const Options& o, const Labelled& stack, const std::vector<morph::Grain>& grains)
{
    std::vector<double> scales;
    for (const morph::Grain& grain : grains) scales.push_back(grain.scale);
    const double edge = stack.voxel_size.maxCoeff() * (scales.empty() ? 1.0 : median(scales));
    const double spacing = o.spacing > 0 ? o.spacing : o.scale_to > 0 ? std::max(o.scale_to / 75.0, edge) : 2.0 * edge;
    if (o.spacing <= 0) spdlog::info("level-set spacing {} (--spacing sets it)", short_length(spacing));
    else if (spacing < edge) spdlog::warn("--spacing {} is finer than the voxels ({}): it adds nodes, no detail", short_length(spacing),
                                          short_length(edge));
    return spacing;
}

/// Takes out the grains that scaling has made too coarse: level sets need a spacing of half a voxel or more.
void drop_coarse(morph::Extraction& extraction, const Eigen::Vector3d& voxel_size, double spacing)
{
    std::vector<morph::Grain> kept;
    for (morph::Grain& grain : extraction.grains) {
        if (grain.scale * voxel_size.minCoeff() <= 2.0 * spacing) kept.push_back(std::move(grain));
        else extraction.dropped.push_back({grain.box, morph::DropReason::coarse});
    }
    if (kept.size() < extraction.grains.size())
        spdlog::warn("{} grains dropped: scaled by --scale-to, their voxels are more than twice the spacing of {}", extraction.grains.size() - kept.size(),
                     short_length(spacing));
    extraction.grains = std::move(kept);
}

/// Meshes are written into a folder of their own and moved when all is done.
class MeshFolder {
public:
    explicit MeshFolder(fs::path folder) : folder_(std::move(folder))
    {
        if (folder_.empty()) return;
        if (fs::exists(folder_) && !fs::is_directory(folder_)) throw UsageError("--mesh " + folder_.string(), "is not a folder");
        std::error_code failure;
        made_ = fs::create_directory(folder_, failure);
        temporary_ = folder_ / (".part" + std::to_string(::getpid()));
        if (!failure) fs::create_directory(temporary_, failure);
        if (failure) throw Error("--mesh " + folder_.string(), "the folder cannot be made: " + failure.message());
    }
    ~MeshFolder()
    {
        std::error_code ignored;
        if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
        if (made_ && !committed_) fs::remove(folder_, ignored);
    }
    MeshFolder(const MeshFolder&) = delete;
    MeshFolder& operator=(const MeshFolder&) = delete;
    bool wanted() const { return !folder_.empty(); }
    fs::path file(int id) const { return temporary_ / ("grain_" + std::to_string(id) + ".ply"); }
    void commit()
    {
        committed_ = true;
        if (!wanted()) return;
        for (const auto& entry : fs::directory_iterator(temporary_)) fs::rename(entry.path(), folder_ / entry.path().filename());
    }

private:
    fs::path folder_, temporary_;
    bool made_ = false, committed_ = false;
};

sdf::GrainMask as_grain_mask(const morph::Mask& mask)
{
    const Eigen::Vector3d first = (mask.offset.cast<double>().array() + 0.5).matrix().cwiseProduct(mask.voxel_size);
    return {mask.size, mask.voxel_size, first, mask.voxels};
}

/// Level set of one grain into the file and, when wanted, its mesh. \return the report of the solid
sdf::LevelSetReport convert(const morph::Grain& grain, int id, const sdf::LevelSetOptions& options, sdf::GrainWriter& writer, const MeshFolder& meshes,
                            std::mutex& lock)
{
    const morph::Mask solid = grain.solid.unpack(), apparent = grain.apparent.unpack();
    sdf::LevelSetReport report;
    sdf::GrainLevelSet level_set = sdf::grain_from_masks(as_grain_mask(solid), as_grain_mask(apparent), options, &report);
    level_set.id = id;
    level_set.label = grain.box.label;
    if (meshes.wanted()) sdf::write_ply(sdf::extract_mesh(level_set.solid), meshes.file(id));
    const std::lock_guard guard(lock);
    writer.add(level_set);
    return report;
}

std::vector<sdf::LevelSetReport> convert_all(const std::vector<morph::Grain>& grains, const sdf::LevelSetOptions& options, sdf::GrainWriter& writer,
                                             const MeshFolder& meshes)
{
    std::vector<sdf::LevelSetReport> reports(grains.size());
    std::mutex lock;
    Progress progress("level sets", double(grains.size()));
    std::size_t done = 0;
    tbb::parallel_for(std::size_t{0}, grains.size(), [&](std::size_t g) {
        tbb::this_task_arena::isolate([&] { reports[g] = convert(grains[g], int(g) + 1, options, writer, meshes, lock); });
        const std::lock_guard guard(lock);
        progress.update(double(++done));
    });
    progress.finish();
    return reports;
}

double volume_error(const sdf::LevelSetReport& report) { return report.volume / report.voxel_volume - 1.0; }

Table table_of(const std::vector<morph::Grain>& grains, const std::vector<sdf::LevelSetReport>& reports)
{
    Table table;
    table.columns = split("id,label,voxels,volume,apparent_volume,equivalent_diameter,surface_area,intraparticle_porosity,open_porosity,closed_porosity,"
                          "void_count,largest_throat,volume_error,elongation,flatness,sphericity,convexity,roundness,touches_border,"
                          "touches_neighbour,apparent_surface_area,closing_radius,islands,island_voxels,level_set_components,scale", ',');
    for (std::size_t g = 0; g < grains.size(); ++g) {
        const morph::Grain& grain = grains[g];
        const morph::Descriptors& d = grain.shape;
        const auto whole = [](auto n) { return static_cast<long long>(n); };
        table.add({whole(g + 1), whole(grain.box.label), whole(d.voxels), d.volume, d.apparent_volume, d.equivalent_diameter, d.surface_area,
                   d.intraparticle_porosity, d.open_porosity, d.closed_porosity, whole(d.void_count), d.largest_throat, volume_error(reports[g]), d.elongation,
                   d.flatness, d.sphericity, d.convexity, d.roundness, whole(grain.box.touches_border), whole(grain.box.touches_neighbour),
                   d.apparent_surface_area, d.closing_radius, whole(grain.islands.count), whole(grain.islands.voxels), whole(reports[g].solid_components),
                   grain.scale});
    }
    return table;
}

/// Peak resident memory of this process [bytes].
double peak_memory()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return 1024.0 * double(usage.ru_maxrss);
}

const char* reason_text(morph::DropReason reason)
{
    switch (reason) {
        case morph::DropReason::border: return "border";
        case morph::DropReason::small: return "small";
        case morph::DropReason::coarse: return "coarse";
        default: return "thin";
    }
}

nlohmann::ordered_json summary_of(const Labelled& stack, const morph::Extraction& extraction, const std::vector<sdf::LevelSetReport>& reports, double spacing,
                                  const Stages& stages)
{
    nlohmann::ordered_json json;
    json["stack_size"] = {stack.size.x(), stack.size.y(), stack.size.z()};
    json["voxel_size"] = {stack.voxel_size.x(), stack.voxel_size.y(), stack.voxel_size.z()};
    json["segmentation"] = stack.decision;
    if (stack.closing_radius > 0) json["watershed_closing_radius"] = stack.closing_radius;
    json["grains"] = extraction.grains.size();
    json["dropped"] = extraction.dropped.size();
    for (const morph::DropReason reason : {morph::DropReason::border, morph::DropReason::small, morph::DropReason::thin, morph::DropReason::coarse})
        json[std::string("dropped_") + reason_text(reason)] =
            std::count_if(extraction.dropped.begin(), extraction.dropped.end(), [&](const auto& d) { return d.reason == reason; });
    std::size_t border = 0, touching = 0, islands = 0;
    double volume = 0, apparent = 0, worst = 0;
    std::vector<double> diameters;
    for (std::size_t g = 0; g < extraction.grains.size(); ++g) {
        const morph::Grain& grain = extraction.grains[g];
        border += grain.box.touches_border;
        touching += grain.box.touches_neighbour;
        islands += grain.islands.count;
        volume += grain.shape.volume;
        apparent += grain.shape.apparent_volume;
        diameters.push_back(grain.shape.equivalent_diameter);
        if (std::abs(volume_error(reports[g])) > std::abs(worst)) worst = volume_error(reports[g]);
    }
    for (const morph::Dropped& d : extraction.dropped) border += d.box.touches_border;
    json["border"] = border;
    json["touching"] = touching;
    json["islands"] = islands;
    json["spacing"] = spacing;
    json["equivalent_diameter_median"] = median(diameters);
    json["intraparticle_porosity"] = apparent > 0 ? 1.0 - volume / apparent : 0.0;
    json["largest_volume_error"] = worst;
    auto& list = json["dropped_labels"] = nlohmann::ordered_json::array();
    for (const morph::Dropped& d : extraction.dropped)
        if (list.size() < 1000) list.push_back({{"label", d.box.label}, {"voxels", d.box.voxels}, {"reason", reason_text(d.reason)}});
    json["seconds"] = stages.seconds();
    json["peak_memory"] = peak_memory();
    return json;
}

std::string human_summary(const Options& o, const nlohmann::ordered_json& json)
{
    double seconds = 0;
    for (const auto& [stage, value] : json["seconds"].items()) seconds += value.get<double>();
    return fmt::format(
        "{}: {} grains, {} of them touching others\n"
        "dropped: {} ({} at the border, {} too small, {} too thin, {} too coarse)\n"
        "median diameter {}, intraparticle porosity {:.4f}\n"
        "level sets at {}, volume within {:.3f} %\n"
        "{:.1f} s, {:.0f} MB\n",
        o.output.string(), json["grains"].get<std::size_t>(), json["touching"].get<std::size_t>(), json["dropped"].get<std::size_t>(),
        json["dropped_border"].get<std::size_t>(), json["dropped_small"].get<std::size_t>(), json["dropped_thin"].get<std::size_t>(), json["dropped_coarse"].get<std::size_t>(),
        short_length(json["equivalent_diameter_median"].get<double>()), json["intraparticle_porosity"].get<double>(),
        short_length(json["spacing"].get<double>()), 100.0 * std::abs(json["largest_volume_error"].get<double>()), seconds,
        json["peak_memory"].get<double>() / 1e6);
}

void run(const Options& o, const cli::Context& context)
{
    check(o);
    Stages stages;
    morph::VoxelStack voxels = morph::read_stack(o.stack, parse_layout(o));
    stages.lap("read");
    const Labelled stack = label(o, std::move(voxels), stages);

    morph::ExtractionOptions extraction_options;
    extraction_options.keep_border = o.border == "keep";
    extraction_options.minimum_diameter = o.minimum_diameter;
    extraction_options.closing_radius = 0.5 * o.throat;
    extraction_options.scale_to = o.scale_to;
    Progress progress("grains", double(std::count_if(stack.labels.begin(), stack.labels.end(), [](std::uint32_t l) { return l != 0; })));
    morph::Extraction extraction =
        morph::extract_grains(stack.labels, stack.size, stack.voxel_size, extraction_options, [&](double done) { progress.update(done); });
    progress.finish();
    stages.lap("measure");
    sdf::LevelSetOptions options;
    options.spacing = choose_spacing(o, stack, extraction.grains);
    drop_coarse(extraction, stack.voxel_size, options.spacing);
    if (extraction.grains.empty())
        throw Error(o.stack.front(), fmt::format("no grain is left: {} were dropped", extraction.dropped.size()),
                    "see --border keep, --min-diameter and --split");
    std::tie(options.inside_band, options.outside_band) = parse_band(o.band);
    sdf::GrainWriter writer(o.output);
    MeshFolder meshes(o.mesh);
    const std::vector<sdf::LevelSetReport> reports = convert_all(extraction.grains, options, writer, meshes);
    stages.lap("level_sets");

    const Table table = table_of(extraction.grains, reports);
    RecordEntry entry = context.record;
    entry.options["spacing"] = to_text(options.spacing);
    writer.commit({entry});
    if (!o.table.empty()) table.write(o.table);
    meshes.commit();
    stages.lap("write");
    const nlohmann::ordered_json json = summary_of(stack, extraction, reports, options.spacing, stages);
    cli::print_summary(context, json, human_summary(o, json));
}

}  // namespace
}  // namespace coral

int main(int argc, char** argv)
{
    coral::Options options;
    return coral::cli::run_tool(
        argc, argv, "csct2ls", "CT stack of grains to level sets, with intraparticle voids and with the apparent shape",
        [&](coral::cli::Options& declared) { coral::declare(declared, options); }, [&](const coral::cli::Context& context) { coral::run(options, context); });
}
