#include "report/scene.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <nlohmann/json.hpp>

#include "report/detail/encode.h"
#include "report/detail/read.h"
#include "report/surface_mesh.h"

namespace coral::report {
namespace {

using Eigen::Vector3d;
using nlohmann::ordered_json;

constexpr std::uint16_t absent = 65535;  ///< position of a body that has none at that time

/// Steps that become frames: evenly spread, both ends kept.
std::vector<std::size_t> pick_frames(std::size_t steps, std::size_t bodies, const SceneLimits& limits)
{
    const std::size_t affordable = std::max<std::size_t>(2, limits.position_words / std::max<std::size_t>(1, 3 * bodies));
    const std::size_t count = std::min({steps, limits.frames, affordable});
    std::vector<std::size_t> frames;
    for (std::size_t f = 0; f < count; ++f) frames.push_back(count == 1 ? 0 : f * (steps - 1) / (count - 1));
    return frames;
}

struct Packed {
    std::vector<std::uint16_t> words;
    ordered_json meshes = ordered_json::array();
};

/// Positions of all bodies in all frames as steps of extent/65534, coded against the frame before; order frame, axis, body.
void pack_positions(const Tracks& tracks, const std::vector<std::size_t>& bodies, const std::vector<std::size_t>& frames, const Vector3d& low,
                    const Vector3d& extent, Packed& packed)
{
    std::vector<std::uint16_t> before(3 * bodies.size(), 0);
    for (std::size_t frame : frames)
        for (int axis = 0; axis < 3; ++axis)
            for (std::size_t b = 0; b < bodies.size(); ++b) {
                const double x = tracks.position[3 * (frame * tracks.id.size() + bodies[b]) + static_cast<std::size_t>(axis)];
                const double q = (x - low[axis]) / extent[axis] * 65534;
                const std::uint16_t now = std::isfinite(q) ? static_cast<std::uint16_t>(std::lround(std::clamp(q, 0.0, 65534.0))) : absent;
                std::uint16_t& last = before[static_cast<std::size_t>(axis) * bodies.size() + b];
                packed.words.push_back(static_cast<std::uint16_t>(now - last));
                last = now;
            }
}

/// Quaternions of the meshed grains times 32767, coded against the frame before; order frame, component, grain.
void pack_orientations(const Tracks& tracks, const std::vector<std::size_t>& grains, const std::vector<std::size_t>& frames, Packed& packed)
{
    std::vector<std::uint16_t> before(4 * grains.size(), 0);
    for (std::size_t frame : frames)
        for (std::size_t c = 0; c < 4; ++c)
            for (std::size_t g = 0; g < grains.size(); ++g) {
                const double q = tracks.orientation.empty() ? (c == 0 ? 1.0 : 0.0) : tracks.orientation[4 * (frame * tracks.id.size() + grains[g]) + c];
                const auto now = static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(std::clamp(std::isfinite(q) ? q : 0.0, -1.0, 1.0) * 32767)));
                packed.words.push_back(static_cast<std::uint16_t>(now - before[c * grains.size() + g]));
                before[c * grains.size() + g] = now;
            }
}

/// Vertices as steps of extent/65535 and triangles, each number coded against the one before it in its column.
void pack_mesh(const Mesh& mesh, Packed& packed)
{
    Vector3d low = Vector3d::Constant(HUGE_VAL), high = -low;
    for (const Vector3d& v : mesh.vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
    }
    const double extent = std::max(1e-300, (high - low).maxCoeff());
    packed.meshes.push_back({{"vertices", mesh.vertices.size()}, {"triangles", mesh.triangles.size()}, {"low", {low.x(), low.y(), low.z()}}, {"extent", extent}});
    for (int axis = 0; axis < 3; ++axis) {
        std::uint16_t before = 0;
        for (const Vector3d& v : mesh.vertices) {
            const auto now = static_cast<std::uint16_t>(std::lround((v[axis] - low[axis]) / extent * 65535));
            packed.words.push_back(static_cast<std::uint16_t>(now - before));
            before = now;
        }
    }
    for (std::size_t corner = 0; corner < 3; ++corner) {
        std::uint16_t before = 0;
        for (const auto& triangle : mesh.triangles) {
            const auto now = static_cast<std::uint16_t>(triangle[corner]);
            packed.words.push_back(static_cast<std::uint16_t>(now - before));
            before = now;
        }
    }
}

