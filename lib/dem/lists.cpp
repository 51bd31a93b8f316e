// Neighbour lists with skin: made anew when a body may have come within reach unseen, with the friction springs carried over.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"
#include "dem/detail/impl.h"

namespace coral::dem {

namespace {

void make_sphere_list(World::Impl& world, const std::vector<BroadPair>& pairs)
{
    SphereList old = std::move(world.spheres);
    SphereList& l = world.spheres;
    l = {};
    l.row.push_back(0);
    std::size_t old_row = 0;
    for (std::size_t p = 0; p < pairs.size();) {
        const Index a = pairs[p].a;
        const std::size_t begin = l.other.size();
        std::size_t end = p;
        for (; end < pairs.size() && pairs[end].a == a; ++end)
            if (!world.has_nodes[std::size_t(a)] && !world.has_nodes[std::size_t(pairs[end].b)]) l.other.push_back(pairs[end].b);
        p = end;
        if (l.other.size() == begin) continue;
        l.rows.push_back(a);
        l.row.push_back(Index(l.other.size()));
        l.memory.resize(l.other.size());
        l.touch.resize(l.other.size(), 0);
        for (std::size_t m = begin; m < l.other.size(); ++m)
            l.root_mass.push_back(std::sqrt(1.0 / (world.inverse_mass[std::size_t(a)] + world.inverse_mass[std::size_t(l.other[m])])));
        while (old_row < old.rows.size() && old.rows[old_row] < a) ++old_row;
        if (old_row == old.rows.size() || old.rows[old_row] != a) continue;
        Index k = old.row[old_row];
        for (std::size_t m = begin; m < l.other.size(); ++m) {
            while (k < old.row[old_row + 1] && old.other[std::size_t(k)] < l.other[m]) ++k;
            if (k == old.row[old_row + 1]) break;
            if (old.other[std::size_t(k)] != l.other[m]) continue;
            l.memory[m] = old.memory[std::size_t(k)];
            l.touch[m] = old.touch[std::size_t(k)];
        }
    }
    l.make_room();
}

void make_sphere_wall_list(World::Impl& world, double skin)
{
    SphereWallList old = std::move(world.sphere_walls);
    SphereWallList& l = world.sphere_walls;
    l = {};
    std::size_t k = 0;
    for (std::size_t i = 0; i < world.x.size(); ++i) {
        if (world.has_nodes[i] || !world.free(i)) continue;
        for (std::size_t wall = 0; wall < world.walls.size(); ++wall) {
            const WallData& data = world.walls[wall];
            Vec3 gradient;
            const bool plane = data.kind == WallData::Kind::plane, plate = data.kind == WallData::Kind::plate;
            const double distance = plane ? data.normal.dot(world.x[i] - data.point) : data.distance_and_gradient(world.x[i], gradient);
            if (distance >= world.radius[i] + skin) continue;
            for (int feature = 0; feature < (plate ? detail::Plate::features : 1); ++feature) {
                l.body.push_back(Index(i));
                l.wall.push_back(Index(wall));
                l.feature.push_back(std::uint8_t(feature));
                const auto before = [&](std::size_t m) {
                    if (old.body[m] != Index(i)) return old.body[m] < Index(i);
                    if (old.wall[m] != Index(wall)) return old.wall[m] < Index(wall);
                    return old.feature[m] < feature;
                };
                while (k < old.body.size() && before(k)) ++k;
                const bool same = k < old.body.size() && old.body[k] == Index(i) && old.wall[k] == Index(wall) && old.feature[k] == feature;
                l.memory.push_back(same ? old.memory[k] : PointMemory{});
                l.touch.push_back(same ? old.touch[k] : std::uint8_t{0});
            }
        }
    }
    l.make_room();
}

void make_sphere_grid_list(World::Impl& world, const std::vector<BroadPair>& pairs, double skin)
{
    SphereGridList old = std::move(world.sphere_grids);
    SphereGridList& l = world.sphere_grids;
    l = {};
    std::vector<BroadPair> mixed;  // a: sphere, b: grid
    for (const BroadPair& pair : pairs) {
        const bool a = world.has_nodes[std::size_t(pair.a)], b = world.has_nodes[std::size_t(pair.b)];
        if (a != b) mixed.push_back(a ? BroadPair{pair.b, pair.a} : pair);
    }
    std::sort(mixed.begin(), mixed.end(), [](const BroadPair& s, const BroadPair& t) { return key_of(s.a, s.b) < key_of(t.a, t.b); });
    const auto place_of = [&](const BroadPair& pair) -> Vec3 {
        const std::size_t i = std::size_t(pair.a), j = std::size_t(pair.b);
        return world.q[j].conjugate() * world.periodic(world.x[i] - world.x[j]);
    };
    constexpr std::size_t grain = 512;
    std::vector<double> distances(mixed.size());  // most of the work: each waits for another place of memory
    parallel_blocks(mixed.size(), grain, [&](std::size_t first, std::size_t last) {
        for (std::size_t m = first; m < last; ++m) {
            const std::size_t j = std::size_t(mixed[m].b);
            const double scale = world.scale[j];
            distances[m] = scale * detail::DistanceField(*world.shapes[std::size_t(world.shape[j])]).distance(place_of(mixed[m]) / scale);
        }
    });
    const bool all_walls = world.options.sphere_scheme == SphereScheme::walls;
    std::size_t k = 0;
    for (std::size_t m = 0; m < mixed.size(); ++m) {
        const BroadPair& pair = mixed[m];
        const std::size_t i = std::size_t(pair.a), j = std::size_t(pair.b);
        const double scale = world.scale[j], within = world.radius[i] + skin, distance = distances[m];
        if (distance >= within) continue;
        const Shape& shape = *world.shapes[std::size_t(world.shape[j])];
        const detail::DistanceField field(shape);
        const Vec3 local = place_of(pair);
        // In a void the table answers for any radius; beyond its box, or where it is clamped, only out to its reach.
        if (scale * shape.exterior_reach() < world.radius[i] && (!field.grid->inside_box(local / scale) || distance >= scale * field.grid->outside_limit))
            throw Error(world.name(i) + " at " + world.name(j),
                        "radius " + to_text(world.radius[i]) + " m is larger than the exterior distances of " + shape.name() + " reach (" +
                            to_text(scale * shape.exterior_reach()) + " m)",
                        "extend the shape's distances at least to the radius of the largest sphere");
        l.sphere.push_back(pair.a);
        l.grid.push_back(pair.b);
        const std::uint64_t key = key_of(pair.a, pair.b);
        while (k < old.sphere.size() && key_of(old.sphere[k], old.grid[k]) < key) ++k;
        const bool same = k < old.sphere.size() && key_of(old.sphere[k], old.grid[k]) == key;
        l.touch.push_back(same ? old.touch[k] : std::uint8_t{0});
        l.slots.push_back(same ? old.slots[k] : Slots{});
        l.press.push_back(same ? old.press[k] : PressMemory{});
        const bool had = same && !old.within.empty() && old.within[k] > 0.0;
        detail::CellMemory here, beyond;
        const bool walls = field.grid && (all_walls || (had && (old.touch[k] != 0 || world.is_cornered(i, j, local / scale, here, beyond))));
        // A meshed surface lies within a spacing of where the distances say.
        const double room = distance - world.radius[i] - (walls ? scale * field.grid->spacing : 0.0);
        l.clearance.push_back(std::nextafter(float(room), -1.0F));
        if (world.options.sphere_scheme == SphereScheme::nearest) continue;
        l.cut.push_back(local / scale);
        l.listed.push_back(local / scale);
        l.within.push_back(walls ? within / scale : 0.0);
        l.pocket.emplace_back();
        if (!walls) continue;
        constexpr double kept = 0.3;  // of the skin: a sphere that has hardly moved keeps its triangles
        if (had && (local / scale - old.cut[k]).norm() < kept * skin / scale && old.within[k] >= within / scale * (1.0 - 1e-12)) {
            l.cut.back() = old.cut[k];
            l.listed.back() = old.listed[k];
            l.pocket.back() = std::move(old.pocket[k]);
        } else {
            world.make_pocket(l.pocket.size() - 1);
        }
    }
    l.make_room();
    l.out.resize(l.sphere.size());
}

}  // namespace

std::shared_ptr<const detail::Facets> World::Impl::facets_of(Index shape_id)
{
    facets.resize(shapes.size());
    std::shared_ptr<const detail::Facets>& made = facets[std::size_t(shape_id)];
    if (!made) made = std::make_shared<const detail::Facets>(shapes[std::size_t(shape_id)]->distance_grid());
    return made;
}

/// The surface around the place where it is cut out. Few pairs need them: their own part of the lattice takes less memory than
/// the surfaces of all shapes.
void World::Impl::make_pocket(std::size_t k)
{
    SphereGridList& l = sphere_grids;
    const Index shape_id = shape[std::size_t(l.grid[k])];
    Pocket& pocket = l.pocket[k];
    if (options.sphere_scheme == SphereScheme::walls) pocket.surface = facets_of(shape_id);
    else pocket.surface = std::make_shared<const detail::Facets>(shapes[std::size_t(shape_id)]->distance_grid(), l.cut[k], l.within[k]);
    gather_pocket(k);
}

/// The triangles of the pocket by how near they are to where the sphere is listed.
void World::Impl::gather_pocket(std::size_t k)
{
    SphereGridList& l = sphere_grids;
    Pocket& pocket = l.pocket[k];
    const double r = radius[std::size_t(l.sphere[k])] / scale[std::size_t(l.grid[k])], sight = l.within[k] - (l.listed[k] - l.cut[k]).norm();
    thread_local std::vector<detail::Facets::Near> near;
    near.clear();
    pocket.surface->gather(l.listed[k], std::min(sight, (1.0 + stale_way) * r), near);
    pocket.surface->lay_out(near, pocket.quads);
    pocket.room = (near.empty() ? pocket.surface->nearest(l.listed[k], sight) : double(near.front().clearance)) - r;
}

void World::Impl::make_pocket_here(std::size_t k)
{
    SphereGridList& l = sphere_grids;
    const std::size_t i = std::size_t(l.sphere[k]), j = std::size_t(l.grid[k]);
    if (!(l.within[k] > 0.0)) l.clearance[k] -= float(scale[j] * shapes[std::size_t(shape[j])]->distance_grid().spacing);
    l.cut[k] = l.listed[k] = q[j].conjugate() * periodic(x[i] - x[j]) / scale[j];
    l.within[k] = (radius[i] + skin) / scale[j];
    make_pocket(k);
}

void World::Impl::make_lists()
{
    const auto start = std::chrono::steady_clock::now();
    skin = options.skin;
    if (skin <= 0.0) {
        std::vector<double> sizes;
        for (std::size_t i = 0; i < x.size(); ++i)
            if (in[i]) sizes.push_back(equivalent[i]);
        if (!sizes.empty()) {
            std::nth_element(sizes.begin(), sizes.begin() + std::ptrdiff_t(sizes.size() / 2), sizes.end());
            skin = 0.25 * sizes[sizes.size() / 2];
        }
    }
    const std::vector<BroadPair> pairs = broad_phase(*this, skin);
    make_sphere_list(*this, pairs);
    make_sphere_wall_list(*this, skin);
    make_sphere_grid_list(*this, pairs, skin);
    list_nodes(&pairs);
    make_blocks();
    x_reference = x;
    q_reference = q;
    moved2.assign(x.size(), 0.0);
    grid_drift.assign(x.size(), 0.0);
    for (WallData& wall : walls) wall.reference = wall.point;
    bool spheres_in = false, grids_in = false;
    for (std::size_t i = 0; i < x.size(); ++i)
        if (in[i]) (has_nodes[i] ? grids_in : spheres_in) = true;
    mixed = spheres_in && grids_in;
    lists_valid = true;
    ++counters.rebuilds;
    counters.seconds_lists += seconds_since(start);
}

// Room for what the blocks of the loops leave.
void World::Impl::make_blocks()
{
    const auto blocks = [](std::size_t n, std::size_t grain) { return (n + grain - 1) / grain; };
    out_count[0].assign(spheres.block_count(), 0);
    out_count[1].assign(blocks(sphere_walls.body.size(), entry_grain), 0);
    out_count[2].assign(blocks(sphere_grids.sphere.size(), grid_grain), 0);
    out_count[3].assign(blocks(nodes.slave.size(), node_grain), 0);
    std::size_t count = 0;
    for (const auto& of : out_count) count += of.size();
    block_sums.assign(count, LoopSums{});
    crossings.resize(std::max(crossings.size(), count));
}

bool World::Impl::lists_expired()
{
    const double limit = free_path * skin;
    for (const WallData& wall : walls)
        if ((wall.point - wall.reference).squaredNorm() > limit * limit) return true;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double way2 = (x[i] - x_reference[i]).squaredNorm();
        if (way2 > limit * limit) return true;
        if (!in[i] || !has_nodes[i]) continue;
        if (note_way(i) > free_path * nodes.skin) return true;
        if (!mixed) continue;
        if (std::sqrt(way2) + turn_between(q[i], q_reference[i]) * radius[i] > limit) return true;
    }
    return false;
}

}  // namespace coral::dem
