// Forces of spheres on grids and polyhedra, and what the nearest wall presses: one query of the distance at the centre.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "dem/detail/law_lanes.h"
#include "dem/detail/presses.h"

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

/// Wrench of the lanes.
struct WrenchLanes {
    Vectors force, torque_a, torque_b;
    void add(const Vectors& f, const Vectors& arm_a, const Vectors& arm_b)
    {
        force = force + f;
        torque_a = torque_a + cross(arm_a, f);
        torque_b = torque_b + cross(f, arm_b);
    }
    V power(const Vectors& velocity, const Vectors& spin_a, const Vectors& spin_b) const
    {
        return dot(force, velocity) + dot(torque_a, spin_a) + dot(torque_b, spin_b);
    }
};
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

/// A group in the lanes, and what comes of it.
struct Presses::Forces {
    LawLanes law;
    Vectors offset, relative, closing, spin_a, spin_b, old_spin_b;  ///< closing: of the bodies, at the end of the step
    WideFours turn;                                                 ///< of the grid
    V radius, root_mass, overlap;
    Vectors normal_force{}, tangential_force{}, arm{};  ///< as in GeneralForce
    V total{};                                          ///< of the normal forces' sizes
    decltype(V{} < V{}) clamped{};
    Memory now{};
};

bool Presses::on_nearest(std::size_t k, const Vec3& offset, const Vec3& local, GeneralForce& out)
{
    SphereGridList& l = w_.sphere_grids;
    const std::size_t i = std::size_t(l.sphere[k]), j = std::size_t(l.grid[k]);
    const DistanceField field(*w_.shapes[std::size_t(w_.shape[j])]);
    Press& p = one_.press[one_.count];
    Vec3 gradient;
    p.overlap = w_.radius[i] - w_.scale[j] * field.distance_and_gradient(local, gradient, l.press[k].cell);
    if (!(p.overlap > 0.0)) {
        if (l.touch[k] != 0) open(k);
        return false;
    }
    const double slope = gradient.norm(), pressed = std::min(p.overlap, w_.options.overlap_cap * w_.radius[i]), kn = w_.law(w_.material[i], w_.material[j]).kn;
    Press::Place& place = p.place[0];
    place.normal = slope > 1e-9 ? Vec3(gradient / slope) : Vec3::UnitZ();
    place.elastic = kn * pressed * slope;
    place.overlap = p.overlap;
    Slots& slots = l.slots[k];
    const bool turned = changes_wall(slots, place.normal);
    place.spring = slots.spring[slot_of(slots, place.normal)].data();
    if (turned && w_.options.sphere_scheme == SphereScheme::automatic && field.grid) w_.make_pocket_here(k);
    p.entry = k;
    p.out = &out;
    p.offset = offset;
    p.stored = kn * pressed * (p.overlap - 0.5 * pressed);
    p.count = 1;
    if (++one_.count == full) work(one_);
    return true;
}

Press& Presses::next(int count)
{
    Group& group = count == 1 ? one_ : several_;
    group.press[group.count].count = count;
    return group.press[group.count];
}

void Presses::add(const Press& press)
{
    Group& group = press.count == 1 ? one_ : several_;
    if (++group.count == full) work(group);
}

void Presses::finish()
{
    work(one_);
    work(several_);
    // What a body is given depends on what it was given before: in the order of the list.
    std::sort(crossing_.begin(), crossing_.end(), [](const Crossing& p, const Crossing& q) { return key_of(p.a, p.b) < key_of(q.a, q.b); });
    sums_.elastic_normal += sum(stored_);
    sums_.elastic_tangential += sum(stretched_);
    sums_.friction += sum(friction_);
    sums_.damping += sum(damping_);
    sums_.deep += std::int64_t(sum(deep_));
    for (int k = 0; k < full; ++k) sums_.max_overlap = std::max(sums_.max_overlap, deepest_[k]);
}

void Presses::work(Group& group)
{
    if (group.count == 0) return;
    for (int k = group.count; k < full; ++k) group.press[k] = group.press[0];
    const Forces f = forces(group.press);
    put_out(group.press, group.count, f);
    keep_books(group.press, group.count, f);
    group.count = 0;
}