/// Spacing at which `shapes` meshes of grains of this extent fit the limit: a grain of n cells across has about 5 n^2 vertices
/// and twice as many triangles (9 words a vertex), half as much again with voids.
double mesh_spacing(const Lattice& lattice, std::size_t shapes, const SceneLimits& limits)
{
    const double words = static_cast<double>(limits.mesh_words) / static_cast<double>(shapes);
    const double across = std::clamp(std::sqrt(words / 70), 8.0, 40.0);
    const double extent = lattice.spacing * lattice.size.maxCoeff();
    return std::max(lattice.spacing, extent / across);
}

/// Tracked bodies by how they are drawn; numbers are columns of the tracks.
struct Cast {
    std::vector<std::size_t> grains, spheres;
    std::vector<std::size_t> order() const
    {
        std::vector<std::size_t> all = grains;
        all.insert(all.end(), spheres.begin(), spheres.end());
        return all;
    }
};

/// Shapes that are drawn as meshes: level sets, harmonics and superellipsoids by their lattices, polyhedra by their faces.
struct Shapes {
    std::map<std::int64_t, Lattice> lattices;
    std::map<std::int64_t, Mesh> polyhedra;
    std::map<std::int64_t, std::size_t> place;  ///< of a shape among the meshes
};

Cast cast_bodies(const CaseData& data, const Shapes& shapes)
{
    Cast cast;
    for (std::size_t column = 0; column < data.tracks.id.size(); ++column) {
        const auto number = static_cast<std::size_t>(data.tracks.id[column]);
        if (number >= data.bodies.size()) continue;
        const Body& body = data.bodies[number];
        if (shapes.place.contains(body.shape)) cast.grains.push_back(column);
        else if (body.diameter > 0) cast.spheres.push_back(column);
    }
    return cast;
}

Shapes shapes_in_use(const CaseData& data)
{
    Shapes shapes;
    std::set<std::int64_t> known;
    for (const Body& body : data.bodies) {
        if (body.shape < 0 || data.sample.empty() || !known.insert(body.shape).second) continue;
        Lattice lattice = detail::read_lattice(data.sample, body.shape);
        if (!lattice.distance.empty()) shapes.lattices.emplace(body.shape, std::move(lattice));
        else if (Mesh mesh = detail::read_polyhedron(data.sample, body.shape); !mesh.triangles.empty()) shapes.polyhedra.emplace(body.shape, std::move(mesh));
    }
    for (const auto& entry : shapes.lattices) shapes.place.emplace(entry.first, shapes.place.size());
    for (const auto& entry : shapes.polyhedra) shapes.place.emplace(entry.first, shapes.place.size());
    return shapes;
}

/// Third of the layers (0 bottom, 1 middle, 2 top) that each body started in, 3 for bodies that are no fines.
ordered_json groups_of(const CaseData& data, const std::vector<std::size_t>& columns)
{
    std::map<std::int64_t, std::int64_t> layer_of;
    for (std::size_t i = 0; i < data.migration.layer.size(); ++i) layer_of[data.migration.id[i]] = data.migration.layer[i];
    ordered_json groups = ordered_json::array();
    for (std::size_t column : columns) {
        const auto it = layer_of.find(data.tracks.id[column]);
        groups.push_back(it == layer_of.end() || data.bodies[static_cast<std::size_t>(it->first)].role != "fine" ? 3 : std::clamp<std::int64_t>(3 * it->second / static_cast<std::int64_t>(std::max<std::size_t>(1, data.layers)), 0, 2));
    }
    return groups;
}

/// Box around all finite positions, so that no extent is zero.
void bounds(const Tracks& tracks, Vector3d& low, Vector3d& extent)
{
    low = Vector3d::Constant(HUGE_VAL);
    Vector3d high = -low;
    for (std::size_t i = 0; i < tracks.position.size(); ++i) {
        const int axis = static_cast<int>(i % 3);
        if (!std::isfinite(tracks.position[i])) continue;
        low[axis] = std::min(low[axis], tracks.position[i]);
        high[axis] = std::max(high[axis], tracks.position[i]);
    }
    for (int axis = 0; axis < 3; ++axis)
        if (!std::isfinite(low[axis])) low[axis] = high[axis] = 0;
    extent = (high - low).cwiseMax(1e-9);
}

