#include "suffusion/flow_region.h"

#include "core/parallel.h"
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

/// A grain with voids, as the cells of the flow see it.
struct RegionFinder::Placed {
    const ApparentShape& apparent;
    const SealedVoids& voids;
    const sdf::DistanceGrid& solid;
    Vector3d position;
    Eigen::Matrix3d turn;  ///< domain -> frame of the shape
    Vector3i first, last;  ///< cells that it may reach
};

std::vector<RegionFinder::Placed> RegionFinder::place(const Simulation& simulation) const
{
    const Scene& scene = simulation.scene();
    const DomainSpec& domain = *scene.description.domain;
    std::vector<Placed> grains;
    const Vector3d period = scene.period();
    for (std::size_t g = 0; g < scene.bodies.size(); ++g) {
        const int body = static_cast<int>(g);
        const dem::World& world = scene.world;
        if (!scene.bodies[g].apparent || !world.active(body)) continue;
        const Eigen::Matrix3d turn = world.orientation(body).conjugate().toRotationMatrix() / world.scale(body);
        const double reach = world.bounding_radius(body) / domain.cell + 1;
        // A grain at a periodic face comes in at the other one as well.
        const Vector3i images = (period.array() > 0).cast<int>();
        for (int k = -images.z(); k <= images.z(); ++k)
            for (int j = -images.y(); j <= images.y(); ++j)
                for (int i = -images.x(); i <= images.x(); ++i) {
                    const Vector3d x = scene.wrapped(world.position(body)) + period.cwiseProduct(Vector3d(i, j, k)), at = (x - domain.origin) / domain.cell;
                    const Vector3i first = (at.array() - reach).floor().cast<int>().max(0), last = (at.array() + reach).ceil().cast<int>().min(domain.cells.array() - 1);
                    if ((first.array() > last.array()).any()) continue;
                    grains.push_back({*scene.bodies[g].apparent, voids_.at(world.shape_id(body)), world.shape(body).distance_grid(), x, turn, first, last});
                }
    }
    return grains;
}

void RegionFinder::mark_plane(const Simulation& simulation, const Placed& grain, int k, double least_open, std::vector<Region>& regions) const
{
    const DomainSpec& domain = *simulation.scene().description.domain;
    const std::size_t row = static_cast<std::size_t>(domain.cells.x()), layer = row * static_cast<std::size_t>(domain.cells.y());
    for (int j = grain.first.y(); j <= grain.last.y(); ++j)
        for (int i = grain.first.x(); i <= grain.last.x(); ++i) {
            if (1 - simulation.solid_fraction(simulation.flow().layout().index(i, j, k)) < least_open) continue;
            const Vector3d centre = grain.turn * (simulation.flow().cell_centre(i, j, k) - grain.position);
            if (!grain.apparent.contains(centre)) continue;
            bool deep = true;  // and not solid: thin walls are solid by less than half of a cell
            for (int axis = 0; axis < 3 && deep; ++axis)
                deep = grain.apparent.contains(centre + domain.cell * grain.turn.col(axis)) && grain.apparent.contains(centre - domain.cell * grain.turn.col(axis));
            Region& region = regions[static_cast<std::size_t>(i) + row * static_cast<std::size_t>(j) + layer * static_cast<std::size_t>(k)];
            const bool open = deep && grain.solid.sample(centre) > 0;
            region = std::max(region, !open ? Region::surface : grain.voids.contains(centre) ? Region::sealed : Region::open);
        }
}

std::vector<Region> RegionFinder::find(const Simulation& simulation, double least_open) const
{
    std::vector<Region> regions(simulation.flow().grid().cell_count(), Region::between);
    const std::vector<Placed> grains = place(simulation);
    parallel_blocks(static_cast<std::size_t>(simulation.flow().grid().cells.z()), 1, [&](std::size_t plane, std::size_t) {
        const int k = static_cast<int>(plane);
        for (const Placed& grain : grains)
            if (grain.first.z() <= k && k <= grain.last.z()) mark_plane(simulation, grain, k, least_open, regions);
    });
    return regions;
}

}  // namespace coral::suffusion
