// Contact loops of spheres against spheres and walls, in closed form. A first pass finds who touches, a second takes them four at a time.
// Each block of the loop writes its touching contacts into its own part of `out`; sums are taken later, in order.
#include <cmath>

#include "core/parallel.h"
#include "dem/detail/crossing.h"
#include "dem/detail/impl.h"
#include "dem/detail/point_contact.h"

namespace coral::dem {

namespace {

using detail::all;
using detail::gather;
using detail::lane_count;
using detail::Lanes;
using detail::PointGroup;
using detail::PointResult;

/// Who a group is made of: `b` counts bodies or walls.
struct Members {
    int count = 0;
    Index entry[lane_count], a[lane_count], b[lane_count];
    const PairLaw* law[lane_count];
    void fill_up()
    {
        for (int k = count; k < lane_count; ++k) entry[k] = entry[0], a[k] = a[0], b[k] = b[0], law[k] = law[0];
    }
    template <class Of>
    Lanes numbers(const Of& of) const
    {
        return Lanes{of(0), of(1), of(2), of(3)};
    }
    template <class Of>
    detail::Vec3Lanes vectors(const Of& of) const
    {
        return gather(of(0), of(1), of(2), of(3));
    }
};

void take_law(const Members& m, PointGroup& g)
{
    if (m.law[0] == m.law[1] && m.law[0] == m.law[2] && m.law[0] == m.law[3]) {
        const PairLaw& law = *m.law[0];
        g.kn = all(law.kn), g.kt = all(law.friction > 0.0 ? law.kt : 0.0), g.friction = all(law.friction), g.cn = all(law.cn), g.ct = all(law.ct);
        return;
    }
    g.kn = m.numbers([&](int k) { return m.law[k]->kn; });
    g.kt = m.numbers([&](int k) { return m.law[k]->friction > 0.0 ? m.law[k]->kt : 0.0; });
    g.friction = m.numbers([&](int k) { return m.law[k]->friction; });
    g.cn = m.numbers([&](int k) { return m.law[k]->cn; });
    g.ct = m.numbers([&](int k) { return m.law[k]->ct; });
}

void take_memory(const Members& m, const std::vector<PointMemory>& memory, const std::vector<std::uint8_t>& touch, PointGroup& g)
{
    const PointMemory* of[lane_count];
    for (int k = 0; k < lane_count; ++k) of[k] = &memory[std::size_t(m.entry[k])];
    g.old_spring = m.vectors([&](int k) -> const Vec3& { return of[k]->spring; });
    g.old_normal = m.vectors([&](int k) -> const Vec3& { return of[k]->normal; });
    g.old_drag = m.vectors([&](int k) -> const Vec3& { return of[k]->drag; });
    g.old_overlap = m.numbers([&](int k) { return of[k]->overlap; });
    g.touched = m.numbers([&](int k) { return touch[std::size_t(m.entry[k])] != 0 ? 1.0 : 0.0; });
}

/// Sums over the contacts of a block, lane by lane: added up at its end.
struct LaneSums {
    Lanes stored_normal = all(0.0), stored_tangential = all(0.0), friction = all(0.0), damping = all(0.0), depth = all(0.0), deep = all(0.0);
    void add(const Members& m, const PointGroup& g, const PointResult& r, double cap)
    {
        const Lanes zero = all(0.0), one = all(1.0), there = Lanes{0.0, 1.0, 2.0, 3.0} < all(double(m.count)) ? one : zero;
        stored_normal += there * r.stored_normal;
        stored_tangential += there * r.stored_tangential;
        friction += there * r.friction;
        damping += there * r.damping;
        const Lanes relative = g.overlap / g.smaller;
        depth = detail::max(depth, there * relative);
        deep += relative > all(cap) ? there : zero;
    }
    void add_to(LoopSums& s) const
    {
        using detail::sum;
        s.elastic_normal += sum(stored_normal);
        s.elastic_tangential += sum(stored_tangential);
        s.friction += sum(friction);
        s.damping += sum(damping);
        s.deep += std::int64_t(sum(deep));
        for (int k = 0; k < lane_count; ++k) s.max_overlap = std::max(s.max_overlap, depth[k]);
    }
};

/// Memory and `out` of a group; `b_id` turns members into what PointForce calls b.
template <class Id>
void put_back(const Members& m, const PointGroup& g, const PointResult& r, const Id& b_id, std::vector<PointMemory>& memory,
              std::vector<std::uint8_t>& touch, PointForce*& out)
{
    const detail::Vec3Lanes total = r.force * g.normal + r.tangential, moment = detail::cross(g.normal, r.tangential);
    for (int k = 0; k < m.count; ++k) {
        const std::size_t e = std::size_t(m.entry[k]);
        const Vec3 normal = detail::lane(g.normal, k);
        memory[e] = {detail::lane(r.spring, k), normal, detail::lane(r.drag, k), g.overlap[k]};
        touch[e] = r.force[k] > 0.0 ? 1 : 2;
        *out++ = {m.a[k], b_id(m.b[k]), m.entry[k], detail::lane(total, k), detail::lane(moment, k), r.force[k], g.overlap[k], r.arm_a[k], r.arm_b[k]};
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
    if (touch == 2 || !facing) s.damping += o.law.kn * pressed * (memory.overlap - 0.5 * pressed);
    else s.damping -= 0.5 * dt * memory.drag.dot(full);
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

}  // namespace

void World::Impl::sphere_loop(double dt)
{
    SphereList& l = spheres;
    parallel_blocks(l.rows.size(), row_grain, [&](std::size_t first, std::size_t last) {
        const std::size_t block = first / row_grain;
        LoopSums s;
        LaneSums sums_of_lanes;
        std::vector<Crossing>& crossing = crossings[block];
        const Index from = l.row[first];
        PointForce* const begin = l.out.data() + from;
        PointForce* out = begin;

        Index touching = from;
        for (std::size_t r = first; r < last; ++r) {
            const std::size_t i = std::size_t(l.rows[r]);
            const Vec3 xi = x[i];
            const double ri = radius[i];
            for (Index k = l.row[r]; k < l.row[r + 1]; ++k) {
                const std::size_t j = std::size_t(l.other[k]);
                const double reach = ri + radius[j], d2 = periodic(xi - x[j]).squaredNorm();
                if (d2 < reach * reach) {
                    l.near[touching] = k;
                    l.near_row[touching++] = Index(i);
                } else if (l.touch[k] != 0) {
                    PointMemory& memory = l.memory[k];
                    const Vec3 d = periodic(xi - x[j]), n = d / d.norm();
                    const Vec3 spin = (ri - 0.5 * memory.overlap) * w[i] + (radius[j] - 0.5 * memory.overlap) * w[j];
                    open_contact({Index(i), Index(j), law(material[i], material[j]), v[i] - v[j], spin, n, reach - d.norm(), (v_end[j] - v_end[i]).dot(n),
                                  l.root_mass[k]},
                                 memory, l.touch[k], true, options.overlap_cap * std::min(ri, radius[j]), dt, crossing, s);
                }
            }
        }

        for (Index at = from; at < touching; at += lane_count) {
            Members m;
            m.count = std::min(int(touching - at), lane_count);
            for (int k = 0; k < m.count; ++k) {
                m.entry[k] = l.near[at + k];
                m.a[k] = l.near_row[at + k];
                m.b[k] = l.other[m.entry[k]];
                m.law[k] = &law(material[std::size_t(m.a[k])], material[std::size_t(m.b[k])]);
            }
            m.fill_up();
            const auto of_a = [&](const std::vector<Vec3>& field) { return m.vectors([&](int k) -> const Vec3& { return field[std::size_t(m.a[k])]; }); };
            const auto of_b = [&](const std::vector<Vec3>& field) { return m.vectors([&](int k) -> const Vec3& { return field[std::size_t(m.b[k])]; }); };
            PointGroup g;
            take_law(m, g);
            take_memory(m, l.memory, l.touch, g);
            g.relative = of_a(v) - of_b(v);
            g.spin_a = of_a(w);
            g.spin_b = of_b(w);
            g.radius_a = m.numbers([&](int k) { return radius[std::size_t(m.a[k])]; });
            g.radius_b = m.numbers([&](int k) { return radius[std::size_t(m.b[k])]; });
            g.smaller = detail::min(g.radius_a, g.radius_b);
            g.share = all(0.5);
            g.root_mass = m.numbers([&](int k) { return l.root_mass[m.entry[k]]; });
            const detail::Vec3Lanes d = periodic(of_a(x) - of_b(x));
            const Lanes length = detail::sqrt(detail::dot(d, d)), none = all(0.0), one = all(1.0);
            const Lanes inverse = length > none ? one / (length > none ? length : one) : none;
            g.normal = inverse * d;
            g.normal.z = length > none ? g.normal.z : one;
            g.overlap = g.radius_a + g.radius_b - length;
            g.approach = detail::dot(of_b(v_end) - of_a(v_end), g.normal);
            const PointResult r = detail::point_law(g, options.overlap_cap, dt);
            for (int k = 0; k < m.count; ++k)
                if (l.touch[m.entry[k]] == 0 && dt > 0.0) {
                    const Vec3 past = detail::lane(d, k) - dt * detail::lane(g.relative, k);
                    detail::add_crossing(crossing, m.a[k], m.b[k], *m.law[k], g.radius_a[k] + g.radius_b[k] - past.norm(), g.overlap[k], g.approach[k],
                                         g.root_mass[k], dt, detail::lane(g.normal, k), s);
                }
            put_back(m, g, r, [](Index b) { return b; }, l.memory, l.touch, out);
            sums_of_lanes.add(m, g, r, options.overlap_cap);
        }
        sums_of_lanes.add_to(s);
        s.tests = l.row[last] - from;
        s.touching = out - begin;
        out_count[0][block] = std::int32_t(out - begin);
        block_sums[block] = s;
    });
}

void World::Impl::sphere_wall_loop(double dt)
{
    SphereWallList& l = sphere_walls;
    const std::size_t base = out_count[0].size();
    parallel_blocks(l.body.size(), entry_grain, [&](std::size_t first, std::size_t last) {
        const std::size_t block = first / entry_grain;
        LoopSums s;
        LaneSums sums_of_lanes;
        std::vector<Crossing>& crossing = crossings[base + block];
        PointForce* const begin = l.out.data() + first;
        PointForce* out = begin;

        std::size_t touching = first;
        for (std::size_t k = first; k < last; ++k) {
            const std::size_t i = std::size_t(l.body[k]);
            const WallData& wall = walls[std::size_t(l.wall[k])];
            Vec3 n = wall.normal;
            double distance = 0.0;
            bool facing = true;
            if (wall.kind == WallData::Kind::plane) distance = n.dot(x[i] - wall.point);
            else if (wall.kind == WallData::Kind::plate) facing = wall.plate.feature(l.feature[k], x[i], distance, n);
            else distance = wall.distance_and_gradient(x[i], n);
            const double overlap = facing ? radius[i] - distance : -1.0;
            if (overlap > 0.0) {
                l.near[touching] = Index(k);
                l.near_normal[touching] = n;
                l.near_overlap[touching++] = overlap;
            } else if (l.touch[k] != 0) {
                open_contact({Index(i), -1 - l.wall[k], law(material[i], wall.material), v[i] - wall.velocity, (radius[i] - l.memory[k].overlap) * w[i], n,
                              overlap, (wall.velocity - v_end[i]).dot(n), std::sqrt(mass[i])},
                             l.memory[k], l.touch[k], facing, options.overlap_cap * radius[i], dt, crossing, s);
            }
        }

        for (std::size_t at = first; at < touching; at += lane_count) {
            Members m;
            m.count = int(std::min(touching - at, std::size_t(lane_count)));
            std::size_t place[lane_count];
            for (int k = 0; k < lane_count; ++k) place[k] = at + std::size_t(k < m.count ? k : 0);
            for (int k = 0; k < m.count; ++k) {
                m.entry[k] = l.near[place[k]];
                m.a[k] = l.body[m.entry[k]];
                m.b[k] = l.wall[m.entry[k]];
                m.law[k] = &law(material[std::size_t(m.a[k])], walls[std::size_t(m.b[k])].material);
            }
            m.fill_up();
            const auto of_a = [&](const std::vector<Vec3>& field) { return m.vectors([&](int k) -> const Vec3& { return field[std::size_t(m.a[k])]; }); };
            const auto wall_velocity = m.vectors([&](int k) -> const Vec3& { return walls[std::size_t(m.b[k])].velocity; });
            PointGroup g;
            take_law(m, g);
            take_memory(m, l.memory, l.touch, g);
            g.relative = of_a(v) - wall_velocity;
            g.spin_a = of_a(w);
            g.spin_b = {all(0.0), all(0.0), all(0.0)};
            g.radius_a = g.smaller = m.numbers([&](int k) { return radius[std::size_t(m.a[k])]; });
            g.radius_b = all(0.0);
            g.share = all(1.0);
            g.root_mass = detail::sqrt(m.numbers([&](int k) { return mass[std::size_t(m.a[k])]; }));
            g.normal = m.vectors([&](int k) -> const Vec3& { return l.near_normal[place[k]]; });
            g.overlap = m.numbers([&](int k) { return l.near_overlap[place[k]]; });
            g.approach = detail::dot(wall_velocity - of_a(v_end), g.normal);
            const PointResult r = detail::point_law(g, options.overlap_cap, dt);
            for (int k = 0; k < m.count; ++k)
                if (l.touch[m.entry[k]] == 0 && dt > 0.0) {
                    const Vec3 n = detail::lane(g.normal, k), way = dt * detail::lane(g.relative, k);
                    const double past = overlap_before(walls[std::size_t(m.b[k])], x[std::size_t(m.a[k])], way, n, g.overlap[k]);
                    detail::add_crossing(crossing, m.a[k], -1 - m.b[k], *m.law[k], past, g.overlap[k], g.approach[k], g.root_mass[k], dt, n, s);
                }
            put_back(m, g, r, [](Index b) { return -1 - b; }, l.memory, l.touch, out);
            sums_of_lanes.add(m, g, r, options.overlap_cap);
        }
        sums_of_lanes.add_to(s);
        s.tests = std::int64_t(last - first);
        s.touching = out - begin;
        out_count[1][block] = std::int32_t(out - begin);
        block_sums[base + block] = s;
    });
}

}  // namespace coral::dem
