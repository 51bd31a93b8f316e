// Contact of spheres with grids and polyhedra: with the nearest wall (contacts_press.cpp), or pressed on every wall of a grid.
#include <bit>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "dem/detail/impl.h"
#include "dem/detail/presses.h"

namespace coral::dem {

namespace {

using detail::Lanes;

constexpr std::size_t fetched_quads = 2;  ///< triangles are asked for so many quads ahead
constexpr double same_wall = Slots::same_wall;

/// Overlap of a ball with the plane on which it would store as much (facet_quads.h), at most its radius. The energy is kn `stored` [m2].
/// Unlike twice the energy over the force it stays finite between walls that push against each other.
double overlap_with_plane(double stored, double radius)
{
    const double linear = std::sqrt(2.0 * stored);
    return std::min(radius, 2.0 * linear / (1.0 + std::sqrt(std::max(0.0, 1.0 - 2.0 * linear / radius))));
}

/// What the walls of a grid press on a sphere, gathered by the place on the sphere: each has a dashpot and a friction spring.
/// Only these are told apart by place; the elastic force is the plain sum over the surface.
struct Places {
    int count = 0;
    int slot[Slots::count];  ///< that it had in the last step, or -1
    Vec3 key[Slots::count], force[Slots::count];
    double energy[Slots::count];

