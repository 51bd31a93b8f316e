#include "csct2ls/from_mesh.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "core/progress.h"
#include "csct2ls/spacing.h"
#include "sdf/closed_mesh.h"
#include "sdf/mesh_reader.h"

namespace coral::csct2ls {
namespace {

double metres(const std::string& unit)
{
    static const std::map<std::string, double> units{{"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}};
    return units.at(unit);
}

void say_what_was_found(const std::string& file, const sdf::BodyReport& body, double volume)
{
    if (body.bodies > 1)
        spdlog::warn("{}: holds {} separate bodies; the largest is kept, {:.2g} % of the volume is left out", file, body.bodies,
                     100.0 * body.dropped_volume / (body.dropped_volume + volume));
    if (body.cavities > 0) spdlog::info("{}: {} closed surfaces inside it are taken for cavities", file, body.cavities);
    if (body.turned > 0) spdlog::warn("{}: {} triangles were inside out and are turned", file, body.turned);
}

/// Voxels of the mesh, in its own frame.
morph::Mask voxels_of(const sdf::TriangleMesh& mesh, double edge)
{
    Eigen::Vector3d low = mesh.vertices.front(), high = low;
    for (const Eigen::Vector3d& v : mesh.vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
    const Eigen::Vector3d first = (low / edge).array().floor() - 1.0, last = (high / edge).array().ceil() + 1.0;
    morph::Mask mask = morph::make_mask((last - first).cast<int>(), Eigen::Vector3d::Constant(edge));
    mask.offset = first.cast<int>();
    mask.voxels = sdf::solid_nodes(mesh, edge * (first.array() + 0.5).matrix(), edge, mask.size);
    return mask;
}

/// Edge of the voxels that a body of this diameter is measured in [m].
double measuring_edge(const Options& o, const std::string& file, double diameter)
{
    if (o.spacing <= 0) return diameter / 150.0;
    const double scale = o.scale_to > 0 ? o.scale_to / diameter : 1.0;
    if (scale * diameter > 2000.0 * o.spacing)
        throw Error(file, "is " + short_length(scale * diameter) + " in diameter, more than 2000 spacings", "check --mesh-unit, or take a coarser --spacing");
    return std::clamp(0.5 * o.spacing / scale, diameter / 400.0, diameter / 60.0);
}

morph::Grain measured(const Options& o, const std::string& file, sdf::TriangleMesh& mesh, double& edge)
{
    const double volume = sdf::enclosed_volume(mesh), area = sdf::surface_area(mesh);
    edge = measuring_edge(o, file, std::cbrt(6.0 / std::numbers::pi * volume));
    morph::ExtractionOptions options;
    options.minimum_diameter = o.minimum_diameter;
    options.closing_radius = 0.5 * o.throat;
    options.scale_to = o.scale_to;
    options.list_voids = !o.voids.empty();
    morph::DropReason reason = morph::DropReason::small;
    std::optional<morph::Grain> grain = morph::measure_grain(voxels_of(mesh, edge), options, reason);
    if (!grain)
        throw Error(file, reason == morph::DropReason::thin ? "is too thin to measure" : fmt::format("is smaller than --min-diameter, or too thin for voxels of {}", short_length(edge)),
                    "check the mesh and --mesh-unit, or take a finer --spacing");
    grain->shape.volume = volume * std::pow(grain->scale, 3);
    grain->shape.surface_area = area * grain->scale * grain->scale;
    for (Eigen::Vector3d& v : mesh.vertices) v *= grain->scale;
    edge *= grain->scale;
    return std::move(*grain);
}

}  // namespace

MeshGrains grains_of_meshes(const Options& o, Source& source, Stages& stages)
{
    MeshGrains read;
    std::vector<double> edges;
    Progress progress("meshes", double(o.stack.size()));
    for (std::size_t n = 0; n < o.stack.size(); ++n) {
        const std::string& file = o.stack[n];
        sdf::BodyReport body;
        sdf::TriangleMesh mesh = sdf::closed_body(sdf::read_mesh(file, metres(o.mesh_unit)), file, &body);
        say_what_was_found(file, body, sdf::enclosed_volume(mesh));
        edges.emplace_back();
        morph::Grain grain = measured(o, file, mesh, edges.back());
        grain.box.label = std::uint32_t(n + 1);
        read.extraction.grains.push_back(std::move(grain));
        read.surfaces.push_back(std::move(mesh));
        progress.update(double(n + 1));
    }
    progress.finish();

    std::vector<std::size_t> order(read.surfaces.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return read.extraction.grains[a].shape.volume > read.extraction.grains[b].shape.volume; });
    MeshGrains sorted;
    for (const std::size_t n : order) {
        sorted.extraction.grains.push_back(std::move(read.extraction.grains[n]));
        sorted.surfaces.push_back(std::move(read.surfaces[n]));
    }
    sorted.edge = upper_median(edges);
    source.decision = fmt::format("{} meshes in {}", o.stack.size(), o.mesh_unit);
    stages.lap("read");
    return sorted;
}

}  // namespace coral::csct2ls
