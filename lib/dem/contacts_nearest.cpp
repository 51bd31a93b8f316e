// Contact of spheres with the nearest wall of a grid or polyhedron: one query of the distance at the centre, then a register full at a time.
#include <cmath>
#include <cstddef>

#include "dem/detail/law_lanes.h"
#include "dem/detail/nearest_walls.h"

namespace coral::dem::detail {

namespace {

using V = WideLanes;
using Vectors = WideVec3Lanes;

/// Slot of the wall with this normal (frame of the grid), or a new one.
int slot_of(Slots& slots, const Vec3& normal)
{
    for (int k = 0; k < Slots::nearest; ++k)
        if ((slots.used >> k & 1) && slots.normal[k].dot(normal) > Slots::same_wall) {
            slots.normal[k] = normal;
            return k;
        }
    int k = 0;
    while (k < Slots::nearest && (slots.used >> k & 1)) ++k;
    if (k == Slots::nearest) {
        k = slots.next;
        slots.next = std::uint8_t((slots.next + 1) % Slots::nearest);
    }
    slots.used = std::uint8_t(slots.used | 1 << k);
    slots.spring[k].setZero();
    slots.normal[k] = normal;
    return k;
}

/// Whether a touching sphere has another wall than in the last step: its normal has turned by more than a surface under it can.
bool changes_wall(const Slots& slots, const Vec3& normal)
{
    constexpr double least = 0.995;  // cosine of 6 degrees
    if (slots.used == 0) return false;
    for (int k = 0; k < Slots::count; ++k)
        if ((slots.used >> k & 1) && slots.normal[k].dot(normal) < least) return true;
    return false;
}

/// Wrench of a force; arm_b from the other body's centre.
struct WrenchLanes {
    Vectors force, torque_a, torque_b;
    V power(const Vectors& velocity, const Vectors& spin_a, const Vectors& spin_b) const
    {
        return dot(force, velocity) + dot(torque_a, spin_a) + dot(torque_b, spin_b);
    }
};
WrenchLanes wrench(const Vectors& force, const Vectors& arm_a, const Vectors& arm_b) { return {force, cross(arm_a, force), cross(force, arm_b)}; }

/// PressMemory of the lanes.
struct Memory {
    WrenchLanes push, pull, drag;
    V stored, stretched;
};
static_assert(offsetof(PressMemory, stored) == 27 * sizeof(double) && offsetof(PressMemory, stretched) == 28 * sizeof(double));

template <class At>
[[gnu::always_inline]] inline Memory take_memory(const At& at)
{
    const auto four = [&](int n) { return wide_fours([&](int k) { return at(k).push.force.data() + 4 * n; }); };
    const WideFours f0 = four(0), f1 = four(1), f2 = four(2), f3 = four(3), f4 = four(4), f5 = four(5), f6 = four(6);
    return {{{f0.a, f0.b, f0.c}, {f0.d, f1.a, f1.b}, {f1.c, f1.d, f2.a}},
            {{f2.b, f2.c, f2.d}, {f3.a, f3.b, f3.c}, {f3.d, f4.a, f4.b}},
            {{f4.c, f4.d, f5.a}, {f5.b, f5.c, f5.d}, {f6.a, f6.b, f6.c}},
            f6.d,
            lanes_from<V>([&](int k) { return at(k).stretched; })};
}

template <class At>
[[gnu::always_inline]] inline void put_memory(const Memory& m, const At& at)
{
    const auto put = [&](int n, V a, V b, V c, V d) { put_fours({a, b, c, d}, [&](int k) { return at(k).push.force.data() + 4 * n; }); };
    const auto &[pf, pa, pb] = m.push;
    const auto &[qf, qa, qb] = m.pull;
    const auto &[df, da, db] = m.drag;
    put(0, pf.x, pf.y, pf.z, pa.x);
    put(1, pa.y, pa.z, pb.x, pb.y);
    put(2, pb.z, qf.x, qf.y, qf.z);
    put(3, qa.x, qa.y, qa.z, qb.x);
    put(4, qb.y, qb.z, df.x, df.y);
    put(5, df.z, da.x, da.y, da.z);
    put(6, db.x, db.y, db.z, m.stored);
    for (int k = 0; k < wide_lane_count; ++k) at(k).stretched = m.stretched[k];
}

}  // namespace

/// What presses on the spheres that were found.
struct NearestWalls::Pressed {
    Vectors offset, normal, relative, spin_a, spin_b, old_spin_b;
    V overlap, radius, deep;
    V force;                       ///< along the normal
    Vectors tangential, arm_a, arm_b, spring;
    V next_number;                 ///< what lies behind the spring in memory
    Memory now;
};

bool NearestWalls::find(std::size_t k, GeneralForce& out)
{
    SphereGridList& l = w_.sphere_grids;
    const std::size_t i = std::size_t(l.sphere[k]), j = std::size_t(l.grid[k]);
    const DistanceField field(*w_.shapes[std::size_t(w_.shape[j])]);
    Found& f = found_[count_];
    f.offset = w_.periodic(w_.x[i] - w_.x[j]);
    Vec3 gradient;
    f.overlap = w_.radius[i] - w_.scale[j] * field.distance_and_gradient(w_.q[j].conjugate() * f.offset / w_.scale[j], gradient, l.press[k].cell);
    if (!(f.overlap > 0.0)) {
        if (l.touch[k] != 0) open(k, out);
        return false;
    }
    f.slope = gradient.norm();
    f.normal = f.slope > 1e-9 ? Vec3(gradient / f.slope) : Vec3::UnitZ();
    f.entry = k;
    f.out = &out;
    Slots& slots = l.slots[k];
    const bool turned = changes_wall(slots, f.normal);
    f.spring = slots.spring[slot_of(slots, f.normal)].data();
    if (turned && w_.options.sphere_scheme == SphereScheme::automatic && field.grid) w_.make_pocket_here(k);
    if (++count_ == wide_lane_count) press();
    return true;
}

void NearestWalls::open(std::size_t k, GeneralForce& out)
{
    SphereGridList& l = w_.sphere_grids;
    l.slots[k].used = 0;
    out = {};
    out.a = l.sphere[k];
    out.b = l.grid[k];
    PressMemory now;
    now.cell = l.press[k].cell;
    w_.close_books(k, now, false, dt_, out, sums_, crossing_);
}

void NearestWalls::press()
{
    if (count_ == 0) return;
    const SphereGridList& l = w_.sphere_grids;
    std::size_t sphere[wide_lane_count], grid[wide_lane_count];
    for (int k = 0; k < wide_lane_count; ++k) {
        if (k >= count_) found_[k] = found_[0];
        sphere[k] = std::size_t(l.sphere[found_[k].entry]);
        grid[k] = std::size_t(l.grid[found_[k].entry]);
    }
    const Pressed p = forces(sphere, grid);
    put_out(p);
    keep_books(p);
    count_ = 0;
}

NearestWalls::Pressed NearestWalls::forces(const std::size_t* i, const std::size_t* j) const
{
    const V zero = all<V>(0.0), half = all<V>(0.5), one = all<V>(1.0);
    const auto vectors = [](const std::vector<Vec3>& field, const std::size_t* of) { return wide_vectors([&](int k) -> const Vec3& { return field[of[k]]; }); };
    const auto numbers = [](const std::vector<double>& field, const std::size_t* of) { return lanes_from<V>([&](int k) { return field[of[k]]; }); };
    const auto law_of = [&](int k) -> const PairLaw& { return w_.law(w_.material[i[k]], w_.material[j[k]]); };
    bool same = true;
    for (int k = 1; k < wide_lane_count; ++k) same = same && w_.material[i[k]] == w_.material[i[0]] && w_.material[j[k]] == w_.material[j[0]];
    LawLanes law;
    take_law(same, law_of, law);

    Pressed p;
    p.offset = wide_vectors([&](int k) -> const Vec3& { return found_[k].offset; });
    p.overlap = lanes_from<V>([&](int k) { return found_[k].overlap; });
    p.relative = vectors(w_.v, i) - vectors(w_.v, j);
    p.spin_a = vectors(w_.w, i);
    p.spin_b = vectors(w_.w, j);
    p.old_spin_b = vectors(w_.w_before, j);
    p.radius = numbers(w_.radius, i);
    const V cap = all<V>(w_.options.overlap_cap) * p.radius, root_mass = sqrt(one / (numbers(w_.inverse_mass, i) + numbers(w_.inverse_mass, j)));
    p.deep = p.overlap > cap ? one : zero;
    // As quaternions turn a vector.
    const WideFours q = wide_fours([&](int k) { return w_.q[j[k]].coeffs().data(); });
    const Vectors axis{q.a, q.b, q.c}, local = wide_vectors([&](int k) -> const Vec3& { return found_[k].normal; });
    const Vectors across = all<V>(2.0) * cross(axis, local), n = p.normal = local + q.d * across + cross(axis, across);

    const V pressed = min(p.overlap, cap), elastic = law.kn * pressed * lanes_from<V>([&](int k) { return found_[k].slope; });
    const V approach = dot(vectors(w_.v_end, j) + cross(p.spin_b, p.offset) - vectors(w_.v_end, i), n);
    p.force = max(elastic + law.cn * root_mass * approach, zero);
    p.arm_a = (half * p.overlap - p.radius) * n;
    p.arm_b = p.offset + p.arm_a;  // contact point, from the grid's centre
    const Vectors velocity = p.relative + cross(p.spin_a, p.arm_a) - cross(p.spin_b, p.arm_b), slide = velocity - dot(n, velocity) * n;
    const WideFours spring = wide_fours([&](int k) -> const double* { return found_[k].spring; });
    const Rubbed rubbed = rub(law, n, slide, slide, all<V>(0.5 * dt_) * dot(p.spin_a + p.spin_b, n), root_mass, p.force, dt_, {spring.a, spring.b, spring.c});
    p.spring = rubbed.spring;
    p.next_number = spring.d;
    p.tangential = rubbed.total;
    const Vectors pull = (-law.kt) * rubbed.spring, none{zero, zero, zero};
    p.now.push = wrench(elastic * n, none, p.offset);
    p.now.pull = wrench(pull, p.arm_a, p.arm_b);
    p.now.drag = wrench((p.force - elastic) * n + (rubbed.total - pull), p.arm_a, p.arm_b);
    p.now.stored = law.kn * pressed * (p.overlap - half * pressed);
    p.now.stretched = half * law.kt * dot(rubbed.spring, rubbed.spring);
    return p;
}

void NearestWalls::put_out(const Pressed& p) const
{
    const SphereGridList& l = w_.sphere_grids;
    const Vectors push = p.force * p.normal, turn_a = cross(p.arm_a, p.tangential), turn_b = cross(push + p.tangential, p.arm_b);
    static_assert(offsetof(GeneralForce, arm) == offsetof(GeneralForce, overlap) + 13 * sizeof(double));
    const auto put = [&](int n, V a, V b, V c, V d) { put_fours({a, b, c, d}, [&](int k) { return &found_[k].out->overlap + 4 * n; }); };
    put(0, p.overlap, push.x, push.y, push.z);
    put(1, p.tangential.x, p.tangential.y, p.tangential.z, turn_a.x);
    put(2, turn_a.y, turn_a.z, turn_b.x, turn_b.y);
    put(3, turn_b.z, p.arm_a.x, p.arm_a.y, p.arm_a.z);
    for (int k = 0; k < count_; ++k) {
        GeneralForce& out = *found_[k].out;
        out.a = l.sphere[found_[k].entry];
        out.b = l.grid[found_[k].entry];
        out.points = 1;
    }
    put_fours({p.spring.x, p.spring.y, p.spring.z, p.next_number}, [&](int k) { return found_[k].spring; });
}

/// See World::Impl::close_books.
void NearestWalls::keep_books(const Pressed& p)
{
    SphereGridList& l = w_.sphere_grids;
    const V zero = all<V>(0.0), one = all<V>(1.0), half_dt = all<V>(0.5 * dt_);
    const auto memory = [&](int k) -> PressMemory& { return l.press[found_[k].entry]; };
    const Memory past = take_memory(memory);
    const V before = lanes_from<V>([&](int k) { return l.touch[found_[k].entry]; }), owed = lanes_from<V>([&](int k) { return memory(k).owed; });
    const auto touched = before > zero;
    const auto work = [&](const WrenchLanes& first, const WrenchLanes& second) {
        const V earlier = first.power(p.relative, p.spin_a, p.old_spin_b);
        return half_dt * ((touched ? earlier : zero) + second.power(p.relative, p.spin_a, p.spin_b));
    };
    const V was_stored = touched ? past.stored : zero, was_stretched = touched ? past.stretched : zero;
    const V there = lanes_from<V>([](int k) { return k; }) < all<V>(count_) ? one : zero;
    stored_ += there * p.now.stored;
    stretched_ += there * p.now.stretched;
    damping_ -= there * work(past.drag, p.now.drag);
    friction_ -= there * (work(past.pull, p.now.pull) + p.now.stretched - was_stretched);
    deep_ += there * p.deep;
    deepest_ = max(deepest_, p.overlap / p.radius);

    const auto clamped = p.force == zero;
    const Vectors push = p.now.push.force + (touched ? one : zero) * past.push.force;
    const V strength = sqrt(dot(push, push)), error = was_stored - p.now.stored - work(past.push, p.now.push) + (touched ? owed : zero);
    const auto lost = (before == all<V>(2.0)) | clamped | ~(strength > zero), given = ~lost & (max(error, -error) > all<V>(1e-6) * (was_stored + p.now.stored));
    put_memory(p.now, memory);
    const unsigned held = bits(clamped), give = dt_ > 0.0 ? bits(given) : 0u;
    const V kept = lost | given ? zero : error;
    if (dt_ > 0.0) damping_ += lost ? there * error : zero;
    for (int k = 0; k < count_; ++k) {
        const std::size_t entry = found_[k].entry;
        l.touch[entry] = held >> k & 1 ? 2 : 1;
        memory(k).owed = dt_ > 0.0 ? kept[k] : 0.0;
        if (give >> k & 1) crossing_.push_back({l.sphere[entry], l.grid[entry], error[k], lane(push, k) / strength[k], found_[k].offset, Vec3::Zero(), -1, Index(entry)});
    }
}

void NearestWalls::add_sums()
{
    sums_.elastic_normal += sum(stored_);
    sums_.elastic_tangential += sum(stretched_);
    sums_.friction += sum(friction_);
    sums_.damping += sum(damping_);
    sums_.deep += std::int64_t(sum(deep_));
    for (int k = 0; k < wide_lane_count; ++k) sums_.max_overlap = std::max(sums_.max_overlap, deepest_[k]);
}

}  // namespace coral::dem::detail