    explicit Places(const Slots& slots)
    {
        for (int k = 0; k < Slots::count; ++k)
            if (slots.used >> k & 1) open(slots.normal[k], k);
    }
    /// Presses of triangles, each to the place that it is nearest to, or to a new one.
    void add(const detail::QuadPress& press)
    {
        const Lanes zero = detail::all(0.0), none = detail::all(-1.0);
        Lanes nearest = detail::all(same_wall) * press.size, to = none;
        for (int k = 0; k < count; ++k) {
            const Lanes along = detail::dot({detail::all(key[k].x()), detail::all(key[k].y()), detail::all(key[k].z())}, press.force);
            to = along > nearest ? detail::all(double(k)) : to;
            nearest = detail::max(along, nearest);
        }
        to = press.covered > zero ? to : detail::all(-2.0);
        for (int k = 0; k < count; ++k) {
            const Lanes part = to == detail::all(double(k)) ? detail::all(1.0) : zero;
            const detail::Vec3Lanes pushed = part * press.force;
            force[k] += Vec3(detail::sum(pushed.x), detail::sum(pushed.y), detail::sum(pushed.z));
            energy[k] += detail::sum(part * press.energy);
        }
        for (int lane = 0; lane < detail::lane_count; ++lane)
            if (to[lane] == -1.0) add_one(detail::lane(press.force, lane), press.size[lane], press.energy[lane]);
    }
    /// A deep press that was taken for several places, seen as one: `from` becomes part of `to`.
    void merge(int to, int from)
    {
        const double product = force[to].norm() * force[from].norm();
        if (!(product > 0.0) || force[to].dot(force[from]) < same_wall * product) return;
        force[to] += force[from];
        energy[to] += energy[from];
        force[from].setZero();
        energy[from] = 0.0;
        if (slot[to] < 0) std::swap(slot[to], slot[from]);
    }
    /// Energy of the hardest pressed wall: a flat one that is deep in the sphere presses on several places around it.
    double energy_of_wall() const
    {
        double most = 0.0;
        for (int p = 0; p < count; ++p) {
            double sum = 0.0;
            for (int o = 0; o < count; ++o)
                if (force[o].dot(force[p]) > 0.0) sum += energy[o];
            most = std::max(most, sum);
        }
        return most;
    }

private:
    void open(const Vec3& normal, int from)
    {
        slot[count] = from;
        key[count] = normal;
        force[count].setZero();
        energy[count++] = 0.0;
    }
    void add_one(const Vec3& push, double size, double stored)
    {
        int best = -1;
        double nearest = (count < Slots::count ? same_wall : -2.0) * size;
        for (int k = 0; k < count; ++k)
            if (const double c = key[k].dot(push); c > nearest) {
                nearest = c;
                best = k;
            }
        if (best < 0) open(push / size, -1), best = count - 1;
        force[best] += push;
        energy[best] += stored;
    }
};

/// A sphere as seen from its grid: offset in the world, place in the grid's frame and scale.
struct Seen {
    alignas(32) double offset[4], place[4];  ///< three numbers each
};
void see(const World::Impl& w, const Index* entry, std::size_t count, Seen* seen)
{
    using V = detail::WideLanes;
    constexpr int full = detail::wide_lane_count;
    std::size_t i[full], j[full];
    for (int k = 0; k < full; ++k) {
        const std::size_t pair = std::size_t(entry[std::size_t(k) < count ? k : 0]);
        i[k] = std::size_t(w.sphere_grids.sphere[pair]);
        j[k] = std::size_t(w.sphere_grids.grid[pair]);
    }
    const detail::WideVec3Lanes offset = w.periodic(detail::wide_vectors([&](int k) -> const Vec3& { return w.x[i[k]]; }) -
                                                    detail::wide_vectors([&](int k) -> const Vec3& { return w.x[j[k]]; }));
    // As the conjugate of a quaternion turns a vector.
    const detail::WideFours q = detail::wide_fours([&](int k) { return w.q[j[k]].coeffs().data(); });
    const detail::WideVec3Lanes axis{q.a, q.b, q.c}, across = detail::all<V>(2.0) * cross(offset, axis), turned = offset + q.d * across + cross(across, axis);
    const V scale = detail::lanes_from<V>([&](int k) { return w.scale[j[k]]; });
    detail::put_fours({offset.x, offset.y, offset.z, scale}, [&](int k) { return seen[k].offset; });
    detail::put_fours({turned.x / scale, turned.y / scale, turned.z / scale, scale}, [&](int k) { return seen[k].place; });
}

/// Whether a force over the stiffness is more than rounding [m2].
bool counts(double force, double radius) { return force > 1e-12 * radius * radius; }

/// What the walls press on the sphere of pair k, to be worked with others. \returns whether it touches
bool hand_over(const Places& places, World::Impl& world, std::size_t k, const Vec3& offset, GeneralForce& out, detail::Presses& presses)
{
    SphereGridList& l = world.sphere_grids;
    const std::size_t i = std::size_t(l.sphere[k]), j = std::size_t(l.grid[k]);
    const double radius = world.radius[i], scale = world.scale[j], kn = world.law(world.material[i], world.material[j]).kn;
    const double stiffness = kn * scale * scale / (2.0 * std::numbers::pi * radius), unit = stiffness * scale / kn;
    double size[Slots::count], stored = 0.0;
    int count = 0;
    for (int p = 0; p < places.count; ++p) {
        size[p] = places.force[p].norm();
        stored += stiffness * scale * places.energy[p];
        count += counts(size[p] * scale * scale, radius);
    }
    Slots& slots = l.slots[k];
    if (count == 0) {
        if (l.touch[k] != 0) presses.open(k);
        return false;
    }
    detail::Press& press = presses.next(count);
    std::uint8_t used = 0;
    int to = 0;
    for (int p = 0; p < places.count; ++p) {
        if (!counts(size[p] * scale * scale, radius)) continue;
        const int at = places.slot[p] >= 0 ? places.slot[p] : std::countr_one(unsigned(used | slots.used));
        if (places.slot[p] < 0) slots.spring[at].setZero();
        used = std::uint8_t(used | 1 << at);
        slots.normal[at] = places.force[p] / size[p];
        press.place[to++] = {slots.normal[at], stiffness * size[p], overlap_with_plane(unit * places.energy[p], radius), slots.spring[at].data()};
    }
    slots.used = used;
    press.entry = k;
    press.out = &out;
    press.offset = offset;
    press.stored = stored;
    press.overlap = count == 1 ? press.place[0].overlap : overlap_with_plane(unit * places.energy_of_wall(), radius);
    presses.add(press);
    return true;
}

}  // namespace

/// Whether a second wall is about to touch a sphere that its nearest wall touches. Away from one wall the distance grows with the way; it grows
/// less where another one is at an angle a: found from a gap of s (1 - cos a) on, s the way.
bool World::Impl::is_cornered(std::size_t i, std::size_t j, const Vec3& local, detail::CellMemory& here, detail::CellMemory& beyond) const
{
    constexpr double way = 0.45, least = 0.01, near = 0.02;  // of the radius
    const Shape& master = *shapes[std::size_t(shape[j])];
    if (master.kind() != ShapeKind::grid) return false;
    const detail::DistanceField field(master);
    const double r = radius[i] / scale[j];
    Vec3 gradient;
    const double distance = field.distance_and_gradient(local, gradient, here), slope = gradient.norm();
    if (distance > (1.0 + near) * r) return false;
    if (slope < 0.5) return true;  // amid walls
    const Vec3 further = local + (way * r / slope) * gradient;
    return field.grid->inside_box(further) && field.distance(further, beyond) < distance + (way - least) * r;
}

/// The sphere of pair k pressed on the surface of its grid. \returns whether it touches
bool World::Impl::press_on_walls(std::size_t k, const Vec3& offset, const Vec3& local, GeneralForce& out, detail::Presses& presses)
{
    SphereGridList& l = sphere_grids;
    const std::size_t i = std::size_t(l.sphere[k]), j = std::size_t(l.grid[k]);
    // Triangles that were farther away when they were gathered than the sphere has come since are not looked at.
    const Pocket& pocket = l.pocket[k];
    const double r = radius[i] / scale[j];
    double moved = (local - l.listed[k]).norm();
    const auto is_loose = [&] { return l.touch[k] == 0 && moved < pocket.room; };
    if (is_loose()) return false;
    const bool outside = r + (local - l.cut[k]).norm() > l.within[k];
    if (outside || moved > stale_way * r) {
        if (outside) {
            make_pocket_here(k);
        } else {
            l.listed[k] = local;
            gather_pocket(k);
        }
        moved = 0.0;
        if (is_loose()) return false;
    }
    Places places(l.slots[k]);
    detail::QuadPress press[2];
    const auto in_reach = [&](std::size_t n) { return n < pocket.quads.size() && pocket.quads[n].clearance < r + moved; };
    for (std::size_t n = 0; in_reach(n); n += 2) {
        for (std::size_t next = n + fetched_quads; next < std::min(n + fetched_quads + 2, pocket.quads.size()); ++next) detail::prefetch(pocket.quads[next]);
        if (!in_reach(n + 1)) {
            if (detail::press_on(pocket.quads[n], local, r, press[0])) places.add(press[0]);
        } else if (detail::press_on(pocket.quads[n], pocket.quads[n + 1], local, r, press)) {
            for (const detail::QuadPress& quad : press)
                if (detail::any(quad.covered > detail::all(0.0))) places.add(quad);
        }
    }
    for (int to = 0; to < places.count; ++to)
        for (int from = to + 1; from < places.count; ++from) places.merge(to, from);
    return hand_over(places, *this, k, offset, out, presses);
}

/// Pair k has touched until the last step: what dashpots and friction took from there, and what the forces did beside the change of what was
/// stored, which goes back to the motion (see WorkError). Springs that are left count as slip.
void World::Impl::open_press(std::size_t k, double dt, LoopSums& s, std::vector<Crossing>& crossing)
{
    SphereGridList& l = sphere_grids;
    const std::size_t i = std::size_t(l.sphere[k]), j = std::size_t(l.grid[k]);
    const PressMemory past = l.press[k];
    const bool clamped = l.touch[k] == 2;
    const Vec3 velocity = v[i] - v[j];
    const auto work = [&](const Wrench& wrench) { return 0.5 * dt * wrench.power(velocity, w[i], w_before[j]); };
    s.damping -= work(past.drag);
    s.friction -= work(past.pull) - past.stretched;
    l.touch[k] = 0;
    l.slots[k].used = 0;
    l.press[k] = {};
    l.press[k].cell = past.cell;
    if (dt <= 0.0) return;
    const double strength = past.push.force.norm(), error = past.stored - work(past.push) + past.owed;
    if (clamped || !(strength > 0.0) || std::abs(error) <= 1e-6 * past.stored) s.damping += error;
    else crossing.push_back({l.sphere[k], l.grid[k], error, past.push.force / strength, periodic(x[i] - x[j])});
}

void World::Impl::sphere_grid_loop(double dt)
{
    SphereGridList& l = sphere_grids;
    const bool automatic = options.sphere_scheme == SphereScheme::automatic, nearest = options.sphere_scheme == SphereScheme::nearest;
    constexpr std::size_t looks = 16;  // steps between two looks for a second wall: a sphere goes some micrometres in them
    const std::size_t base = out_count[0].size() + out_count[1].size();
    parallel_blocks(l.sphere.size(), grid_grain, [&](std::size_t first, std::size_t last) {
        const std::size_t block = first / grid_grain;
        LoopSums s;
        std::vector<Crossing>& crossing = crossings[base + block];
        detail::Presses presses(*this, dt, s, crossing);
        GeneralForce* const begin = l.out.data() + first;
        GeneralForce* out = begin;
        std::size_t count = first;
        for (std::size_t k = first; k < last; ++k) {
            if (l.touch[k] == 0) {
                const double room = double(l.clearance[k]) - steepest * grid_drift[std::size_t(l.grid[k])];
                if (room > 0.0 && room * room > steepest * steepest * moved2[std::size_t(l.sphere[k])]) continue;
            }
            l.near[count++] = Index(k);
        }
        // What a pair keeps is large and far from that of the next one: it is asked for ahead of its turn.
        const auto fetch = [&](std::size_t n) {
            const std::size_t k = std::size_t(l.near[n]);
            for (const auto& [data, size] : {std::pair<const void*, std::size_t>{&l.press[k], sizeof(PressMemory)}, {&l.slots[k], sizeof(Slots)}})
                for (std::size_t byte = 0; byte < size; byte += 64) __builtin_prefetch(static_cast<const char*>(data) + byte, 1);
            if (nearest || !(l.within[k] > 0.0)) return;
            const std::vector<detail::FacetQuad>& quads = l.pocket[k].quads;
            for (std::size_t at = 0; at < std::min(fetched_quads, quads.size()); ++at) detail::prefetch(quads[at]);
        };
        constexpr std::size_t ahead = 4;
        const auto fetch_pocket = [&](std::size_t n) {
            if (!nearest) __builtin_prefetch(&l.pocket[std::size_t(l.near[n])].quads);
        };
        for (std::size_t n = first; n < std::min(first + 2 * ahead, count); ++n) fetch_pocket(n);
        for (std::size_t n = first; n < std::min(first + ahead, count); ++n) fetch(n);
        Seen seen[detail::wide_lane_count];
        for (std::size_t n = first; n < count; ++n) {
            const std::size_t at = (n - first) % detail::wide_lane_count;
            if (at == 0) see(*this, &l.near[n], count - n, seen);
            if (n + 2 * ahead < count) fetch_pocket(n + 2 * ahead);
            if (n + ahead < count) fetch(n + ahead);
            const std::size_t k = std::size_t(l.near[n]);
            const Vec3 offset = Vec3::Map(seen[at].offset), local = Vec3::Map(seen[at].place);
            ++s.node_queries;
            if (automatic && !(l.within[k] > 0.0) && (dt <= 0.0 || (k + std::size_t(counters.steps)) % looks == 0) &&
                is_cornered(std::size_t(l.sphere[k]), std::size_t(l.grid[k]), local, l.press[k].cell, l.beyond[k]))
                make_pocket_here(k);
            if (!nearest && l.within[k] > 0.0 ? press_on_walls(k, offset, local, *out, presses) : presses.on_nearest(k, offset, local, *out)) ++out;
        }
        presses.finish();
        s.tests = std::int64_t(last - first);
        s.touching = out - begin;
        out_count[2][block] = std::int32_t(out - begin);
        block_sums[base + block] = s;
    });
}

}  // namespace coral::dem
