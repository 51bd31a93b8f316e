// Contact loops of spheres against spheres and walls, in closed form. A first pass finds who touches, a second takes them a register full at a time.
// Each block of the loop writes who touches into its own part of `out`; sums are taken later, in order.
#include <algorithm>
#include <bit>
#include <cmath>

#include "core/parallel.h"
#include "dem/detail/crossing.h"
#include "dem/detail/impl.h"
#include "dem/detail/point_contact.h"

namespace coral::dem {

namespace {

using detail::all;
using detail::PointGroup;
using detail::PointResult;
using Lanes = detail::WideLanes;
using Vec3Lanes = detail::WideVec3Lanes;
constexpr int lane_count = detail::wide_lane_count;

/// The contacts of a group; lanes beyond the last repeat the first.
struct Members {
    const PointContact* of;
    int count;
    PointContact filled[lane_count];
    Members(const PointContact* first, std::ptrdiff_t left) : of(first), count(int(std::min(left, std::ptrdiff_t(lane_count))))
    {
        if (count == lane_count) return;
        for (int k = 0; k < lane_count; ++k) filled[k] = first[k < count ? k : 0];
        of = filled;
    }
    const PointContact& operator[](int k) const { return of[k]; }
    template <class Of>
    [[gnu::always_inline]] Lanes numbers(const Of& value) const
    {
        return detail::lanes_from<Lanes>([&](int k) { return value(of[k]); });
    }
    template <class Of>
    [[gnu::always_inline]] Vec3Lanes vectors(const Of& value) const
    {
        return detail::wide_vectors([&](int k) -> const Vec3& { return value(of[k]); });
    }
};

template <class LawOf>
[[gnu::always_inline]] inline void take_law(const Members& m, bool one_law, const LawOf& law_of, PointGroup& g)
{
    detail::take_law(one_law, [&](int k) -> const PairLaw& { return law_of(m[k]); }, g);
}

[[gnu::always_inline]] inline void take_memory(const Members& m, const std::vector<PointMemory>& memory, PointGroup& g)
{
    const auto of = [&](const PointContact& c) -> const PointMemory& { return memory[std::size_t(c.entry)]; };
    g.old_spring = m.vectors([&](const PointContact& c) -> const Vec3& { return of(c).spring; });
    g.old_normal = m.vectors([&](const PointContact& c) -> const Vec3& { return of(c).normal; });
    g.old_total = m.vectors([&](const PointContact& c) -> const Vec3& { return of(c).total; });
    g.old_overlap = m.numbers([&](const PointContact& c) { return of(c).overlap; });
}

/// Sums over the contacts of a block, lane by lane: added up at its end.
struct LaneSums {
    Lanes stored_normal = all<Lanes>(0.0), stored_tangential = stored_normal, friction = stored_normal, damping = stored_normal;
    Lanes deep = stored_normal, deepest = stored_normal, deepest_smaller = all<Lanes>(1.0);  ///< deepest: overlap of the deepest over its radius
    void add(const Members& m, const PointGroup& g, const PointResult& r, double cap)
    {
        const Lanes zero = all<Lanes>(0.0), number = detail::lanes_from<Lanes>([](int k) { return k; });
        const Lanes there = number < all<Lanes>(double(m.count)) ? all<Lanes>(1.0) : zero;
        stored_normal += there * r.stored_normal;
        stored_tangential += there * r.stored_tangential;
        friction += there * r.friction;
        damping += there * r.damping;
        const auto deeper = there * g.overlap * deepest_smaller > deepest * g.smaller;
        deepest = deeper ? g.overlap : deepest;
        deepest_smaller = deeper ? g.smaller : deepest_smaller;
        deep += g.overlap > cap * g.smaller ? there : zero;
    }
    void add_to(LoopSums& s) const
    {
        using detail::sum;
        s.elastic_normal += sum(stored_normal);
        s.elastic_tangential += sum(stored_tangential);
        s.friction += sum(friction);
        s.damping += sum(damping);
        s.deep += std::int64_t(sum(deep));
        for (int k = 0; k < lane_count; ++k) s.max_overlap = std::max(s.max_overlap, deepest[k] / deepest_smaller[k]);
    }
};

[[gnu::always_inline]] inline void put_back(const Members& m, const PointGroup& g, const PointResult& r, std::vector<PointMemory>& memory,
                                            std::vector<std::uint8_t>& touch)
{
    for (int k = 0; k < m.count; ++k) {
        const std::size_t e = std::size_t(m[k].entry);
        memory[e] = {detail::lane(r.spring, k), detail::lane(g.normal, k), detail::lane(r.total, k), g.overlap[k]};
        touch[e] = r.force[k] > 0.0 ? 1 : 2;
    }
}

/// A contact that has just opened: the last half step of its forces, and the springs it takes along.
struct Opening {
    Index a, b;
    const PairLaw& law;
    Vec3 relative, spin, normal;  ///< spin: arms times spins as they were, summed
    double overlap, approach, root_mass;
};
void open_contact(const Opening& o, PointMemory& memory, std::uint8_t& touch, bool facing, double cap, double dt, std::vector<Crossing>& crossing,
                  LoopSums& s)
{
    const Vec3 full = o.relative - o.spin.cross(memory.normal), slide = full - full.dot(memory.normal) * memory.normal;
    const double pressed = std::min(memory.overlap, cap);
    const Vec3 drag = memory.total - o.law.kn * pressed * memory.normal + o.law.spring() * memory.spring;
    if (touch == 2 || !facing) s.damping += o.law.kn * pressed * (memory.overlap - 0.5 * pressed);
    else s.damping -= 0.5 * dt * drag.dot(full);
    if (o.law.friction > 0.0) s.friction += 0.5 * o.law.kt * (memory.spring.squaredNorm() + dt * memory.spring.dot(slide));
    if (facing && touch == 1 && dt > 0.0)
        detail::add_crossing(crossing, o.a, o.b, o.law, memory.overlap, o.overlap, o.approach, o.root_mass, dt, o.normal, s);
    memory = {};
    touch = 0;
}

/// Overlap with a wall at the start of a step that went `way`, from what it is at the end.
double overlap_before(const WallData& wall, const Vec3& x, const Vec3& way, const Vec3& normal, double overlap)
{
    if (wall.kind != WallData::Kind::cylinder) return overlap + way.dot(normal);
    Vec3 gradient;
    return overlap + wall.distance_and_gradient(x, gradient) - wall.distance_and_gradient(x - way, gradient);
}

/// One block of a loop: what its passes share.
struct Block {
    World::Impl& world;
    double dt;
    std::vector<Crossing>& crossing;
    LoopSums sums = {};
    LaneSums of_lanes = {};