Presses::Forces Presses::forces(const Press* press) const
{
    std::size_t i[full], j[full];
    int rounds = 1;
    bool same = true;
    for (int k = 0; k < full; ++k) {
        i[k] = std::size_t(w_.sphere_grids.sphere[press[k].entry]);
        j[k] = std::size_t(w_.sphere_grids.grid[press[k].entry]);
        rounds = std::max(rounds, press[k].count);
        same = same && w_.material[i[k]] == w_.material[i[0]] && w_.material[j[k]] == w_.material[j[0]];
    }
    const auto vectors = [](const std::vector<Vec3>& field, const std::size_t* of) { return wide_vectors([&](int k) -> const Vec3& { return field[of[k]]; }); };
    const auto numbers = [](const std::vector<double>& field, const std::size_t* of) { return lanes_from<V>([&](int k) { return field[of[k]]; }); };
    Forces f;
    take_law(same, [&](int k) -> const PairLaw& { return w_.law(w_.material[i[k]], w_.material[j[k]]); }, f.law);
    f.offset = wide_vectors([&](int k) -> const Vec3& { return press[k].offset; });
    f.relative = vectors(w_.v, i) - vectors(w_.v, j);
    f.spin_a = vectors(w_.w, i);
    f.spin_b = vectors(w_.w, j);
    f.old_spin_b = vectors(w_.w_before, j);
    f.closing = vectors(w_.v_end, j) + cross(f.spin_b, f.offset) - vectors(w_.v_end, i);
    f.turn = wide_fours([&](int k) { return w_.q[j[k]].coeffs().data(); });
    f.radius = numbers(w_.radius, i);
    f.root_mass = sqrt(all<V>(1.0) / (numbers(w_.inverse_mass, i) + numbers(w_.inverse_mass, j)));
    f.overlap = lanes_from<V>([&](int k) { return press[k].overlap; });
    f.now.stored = lanes_from<V>([&](int k) { return press[k].stored; });
    for (int p = 0; p < rounds; ++p) add_place(press, p, f);
    f.now.push.torque_b = cross(f.now.push.force, f.offset);
    const V zero = all<V>(0.0), one = all<V>(1.0);
    f.arm = (f.total > zero ? one / (f.total > zero ? f.total : one) : zero) * f.arm;
    return f;
}

/// Place p of those that have so many.
void Presses::add_place(const Press* press, int p, Forces& f) const
{
    const V zero = all<V>(0.0), half = all<V>(0.5);
    double nowhere[4] = {};  // spring of the others
    const auto place = [&](int k) -> const Press::Place& { return press[k].place[p < press[k].count ? p : 0]; };
    const auto spring = [&](int k) { return p < press[k].count ? press[k].place[p].spring : nowhere; };
    const auto there = all<V>(p) < lanes_from<V>([&](int k) { return press[k].count; });
    // As quaternions turn a vector.
    const Vectors axis{f.turn.a, f.turn.b, f.turn.c}, local = wide_vectors([&](int k) -> const Vec3& { return place(k).normal; });
    const Vectors across = all<V>(2.0) * cross(axis, local), n = local + f.turn.d * across + cross(axis, across);
    const V overlap = lanes_from<V>([&](int k) { return place(k).overlap; }), stiff = lanes_from<V>([&](int k) { return place(k).elastic; });
    const V elastic = there ? stiff : zero, damped = max(elastic + f.law.cn * f.root_mass * dot(f.closing, n), zero), force = there ? damped : zero;
    const Vectors arm_a = (half * overlap - f.radius) * n, arm_b = f.offset + arm_a;  // of the contact point, from both centres
    const Vectors velocity = f.relative + cross(f.spin_a, arm_a) - cross(f.spin_b, arm_b), slide = velocity - dot(n, velocity) * n;
    const WideFours old = wide_fours(spring);
    const V twist = all<V>(0.5 * dt_) * dot(f.spin_a + f.spin_b, n);
    const Rubbed rubbed = rub(f.law, n, slide, slide, twist, f.root_mass, force, dt_, {old.a, old.b, old.c});
    put_fours({rubbed.spring.x, rubbed.spring.y, rubbed.spring.z, old.d}, spring);  // the fourth is not the spring's
    const Vectors pull = (-f.law.kt) * rubbed.spring;
    f.now.push.force = f.now.push.force + elastic * n;
    f.now.pull.add(pull, arm_a, arm_b);
    f.now.drag.add((force - elastic) * n + (rubbed.total - pull), arm_a, arm_b);
    f.now.stretched += half * f.law.kt * dot(rubbed.spring, rubbed.spring);
    f.normal_force = f.normal_force + force * n;
    f.tangential_force = f.tangential_force + rubbed.total;
    f.arm = f.arm + force * arm_a;
    f.clamped |= there & (force == zero);
    f.total += force;
}

