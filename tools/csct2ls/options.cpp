#include "csct2ls/options.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/error.h"
#include "core/output_file.h"
#include "core/text.h"

namespace coral::csct2ls {
namespace {

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

}  // namespace

void declare(cli::Options& options, Options& o)
{
    options.add("STACK", o.stack, "TIFF stack, .nrrd, .mhd/.mha, .raw, file.h5:/dataset, folder or list of TIFF slices; with --from-mesh: .stl, .ply, also gzipped, one grain each").required();
    options.add("-o,--output", o.output, "Level sets of the grains, .vdb").required();
    options.add("--voxel-size", o.voxel_size, "Voxel edge, or x,y,z edges, such as 30um; wins over the file's own");
    options.quantity("--spacing", o.spacing, Dimension::length, "Node spacing of the level sets; 0 takes twice the voxel edge, or D/75 with --scale-to");
    options.quantity("--tolerance", o.tolerance, Dimension::number, "In place of --spacing: the coarsest that keeps volume, voids and throats within it, such as 1%");
    options.add("--band", o.band, "True distances kept inside,outside the surface [nodes]");
    options.add("--labels", o.labels, "What the numbers are; auto: two values are a mask, more are labels").one_of({"auto", "binary", "labels"});
    options.add("--solid", o.solid, "Solid phase of a mask or grey stack: bright, dark or the value itself");
    options.add("--threshold", o.threshold, "Grey value between void and solid, or otsu");
    options.add("--split", o.split, "Splitting of touching grains in a mask").one_of({"none", "watershed"});
    options.quantity("--throat", o.throat, Dimension::length, "Widest throat closed by the apparent shape, in the CT; 0 takes a fifth of each grain's diameter");
    options.add("--border", o.border, "Grains cut by the border of the stack; flag keeps them, but not in the summary's statistics").one_of({"drop", "keep", "flag"});
    options.quantity("--min-diameter", o.minimum_diameter, Dimension::length, "Smallest grain kept, equivalent diameter in the CT; 0 takes 8 voxels");
    options.quantity("--scale-to", o.scale_to, Dimension::length, "Equivalent diameter every grain is scaled to; 0 keeps sizes");
    options.add("--table", o.table, "Descriptors of the grains, .csv");
    options.add("--voids", o.voids, "Voids of the grains one by one, with throat and depth, .csv");
    options.add("--mesh", o.mesh, "Folder for a mesh per grain, grain_<id>.ply or .stl");
    options.add("--mesh-format", o.mesh_format, "ply (metres) or stl (millimetres, as printers take it)").one_of({"ply", "stl"});
    options.flag("--from-mesh", o.from_mesh, "The inputs are closed triangle meshes, one grain each");
    options.add("--mesh-unit", o.mesh_unit, "Unit of the meshes' coordinates, needed with --from-mesh").one_of({"m", "cm", "mm", "um"});
    options.add("--shape", o.shape, "Size nx,ny,nz of a .raw file");
    options.add("--type", o.type, "Numbers of a .raw file").one_of({"u8", "u16", "u32", "i8", "i16", "i32", "f32", "f64"});
}

std::string edges_text(const Eigen::Vector3d& edges)
{
    const auto one = [](double edge) { return format_quantity(edge, Dimension::length); };
    return edges.x() == edges.y() && edges.y() == edges.z() ? one(edges.x()) : one(edges.x()) + " x " + one(edges.y()) + " x " + one(edges.z());
}

/// The option wins over the file; without either there is nothing to go by.
Eigen::Vector3d choose_voxel_size(const Options& o, const morph::VoxelStack& stack)
{
    const Eigen::Vector3d& found = stack.voxel_size;
    const bool said = !found.isZero(0), usable = found.allFinite() && (found.array() > 0).all();
    if (o.voxel_size.empty()) {
        if (!said) throw UsageError(stack.name, "the file does not say its voxel size", "pass --voxel-size, such as --voxel-size 30um");
        if (!usable) throw UsageError(stack.name, "the file says a voxel of " + edges_text(found), "pass the true one, such as --voxel-size 30um");
        return found;
    }
    const Eigen::Vector3d edges = parse_voxel_size(o.voxel_size);
    if (said && (!usable || (edges - found).cwiseAbs().maxCoeff() > 0.01 * edges.maxCoeff()))
        spdlog::warn("{}: the file says a voxel of {}, --voxel-size {} is used", stack.name, edges_text(found), edges_text(edges));
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
    bool good = pieces.size() == 3;
    for (int a = 0; good && a < 3; ++a) {
        const std::string& text = pieces[std::size_t(a)];
        const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), layout.size[a]);
        good = problem == std::errc{} && end == text.data() + text.size() && layout.size[a] > 0;
    }
    if (!good) throw UsageError("--shape " + o.shape, "needs three positive whole numbers nx,ny,nz", "such as 512,512,400");
    return layout;
}

namespace {

void check_mesh_options(const Options& o)
{
    if (!o.from_mesh) {
        if (!o.mesh_unit.empty()) throw UsageError("--mesh-unit", "goes with --from-mesh only", "leave it out; --voxel-size is that of a stack");
        return;
    }
    if (o.mesh_unit.empty()) throw UsageError("--from-mesh", "the files do not say the unit of their coordinates", "pass --mesh-unit m, cm, mm or um");
    const Options defaults;
    for (const auto& [name, changed] : {std::pair{"--voxel-size", !o.voxel_size.empty()}, {"--labels", o.labels != defaults.labels}, {"--solid", o.solid != defaults.solid},
                                        {"--threshold", !o.threshold.empty()}, {"--split", o.split != defaults.split}, {"--border", o.border != defaults.border},
                                        {"--shape", !o.shape.empty()}})
        if (changed) throw UsageError(name, "is about voxels and goes not with --from-mesh", "leave it out");
}

}  // namespace

void check(const Options& o)
{
    check_mesh_options(o);
    if (!o.voxel_size.empty()) parse_voxel_size(o.voxel_size);
    parse_band(o.band);
    for (const auto& [name, value] : {std::pair{"--spacing", o.spacing}, {"--throat", o.throat}, {"--min-diameter", o.minimum_diameter}, {"--scale-to", o.scale_to},
                                      {"--tolerance", o.tolerance}})
        if (value < 0) throw UsageError(name, "must not be negative");
    for (const fs::path& file : {o.output, o.table, o.voids})
        if (!file.empty()) OutputFile{file};  // the folder is there and writable
    if (o.tolerance > 0 && o.spacing > 0) throw UsageError("--tolerance", "goes not with --spacing", "give one of the two");
    if (o.tolerance > 0.5) throw UsageError("--tolerance " + to_text(o.tolerance), "must lie between 0 and 50 %", "such as 1%");
    if (o.split == "watershed" && o.labels == "labels") throw UsageError("--split watershed", "goes not with --labels labels", "given labels are kept as they are");
}

/// Length for people: four digits.
std::string short_length(double length)
{
    if (length <= 0) return "0 m";
    const double unit = std::pow(10.0, std::floor(std::log10(length)) - 3);
    return format_quantity(std::round(length / unit) * unit, Dimension::length);
}

}  // namespace coral::csct2ls