    void close(const PointContact* begin, const PointContact* end, std::size_t tests)
    {
        of_lanes.add_to(sums);
        sums.tests = std::int64_t(tests);
        sums.touching = end - begin;
    }
};

[[gnu::always_inline]] inline Vec3Lanes take(const Members& m, const std::vector<Vec3>& field, Index PointContact::*of)
{
    return m.vectors([&](const PointContact& c) -> const Vec3& { return field[std::size_t(c.*of)]; });
}
[[gnu::always_inline]] inline Lanes take(const Members& m, const std::vector<double>& field, Index PointContact::*of)
{
    return m.numbers([&](const PointContact& c) { return field[std::size_t(c.*of)]; });
}

void open_spheres(Block& block, std::size_t k)
{
    World::Impl& w = block.world;
    SphereList& l = w.spheres;
    const std::size_t i = std::size_t(l.one[k]), j = std::size_t(l.other[k]);
    const Vec3 d = w.periodic(w.x[i] - w.x[j]), n = d / d.norm();
    const double half = 0.5 * l.memory[k].overlap, cap = w.options.overlap_cap * std::min(w.radius[i], w.radius[j]);
    const Opening opening{Index(i),
                          Index(j),
                          w.law(w.material[i], w.material[j]),
                          w.v[i] - w.v[j],
                          (w.radius[i] - half) * w.w[i] + (w.radius[j] - half) * w.w[j],
                          n,
                          w.radius[i] + w.radius[j] - d.norm(),
                          (w.v_end[j] - w.v_end[i]).dot(n),
                          l.root_mass[k]};
    open_contact(opening, l.memory[k], l.touch[k], true, cap, block.dt, block.crossing, block.sums);
}

/// Pairs first..last that touch, to `touching`. \returns their end
PointContact* find_spheres(Block& block, std::size_t first, std::size_t last, PointContact* touching)
{
    const World::Impl& w = block.world;
    const SphereList& l = w.spheres;
    for (std::size_t k = first; k < last; k += lane_count) {
        const int count = int(std::min(last - k, std::size_t(lane_count)));
        const Index *one = &l.one[k], *other = &l.other[k];
        Index filled[2][lane_count];
        if (count < lane_count) {
            for (int lane = 0; lane < lane_count; ++lane) filled[0][lane] = one[lane < count ? lane : 0], filled[1][lane] = other[lane < count ? lane : 0];
            one = filled[0], other = filled[1];
        }
        const Vec3Lanes d = w.periodic(detail::wide_vectors([&](int lane) -> const Vec3& { return w.x[std::size_t(one[lane])]; }) -
                                       detail::wide_vectors([&](int lane) -> const Vec3& { return w.x[std::size_t(other[lane])]; }));
        const Lanes reach = detail::lanes_from<Lanes>([&](int lane) { return w.radius[std::size_t(one[lane])] + w.radius[std::size_t(other[lane])]; });
        const unsigned present = (1u << count) - 1u, near = present & detail::bits(detail::dot(d, d) < reach * reach);
        for (unsigned left = near; left != 0; left &= left - 1) {
            const int lane = std::countr_zero(left);
            *touching++ = {one[lane], other[lane], Index(k) + lane};
        }
        for (unsigned left = present & ~near; left != 0; left &= left - 1)
            if (const std::size_t pair = k + std::size_t(std::countr_zero(left)); l.touch[pair] != 0) open_spheres(block, pair);
    }
    return touching;
}

void press_spheres(Block& block, const PointContact* begin, const PointContact* end)
{
    World::Impl& w = block.world;
    SphereList& l = w.spheres;
    const double cap = w.options.overlap_cap, dt = block.dt;
    const Lanes none = all<Lanes>(0.0), unit = all<Lanes>(1.0);
    for (const PointContact* at = begin; at < end; at += lane_count) {
        const Members m(at, end - at);
        const auto law_of = [&](const PointContact& c) -> const PairLaw& { return w.law(w.material[std::size_t(c.a)], w.material[std::size_t(c.b)]); };
        PointGroup g;
        take_law(m, w.laws.size() == 1, law_of, g);
        take_memory(m, l.memory, g);
        g.relative = take(m, w.v, &PointContact::a) - take(m, w.v, &PointContact::b);
        g.spin_a = take(m, w.w, &PointContact::a);
        g.spin_b = take(m, w.w, &PointContact::b);
        g.radius_a = take(m, w.radius, &PointContact::a);
        g.radius_b = take(m, w.radius, &PointContact::b);
        g.smaller = detail::min(g.radius_a, g.radius_b);
        g.share = all<Lanes>(0.5);
        g.root_mass = take(m, l.root_mass, &PointContact::entry);
        const Vec3Lanes d = w.periodic(take(m, w.x, &PointContact::a) - take(m, w.x, &PointContact::b));
        const Lanes length = detail::sqrt(detail::dot(d, d)), inverse = length > none ? unit / (length > none ? length : unit) : none;
        g.normal = inverse * d;
        g.normal.z = length > none ? g.normal.z : unit;
        g.overlap = g.radius_a + g.radius_b - length;
        g.approach = detail::dot(take(m, w.v_end, &PointContact::b) - take(m, w.v_end, &PointContact::a), g.normal);
        const PointResult r = detail::point_law(g, cap, dt);
        for (int k = 0; k < m.count; ++k)
            if (l.touch[m[k].entry] == 0 && dt > 0.0) {
                const Vec3 past = detail::lane(d, k) - dt * detail::lane(g.relative, k);
                detail::add_crossing(block.crossing, m[k].a, m[k].b, law_of(m[k]), g.radius_a[k] + g.radius_b[k] - past.norm(), g.overlap[k],
                                     g.approach[k], g.root_mass[k], dt, detail::lane(g.normal, k), block.sums);
            }
        put_back(m, g, r, l.memory, l.touch);
        block.of_lanes.add(m, g, r, cap);
    }
}

/// The same of spheres at walls, whose normals and overlaps stay in the list.
PointContact* find_at_walls(Block& block, std::size_t first, std::size_t last, PointContact* touching)
{
    World::Impl& w = block.world;
    SphereWallList& l = w.sphere_walls;
    for (std::size_t k = first; k < last; ++k) {
        const std::size_t i = std::size_t(l.body[k]);
        const WallData& wall = w.walls[std::size_t(l.wall[k])];
        Vec3 n = wall.normal;
        double distance = 0.0;
        bool facing = true;
        if (wall.kind == WallData::Kind::plane) distance = n.dot(w.x[i] - wall.point);
        else if (wall.kind == WallData::Kind::plate) facing = wall.plate.feature(l.feature[k], w.x[i], distance, n);
        else distance = wall.distance_and_gradient(w.x[i], n);
        const double overlap = facing ? w.radius[i] - distance : -1.0;
        if (overlap > 0.0) {
            l.near_normal[k] = n;
            l.near_overlap[k] = overlap;
            *touching++ = {Index(i), -1 - l.wall[k], Index(k)};
        } else if (l.touch[k] != 0) {
            open_contact({Index(i), -1 - l.wall[k], w.law(w.material[i], wall.material), w.v[i] - wall.velocity, (w.radius[i] - l.memory[k].overlap) * w.w[i],
                          n, overlap, (wall.velocity - w.v_end[i]).dot(n), std::sqrt(w.mass[i])},
                         l.memory[k], l.touch[k], facing, w.options.overlap_cap * w.radius[i], block.dt, block.crossing, block.sums);
        }
    }
    return touching;
}

void press_at_walls(Block& block, const PointContact* begin, const PointContact* end)
{
    World::Impl& w = block.world;
    SphereWallList& l = w.sphere_walls;
    const double cap = w.options.overlap_cap, dt = block.dt;
    const Lanes none = all<Lanes>(0.0);
    for (const PointContact* at = begin; at < end; at += lane_count) {
        const Members m(at, end - at);
        const auto wall_of = [&](const PointContact& c) -> const WallData& { return w.walls[std::size_t(-1 - c.b)]; };
        const auto law_of = [&](const PointContact& c) -> const PairLaw& { return w.law(w.material[std::size_t(c.a)], wall_of(c).material); };
        const Vec3Lanes wall_velocity = m.vectors([&](const PointContact& c) -> const Vec3& { return wall_of(c).velocity; });
        PointGroup g;
        take_law(m, w.laws.size() == 1, law_of, g);
        take_memory(m, l.memory, g);
        g.relative = take(m, w.v, &PointContact::a) - wall_velocity;
        g.spin_a = take(m, w.w, &PointContact::a);
        g.spin_b = {none, none, none};
        g.radius_a = g.smaller = take(m, w.radius, &PointContact::a);
        g.radius_b = none;
        g.share = all<Lanes>(1.0);
        g.root_mass = detail::sqrt(take(m, w.mass, &PointContact::a));
        g.normal = take(m, l.near_normal, &PointContact::entry);
        g.overlap = take(m, l.near_overlap, &PointContact::entry);
        g.approach = detail::dot(wall_velocity - take(m, w.v_end, &PointContact::a), g.normal);
        const PointResult r = detail::point_law(g, cap, dt);
        for (int k = 0; k < m.count; ++k)
            if (l.touch[m[k].entry] == 0 && dt > 0.0) {
                const Vec3 n = detail::lane(g.normal, k), way = dt * detail::lane(g.relative, k);
                const double past = overlap_before(wall_of(m[k]), w.x[std::size_t(m[k].a)], way, n, g.overlap[k]);
                detail::add_crossing(block.crossing, m[k].a, m[k].b, law_of(m[k]), past, g.overlap[k], g.approach[k], g.root_mass[k], dt, n, block.sums);
            }
        put_back(m, g, r, l.memory, l.touch);
        block.of_lanes.add(m, g, r, cap);
    }
}

}  // namespace

void World::Impl::sphere_loop(double dt)
{
    parallel_blocks(spheres.block_count(), 1, [&](std::size_t b, std::size_t) {
        Block block{*this, dt, crossings[b]};
        const std::size_t first = std::size_t(spheres.row[std::size_t(spheres.block[b])]), last = std::size_t(spheres.row[std::size_t(spheres.block[b + 1])]);
        PointContact* const begin = spheres.out_of(b);
        PointContact* const end = find_spheres(block, first, last, begin);
        press_spheres(block, begin, end);
        block.close(begin, end, last - first);
        out_count[0][b] = std::int32_t(end - begin);
        block_sums[b] = block.sums;
    });
}

void World::Impl::sphere_wall_loop(double dt)
{
    const std::size_t base = out_count[0].size();
    parallel_blocks(sphere_walls.body.size(), entry_grain, [&](std::size_t first, std::size_t last) {
        const std::size_t b = first / entry_grain;
        Block block{*this, dt, crossings[base + b]};
        PointContact* const begin = sphere_walls.out.data() + first;
        PointContact* const end = find_at_walls(block, first, last, begin);
        press_at_walls(block, begin, end);
        block.close(begin, end, last - first);
        out_count[1][b] = std::int32_t(end - begin);
        block_sums[base + b] = block.sums;
    });
}

}  // namespace coral::dem