/// Meshes of the lattices in map order, then the polyhedra; returns the finest and coarsest spacing used.
std::pair<double, double> pack_meshes(const Shapes& shapes, const SceneLimits& limits, Packed& packed)
{
    const auto& lattices = shapes.lattices;
    double finest = HUGE_VAL, coarsest = 0;
    for (const auto& [shape, lattice] : lattices) {
        double spacing = mesh_spacing(lattice, lattices.size(), limits);
        Mesh mesh = surface_mesh(coarsened(lattice, spacing));
        while (mesh.vertices.size() > 65000) mesh = surface_mesh(coarsened(lattice, spacing *= 1.5));
        finest = std::min(finest, spacing);
        coarsest = std::max(coarsest, spacing);
        pack_mesh(mesh, packed);
    }
    for (const auto& entry : shapes.polyhedra) pack_mesh(entry.second, packed);
    return {finest, coarsest};
}

std::string millimetres(double metres)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.2g mm", 1000 * metres);
    return text;
}

}  // namespace

std::string scene_json(const CaseData& data, const SceneLimits& limits, std::string& note)
{
    if (data.tracks.position.empty()) {
        note = "The run kept no trajectories, so there is no 3-D view.";
        return {};
    }
    const Shapes shapes = shapes_in_use(data);
    const Cast cast = cast_bodies(data, shapes);
    const std::vector<std::size_t> order = cast.order();
    if (order.empty()) {
        note = "The sizes of the bodies are not known (no sample.h5, no diameters in case.toml), so there is no 3-D view.";
        return {};
    }
    const std::vector<std::size_t> frames = pick_frames(data.tracks.time.size(), order.size() + 4 * cast.grains.size() / 3, limits);
    Vector3d low, extent;
    bounds(data.tracks, low, extent);

    Packed packed;
    pack_positions(data.tracks, order, frames, low, extent, packed);
    pack_orientations(data.tracks, cast.grains, frames, packed);
    const auto [finest, coarsest] = pack_meshes(shapes, limits, packed);

    ordered_json scene;
    scene["case"] = data.name;
    for (std::size_t f : frames) scene["times"].push_back(data.tracks.time[f]);
    scene["low"] = {low.x(), low.y(), low.z()};
    scene["extent"] = {extent.x(), extent.y(), extent.z()};
    if (data.domain_size[0] > 0) {
        scene["domain_origin"] = data.domain_origin;
        scene["domain_size"] = data.domain_size;
    }
    scene["plates"] = ordered_json::array();
    for (const Plate& plate : data.plates) scene["plates"].push_back({plate.z, plate.hole, plate.pitch});
    scene["grain_mesh"] = ordered_json::array();
    scene["grain_scale"] = ordered_json::array();
    for (std::size_t column : cast.grains) {
        const Body& body = data.bodies[static_cast<std::size_t>(data.tracks.id[column])];
        scene["grain_mesh"].push_back(shapes.place.at(body.shape));
        scene["grain_scale"].push_back(body.scale);
    }
    scene["grain_group"] = groups_of(data, cast.grains);
    scene["sphere_radius"] = ordered_json::array();
    for (std::size_t column : cast.spheres)
        scene["sphere_radius"].push_back(static_cast<float>(0.5 * data.bodies[static_cast<std::size_t>(data.tracks.id[column])].diameter));
    scene["sphere_group"] = groups_of(data, cast.spheres);
    scene["meshes"] = packed.meshes;
    scene["words"] = packed.words.size();
    scene["data"] = detail::base64(detail::deflate_words(packed.words));

    note = std::to_string(cast.grains.size()) + " bodies in their shapes";
    if (!shapes.lattices.empty())
        note += " (lattices coarsened for viewing to " + millimetres(finest) + (coarsest > 1.01 * finest ? " to " + millimetres(coarsest) : "") + ")";
    note += ", " + std::to_string(cast.spheres.size()) + " other bodies as spheres of their equivalent diameter, " + std::to_string(frames.size()) + " of " +
            std::to_string(data.tracks.time.size()) + " stored times.";
    return scene.dump();
}

}  // namespace coral::report