/// Torques are those of what was gathered: elastic forces turn no sphere.
void Presses::put_out(const Press* press, int count, const Forces& f) const
{
    static_assert(offsetof(GeneralForce, arm) == offsetof(GeneralForce, overlap) + 13 * sizeof(double));
    const SphereGridList& l = w_.sphere_grids;
    const Vectors turn_a = f.now.pull.torque_a + f.now.drag.torque_a, turn_b = f.now.push.torque_b + f.now.pull.torque_b + f.now.drag.torque_b;
    const auto put = [&](int n, V a, V b, V c, V d) { put_fours({a, b, c, d}, [&](int k) { return &press[k].out->overlap + 4 * n; }); };
    put(0, f.overlap, f.normal_force.x, f.normal_force.y, f.normal_force.z);
    put(1, f.tangential_force.x, f.tangential_force.y, f.tangential_force.z, turn_a.x);
    put(2, turn_a.y, turn_a.z, turn_b.x, turn_b.y);
    put(3, turn_b.z, f.arm.x, f.arm.y, f.arm.z);
    for (int k = 0; k < count; ++k) {
        GeneralForce& out = *press[k].out;
        out.a = l.sphere[press[k].entry];
        out.b = l.grid[press[k].entry];
        out.points = press[k].count;
    }
}

/// The energies of the pairs after the step: what dashpots and friction took, and what the forces at both ends of the step did beside the change
/// of what is stored, which goes back to the motion (see WorkError). Springs of slots that are left count as slip.
void Presses::keep_books(const Press* press, int count, const Forces& f)
{
    SphereGridList& l = w_.sphere_grids;
    const V zero = all<V>(0.0), one = all<V>(1.0), half_dt = all<V>(0.5 * dt_);
    const auto memory = [&](int k) -> PressMemory& { return l.press[press[k].entry]; };
    const Memory past = take_memory(memory);
    const V before = lanes_from<V>([&](int k) { return l.touch[press[k].entry]; }), owed = lanes_from<V>([&](int k) { return memory(k).owed; });
    const auto touched = before > zero;
    const auto work = [&](const WrenchLanes& first, const WrenchLanes& second) {
        const V earlier = first.power(f.relative, f.spin_a, f.old_spin_b);
        return half_dt * ((touched ? earlier : zero) + second.power(f.relative, f.spin_a, f.spin_b));
    };
    const V was_stored = touched ? past.stored : zero, was_stretched = touched ? past.stretched : zero;
    const V there = lanes_from<V>([](int k) { return k; }) < all<V>(count) ? one : zero;
    stored_ += there * f.now.stored;
    stretched_ += there * f.now.stretched;
    damping_ -= there * work(past.drag, f.now.drag);
    friction_ -= there * (work(past.pull, f.now.pull) + f.now.stretched - was_stretched);
    deep_ += f.overlap > all<V>(w_.options.overlap_cap) * f.radius ? there : zero;
    deepest_ = max(deepest_, f.overlap / f.radius);

    const Vectors push = f.now.push.force + (touched ? one : zero) * past.push.force;
    const V strength = sqrt(dot(push, push)), error = was_stored - f.now.stored - work(past.push, f.now.push) + (touched ? owed : zero);
    const auto lost = (before == all<V>(2.0)) | f.clamped | ~(strength > zero), given = ~lost & (max(error, -error) > all<V>(1e-6) * (was_stored + f.now.stored));
    put_memory(f.now, memory);
    const unsigned held = bits(f.clamped), give = dt_ > 0.0 ? bits(given) : 0u;
    const V kept = lost | given ? zero : error;
    if (dt_ > 0.0) damping_ += lost ? there * error : zero;
    for (int k = 0; k < count; ++k) {
        const std::size_t entry = press[k].entry;
        l.touch[entry] = held >> k & 1 ? 2 : 1;
        memory(k).owed = dt_ > 0.0 ? kept[k] : 0.0;
        if (give >> k & 1) crossing_.push_back({l.sphere[entry], l.grid[entry], error[k], lane(push, k) / strength[k], press[k].offset, Vec3::Zero(), -1, Index(entry)});
    }
}

}  // namespace coral::dem::detail
