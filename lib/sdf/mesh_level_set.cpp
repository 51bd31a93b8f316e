#include "sdf/mesh_level_set.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/MeshToVolume.h>

#include <cmath>

#include "core/error.h"
#include "sdf/closed_mesh.h"
#include "sdf/detail/assembly.h"
#include "sdf/mass_properties.h"

namespace coral::sdf {
namespace {

/// Nodes round the mesh with room for the outside band.
DistanceGrid empty_grid(const TriangleMesh& mesh, const LevelSetOptions& options)
{
    Eigen::Vector3d low = mesh.vertices.front(), high = low;
    for (const Eigen::Vector3d& v : mesh.vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
    const double h = options.spacing, margin = (options.outside_band + 1.5) * h;
    if (((high - low).array() / h).maxCoeff() > 2000)
        throw Error("level set", "the mesh is more than 2000 spacings wide", "take a coarser spacing, and check the unit of the mesh");
    DistanceGrid grid;
    grid.spacing = h;
    grid.origin = low.array() - margin;
    grid.size = ((high - low).array() / h + 2 * margin / h).ceil().cast<int>() + 1;
    grid.distance.resize(grid.node_count());
    return grid;
}

/// Distances without sign [spacings], `band` where farther.
void fill_distances(const TriangleMesh& mesh, double band, DistanceGrid& grid)
{
    // In node numbers: OpenVDB refuses voxel edges of some micrometres, and single precision is finest near zero.
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    for (const Eigen::Vector3d& v : mesh.vertices) {
        const Eigen::Vector3f p = ((v - grid.origin) / grid.spacing).cast<float>();
        points.emplace_back(p.x(), p.y(), p.z());
    }
    for (const Eigen::Vector3i& t : mesh.triangles) triangles.emplace_back(unsigned(t[0]), unsigned(t[1]), unsigned(t[2]));
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, triangles);
    const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
    const openvdb::FloatGrid::Ptr vdb =
        openvdb::tools::meshToVolume<openvdb::FloatGrid>(adapter, *transform, float(band), float(band), openvdb::tools::UNSIGNED_DISTANCE_FIELD);
    const openvdb::CoordBBox box(openvdb::Coord(0), openvdb::Coord(grid.size.x() - 1, grid.size.y() - 1, grid.size.z() - 1));
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box, grid.distance.data());
    openvdb::tools::copyToDense(*vdb, dense, /*serial=*/true);
}

/// The smaller of two distances at each node of `into`; both lie on one lattice.
void join(DistanceGrid& into, const DistanceGrid& other)
{
    const Eigen::Vector3i offset = ((into.origin - other.origin) / into.spacing).array().round().cast<int>();
    std::size_t n = 0;
    for (int k = 0; k < into.size.z(); ++k)
        for (int j = 0; j < into.size.y(); ++j)
            for (int i = 0; i < into.size.x(); ++i, ++n) {
                const Eigen::Vector3i at = offset + Eigen::Vector3i(i, j, k);
                if ((at.array() < 0).any() || (at.array() >= other.size.array()).any()) continue;
                into.distance[n] = std::min(into.distance[n], other.distance[other.index(at.x(), at.y(), at.z())]);
            }
}

}  // namespace

DistanceGrid level_set_from_mesh(const TriangleMesh& mesh, const LevelSetOptions& options, LevelSetReport* report)
{
    if (!(options.spacing > 0)) throw Error("level set", "spacing must be positive");
    if (mesh.triangles.empty()) throw Error("level set", "the mesh has no triangle");
    openvdb::initialize();
    DistanceGrid grid = empty_grid(mesh, options);
    fill_distances(mesh, std::max(options.inside_band, options.outside_band) + 1.0, grid);
    const std::vector<std::uint8_t> solid = solid_nodes(mesh, grid.origin, grid.spacing, grid.size);
    for (std::size_t n = 0; n < solid.size(); ++n) grid.distance[n] = float(grid.spacing * double(solid[n] ? -grid.distance[n] : grid.distance[n]));
    detail::clamp_to_band(grid, 0.0, options);
    if (report) {
        *report = {};
        report->voxel_volume = enclosed_volume(mesh);
        report->volume = solid_volume(grid);
        report->foot_points = mesh.triangles.size();
        report->solid_components = detail::count_components(grid);
    }
    return grid;
}

GrainLevelSet grain_from_mesh(const TriangleMesh& mesh, const GrainMask& apparent, const LevelSetOptions& options, LevelSetReport* report)
{
    GrainLevelSet grain;
    grain.solid = level_set_from_mesh(mesh, options, report);
    grain.apparent = level_set_from_mask(apparent, options, nullptr, &grain.solid);
    join(grain.apparent, grain.solid);
    detail::complete(grain);
    return grain;
}

}  // namespace coral::sdf
