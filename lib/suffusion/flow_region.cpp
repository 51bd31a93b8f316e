#include "suffusion/flow_region.h"

#include "morph/components.h"

namespace coral::suffusion {

using Eigen::Vector3d;
using Eigen::Vector3i;

RegionFinder::RegionFinder(const Scene& scene)
{
    for (std::size_t g = 0; g < scene.bodies.size(); ++g) {
        const int body = static_cast<int>(g);
        if (!scene.bodies[g].apparent || voids_.contains(scene.world.shape_id(body))) continue;
        const sdf::DistanceGrid& grid = scene.world.shape(body).distance_grid();
        std::vector<std::uint8_t> empty(grid.node_count());
        for (std::size_t n = 0; n < empty.size(); ++n) empty[n] = grid.distance[n] > 0;
        SealedVoids voids{grid.size, grid.origin, grid.spacing, morph::connected_to_border(empty, grid.size, 1)};
        for (std::size_t n = 0; n < empty.size(); ++n) voids.sealed[n] = empty[n] && !voids.sealed[n];
        voids_.emplace(scene.world.shape_id(body), std::move(voids));
    }
}

/// Any of the eight nodes around the point: near a wall the nearest one may be solid where the distance between the nodes is not.
bool RegionFinder::SealedVoids::contains(const Vector3d& point) const
{
    const Vector3i low = ((point - origin) / spacing).array().floor().cast<int>();
    if ((low.array() < 0).any() || (low.array() + 1 >= size.array()).any()) return false;
    const std::size_t row = static_cast<std::size_t>(size.x()), layer = row * static_cast<std::size_t>(size.y());
    const std::size_t at = static_cast<std::size_t>(low.x()) + row * static_cast<std::size_t>(low.y()) + layer * static_cast<std::size_t>(low.z());
    for (const std::size_t corner : {std::size_t{0}, std::size_t{1}, row, row + 1, layer, layer + 1, layer + row, layer + row + 1})
        if (sealed[at + corner] != 0) return true;
    return false;
}

void RegionFinder::mark(const Simulation& simulation, int body, const ApparentShape& apparent, const SealedVoids& voids, std::vector<Region>& regions) const
{
    const dem::World& world = simulation.scene().world;
    const DomainSpec& domain = *simulation.scene().description.domain;
    const Vector3d x = world.position(body);
    const Eigen::Matrix3d turn = world.orientation(body).conjugate().toRotationMatrix() / world.scale(body);  // domain -> frame of the shape
    const double reach = world.bounding_radius(body) / domain.cell + 1;
    const Vector3i first = ((x - domain.origin).array() / domain.cell - reach).floor().cast<int>().max(0);
    const Vector3i last = ((x - domain.origin).array() / domain.cell + reach).ceil().cast<int>().min(domain.cells.array() - 1);
    const std::size_t row = static_cast<std::size_t>(domain.cells.x()), layer = row * static_cast<std::size_t>(domain.cells.y());
    for (int k = first.z(); k <= last.z(); ++k)
        for (int j = first.y(); j <= last.y(); ++j)
            for (int i = first.x(); i <= last.x(); ++i) {
                const Vector3d centre = turn * (simulation.flow().cell_centre(i, j, k) - x);
                if (!apparent.contains(centre)) continue;
                bool deep = true;  // and not solid: thin walls are solid by less than half of a cell
                for (int axis = 0; axis < 3 && deep; ++axis)
                    deep = apparent.contains(centre + domain.cell * turn.col(axis)) && apparent.contains(centre - domain.cell * turn.col(axis));
                Region& region = regions[static_cast<std::size_t>(i) + row * static_cast<std::size_t>(j) + layer * static_cast<std::size_t>(k)];
                const bool open = deep && world.shape(body).distance_grid().sample(centre) > 0;
                region = std::max(region, !open ? Region::surface : voids.contains(centre) ? Region::sealed : Region::open);
            }
}

std::vector<Region> RegionFinder::find(const Simulation& simulation) const
{
    const Scene& scene = simulation.scene();
    std::vector<Region> regions(simulation.flow().grid().cell_count(), Region::between);
    for (std::size_t g = 0; g < scene.bodies.size(); ++g) {
        const int body = static_cast<int>(g);
        if (!scene.bodies[g].apparent || !scene.world.active(body)) continue;
        mark(simulation, body, *scene.bodies[g].apparent, voids_.at(scene.world.shape_id(body)), regions);
    }
    return regions;
}

}  // namespace coral::suffusion
