// Motion in time: velocity Verlet, exact rotations about principal axes, guards.
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"
#include "dem/detail/impl.h"
#include "dem/detail/sphere_motion.h"

namespace coral::dem {

namespace {

/// Unit length for a quaternion that has it but for rounding or a small turn.
void renormalize(double w, double x, double y, double z, Quat& q)
{
    const double length2 = w * w + x * x + y * y + z * z;
    // One Newton step of 1/sqrt, no root and no division.
    const double to_one = std::abs(length2 - 1.0) < 1e-4 ? 1.5 - 0.5 * length2 : 1.0 / std::sqrt(length2);
    q.w() = to_one * w, q.x() = to_one * x, q.y() = to_one * y, q.z() = to_one * z;
}

/// Turn by a small angle: enough for spheres, whose orientation is for looking at only. In plain numbers: Eigen's quaternions are written by
/// halves and read whole, which stalls.
void turn_sphere(Quat& q, const Vec3& turn)
{
    double w = q.w(), x = q.x(), y = q.y(), z = q.z();
    detail::turn_little(0.5 * turn.x(), 0.5 * turn.y(), 0.5 * turn.z(), w, x, y, z);
    renormalize(w, x, y, z, q);
}

struct SineCosine {
    double sine, cosine;
};

/// Series for the small angles of a step: what they leave out is below the last digit.
SineCosine sine_and_cosine(double angle)
{
    if (std::abs(angle) > 0.1) return {std::sin(angle), std::cos(angle)};
    const double z = angle * angle;
    return {angle * (1.0 - z * (1.0 / 6.0) * (1.0 - z * (1.0 / 20.0) * (1.0 - z * (1.0 / 42.0) * (1.0 - z * (1.0 / 72.0))))),
            1.0 - z * 0.5 * (1.0 - z * (1.0 / 12.0) * (1.0 - z * (1.0 / 30.0) * (1.0 - z * (1.0 / 56.0) * (1.0 - z * (1.0 / 90.0)))))};
}

/// Rotates the body-frame angular momentum about axis k by the flow of b_k^2/(2 I_k) over time t; `turn` gathers the rotation of the body.
template <int k>
void spin_about(double t, const Vec3& inverse_moment, Vec3& b, Quat& turn)
{
    constexpr int m = (k + 1) % 3, n = (k + 2) % 3;
    const auto [s, c] = sine_and_cosine(0.5 * b[k] * inverse_moment[k] * t);
    const double sine = 2.0 * s * c, cosine = 1.0 - 2.0 * s * s, bm = b[m], bn = b[n];
    b[m] = cosine * bm + sine * bn;
    b[n] = cosine * bn - sine * bm;
    // turn * (c + s e_k)
    const Vec3 v = turn.vec();
    const double w = turn.w();
    turn.w() = c * w - s * v[k];
    turn.vec()[k] = c * v[k] + s * w;
    turn.vec()[m] = c * v[m] + s * v[n];
    turn.vec()[n] = c * v[n] - s * v[m];
}

/// Free rotation over dt with constant world angular momentum: five exact rotations, symmetric, symplectic.
/// \param b  angular momentum in principal axes, before and then after
Quat free_rotation(Vec3& b, const Vec3& inverse_moments, double dt)
{
    Quat turn = Quat::Identity();
    spin_about<0>(0.5 * dt, inverse_moments, b, turn);
    spin_about<1>(0.5 * dt, inverse_moments, b, turn);
    spin_about<2>(dt, inverse_moments, b, turn);
    spin_about<1>(0.5 * dt, inverse_moments, b, turn);
    spin_about<0>(0.5 * dt, inverse_moments, b, turn);
    return turn;
}

}  // namespace

double World::Impl::critical_step() const
{
    if (known_critical_step < 0.0) known_critical_step = least_period(false);
    return known_critical_step;
}

double World::Impl::automatic_step() const { return options.step_fraction * std::min(least_period(false), least_period(true)); }

/// 1/omega of the lightest and stiffest body; with flat sides on flat partners, that may go at 1/0.3 times the omega dt of round ones,
/// since the work of nodes is corrected in every step.
double World::Impl::least_period(bool flat) const
{
    constexpr double flat_share = 0.09;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < x.size(); ++i) {
        if (!free(i)) continue;
        const double flatness = shapes[std::size_t(shape[i])]->flatness();
        double stiffness = 0.0;
        for (std::size_t m = 0; m < materials.size(); ++m) {
            const PairLaw& pair = law(material[i], Index(m));
            // A tangential spring moves a sphere 3.5 times as easily as its mass alone would let it. Flat on a flat partner of its own
            // size (R* and m* both halved) a body is held by 4 kn flatness.
            stiffness = std::max({stiffness, 2.0 * pair.kn, 3.5 * pair.kt, flat ? flat_share * 4.0 * pair.kn * flatness : 0.0});
        }
        least = std::min(least, mass[i] / stiffness);
    }
    return std::sqrt(least);
}

void World::Impl::check_step(double dt) const
{
    if (!(dt > 0.0) || !std::isfinite(dt)) throw Error("time step", to_text(dt) + " s is not positive", "give a positive step");
    const double critical = critical_step();
    if (dt > 1.5 * critical && !options.force_step)
        throw Error("time step", to_text(dt) + " s is above 1.5 of the critical step " + to_text(critical) + " s (sqrt(m/2kn) of the lightest body)",
                    "use " + to_text(automatic_step()) + " s (automatic) or a smaller stiffness");
}

// Kick of one body over dt; the spin of a body with nodes is left for the caller to renew. Returns the energy that its added mass takes up.
// Number by number, here and in drift_body: vectors that are copied in a piece of two and one of one stall whoever reads them next.
inline double World::Impl::kick_body(std::size_t i, double dt, const Vec3& g_dt)
{
    const bool heavier = i < added_mass.size() && added_mass[i] != Vec3::Zero();
    const double taken = heavier ? kick_with_added_mass(i, dt) : 0.0;
    const double share = inverse_mass[i] * dt, turn = has_nodes[i] ? dt : inverse_inertia[i] * dt;
    Vec3& spin = has_nodes[i] ? momentum[i] : w[i];
    for (int k = 0; k < 3; ++k) {
        if (!heavier) v[i][k] += share * (any_external ? force[i][k] + external_force[i][k] : force[i][k]) + g_dt[k];
        spin[k] += turn * (any_external ? torque[i][k] + external_torque[i][k] : torque[i][k]);
    }
    return taken;
}

void World::Impl::kick(double dt)
{
    const Vec3 g_dt = options.gravity * dt;
    external_work -= parallel_sum(x.size(), body_grain, 0.0, [&](std::size_t first, std::size_t last) {
        const detail::SphereMotion groups(*this, 2.0 * dt, options.gravity);
        double taken = 0.0;
        for (std::size_t i = first; i < last;) {
            if (i + groups.count <= last && groups.plain(i)) {
                groups.kick(i);
                i += groups.count;
                continue;
            }
            if (inverse_mass[i] > 0.0) {
                taken += kick_body(i, dt, g_dt);
                if (has_nodes[i]) update_spin(i);
            }
            ++i;
        }
        return taken;
    });
}

// (m + added) dv = dt (forces + m g), component by component. The energy that the added mass takes up counts as work done outside.
double World::Impl::kick_with_added_mass(std::size_t i, double dt)
{
    const Vec3 before = v[i];
    const Vec3 inertia = added_mass[i].array() + mass[i];
    v[i] += (dt * (force[i] + external_force[i] + mass[i] * options.gravity)).cwiseQuotient(inertia);
    return 0.5 * added_mass[i].dot(v[i].cwiseAbs2() - before.cwiseAbs2());
}

// First kick, way and turn of every body in one pass over memory; returns which lists are worn out.
World::Impl::Worn World::Impl::kick_and_drift(double dt)
{
    Drift all = parallel_sum(x.size(), body_grain, Drift{}, [&](std::size_t first, std::size_t last) { return drift_bodies(first, last, dt); });
    gravity_work += all.gravity_work;
    external_work += all.external_work;
    const double limit = free_path * skin;
    for (std::size_t k = 0; k < walls.size(); ++k) {
        WallData& wall = walls[k];
        wall.point += dt * wall.velocity;
        all.farthest = std::max(all.farthest, (wall.point - wall.reference).norm());
        all.node_farthest = std::max(all.node_farthest, note_wall_way(k));
    }
    if (!std::isfinite(all.finite)) check_numbers();
    return {all.farthest > limit, all.node_farthest > free_path * nodes.skin};
}

World::Impl::Drift World::Impl::drift_bodies(std::size_t first, std::size_t last, double dt)
{
    Drift sum;
    detail::SphereMotion groups(*this, dt, options.gravity);
    for (std::size_t i = first; i < last;) {
        if (i + groups.count <= last && groups.plain(i)) {
            groups.drift(i);
            i += groups.count;
        } else {
            drift_body(i++, dt, sum);
        }
    }
    sum.gravity_work += groups.gravity_work();
    sum.finite += groups.finite();
    sum.farthest = std::max(sum.farthest, std::sqrt(groups.farthest2()));
    return sum;
}

void World::Impl::drift_body(std::size_t i, double dt, Drift& sum)
{
    if (!in[i]) return;
    if (motion[i] != Motion::free) {
        v_end[i] = v[i];
        if (motion[i] == Motion::fixed) return;
    } else {
        for (int k = 0; k < 3; ++k) v_end[i][k] = -v[i][k];
        sum.external_work -= kick_body(i, 0.5 * dt, 0.5 * dt * options.gravity);
        for (int k = 0; k < 3; ++k) v_end[i][k] += 2.0 * v[i][k];
    }
    double way2 = 0.0, speed2 = 0.0, fall = 0.0;
    for (int k = 0; k < 3; ++k) {
        const double way = dt * v[i][k], now = x[i][k] + way, from = now - x_reference[i][k];
        x[i][k] = now;
        way2 += from * from;
        speed2 += v[i][k] * v[i][k] + w[i][k] * w[i][k];
        fall += options.gravity[k] * way;
    }
    sum.finite += speed2;
    moved2[i] = way2;
    if (way2 > sum.farthest * sum.farthest) sum.farthest = std::sqrt(way2);
    Vec3 turn = dt * w[i];
    if (has_nodes[i]) {
        turn_grid(i, dt);
        turn = 0.5 * dt * (w_before[i] + w[i]);
        if (mixed) {
            grid_drift[i] = std::sqrt(way2) + turn_between(q[i], q_reference[i]) * radius[i];
            sum.farthest = std::max(sum.farthest, grid_drift[i]);
        }
        sum.node_farthest = std::max(sum.node_farthest, note_way(i));
    } else {
        turn_sphere(q[i], turn);
    }
    if (motion[i] != Motion::free) return;
    sum.gravity_work += mass[i] * fall;
    if (any_external) sum.external_work += dt * external_force[i].dot(v[i]) + external_torque[i].dot(turn);
}

// Turns a body with nodes; its spin before (after the kick) and after go to w_before and w.
void World::Impl::turn_grid(std::size_t i, double dt)
{
    if (motion[i] == Motion::free) {
        const Quat& principal_axes = shapes[std::size_t(shape[i])]->principal_rotation();
        const Quat before = q[i] * principal_axes;
        const Vec3 inverse = principal[i].cwiseInverse();
        Vec3 b = before.conjugate() * momentum[i];
        w_before[i] = before * b.cwiseProduct(inverse);
        Quat after = before * free_rotation(b, inverse, dt);
        renormalize(after.w(), after.x(), after.y(), after.z(), after);
        q[i] = after * principal_axes.conjugate();
        w[i] = after * b.cwiseProduct(inverse);
        return;
    }
    w_before[i] = w[i];
    const double angle = w[i].norm() * dt;
    if (angle > 0.0) q[i] = (Quat(Eigen::AngleAxisd(angle, w[i].normalized())) * q[i]).normalized();
}

void World::Impl::check_numbers() const
{
    for (std::size_t i = 0; i < x.size(); ++i)
        if (in[i] && !(x[i].allFinite() && v[i].allFinite() && w[i].allFinite() && std::isfinite(v[i].squaredNorm() + w[i].squaredNorm())))
            throw Error(name(i), "position or velocity is no number at " + to_text(time) + " s",
                        "use a smaller time step, or look for a deep overlap or a bad force at the start");
}

// Half of the power that walls and bodies with given motion exchange with the rest, over dt.
void World::Impl::constraint_work(double dt)
{
    for (const WallData& wall : walls) wall_work -= 0.5 * dt * wall.force.dot(wall.velocity);
    for (std::size_t i = 0; any_prescribed && i < x.size(); ++i)
        if (in[i] && motion[i] == Motion::prescribed) wall_work -= 0.5 * dt * (force[i].dot(v[i]) + torque[i].dot(w[i]));
}

// Velocity Verlet does the work of a linear spring exactly as long as the spring is closed at both ends of a step: the trapezoid of a
// linear force is exact, and its shadow term dt^2 F^2/(8m) cancels over a contact. Only in the step that opens or closes a contact
// does it err, by up to (omega dt)^2/4 of the energy with the sign of chance, which a bouncing body gathers like a random walk.
// The error is known from the two overlaps, and goes to the relative motion along the normal as an impulse: two elastic spheres
// then keep their energy for any number of bounces and any stable step. Nodes, whose law is not linear and whose field has ridges, know
// the error of every step (WorkError); near the turning point there is no motion to give it to or take it from, and it waits.
void World::Impl::correct_crossings()
{
    const auto turns = [&](std::size_t i) { return has_nodes[i] && motion[i] == Motion::free; };
    const auto compliance = [&](std::size_t i, const Vec3& arm, const Vec3& n) {
        if (!turns(i)) return inverse_mass[i];
        const Vec3 lever = arm.cross(n);
        return inverse_mass[i] + lever.dot(apply_inverse_inertia(i, lever));
    };
    const auto kick_at = [&](std::size_t i, const Vec3& arm, const Vec3& impulse) {
        v[i] += inverse_mass[i] * impulse;
        if (!turns(i)) return;
        momentum[i] += arm.cross(impulse);
        update_spin(i);
    };
    for (const std::vector<Crossing>& list : crossings)
        for (const Crossing& c : list) {
            const std::size_t a = std::size_t(c.a);
            Vec3 relative = v[a] + w[a].cross(c.arm_a);
            double inverse = compliance(a, c.arm_a, c.normal);
            if (c.b < 0) {
                relative -= walls[std::size_t(-1 - c.b)].velocity;
            } else {
                relative -= v[std::size_t(c.b)] + w[std::size_t(c.b)].cross(c.arm_b);
                inverse += compliance(std::size_t(c.b), c.arm_b, c.normal);
            }
            const double speed = relative.dot(c.normal);
            if ((c.pair >= 0 || c.press >= 0) && speed * speed < 20.0 * std::abs(c.energy) * inverse) {
                (c.pair >= 0 ? nodes.owed[std::size_t(c.pair)] : sphere_grids.press[std::size_t(c.press)].owed) = c.energy;
                continue;
            }
            const double square = speed * speed + 2.0 * c.energy * inverse;
            if (speed == 0.0) continue;
            const double corrected = std::copysign(std::sqrt(std::max(square, 0.0)), speed);
            const Vec3 impulse = (corrected - speed) / inverse * c.normal;
            kick_at(a, c.arm_a, impulse);
            if (c.b >= 0) kick_at(std::size_t(c.b), c.arm_b, -impulse);
            // Partners that keep their motion do work.
            if (c.b < 0) wall_work += impulse.dot(walls[std::size_t(-1 - c.b)].velocity);
            else if (motion[std::size_t(c.b)] == Motion::prescribed) wall_work += impulse.dot(v[std::size_t(c.b)] + w[std::size_t(c.b)].cross(c.arm_b));
            if (motion[a] == Motion::prescribed) wall_work -= impulse.dot(v[a] + w[a].cross(c.arm_a));
        }
}

void World::Impl::step(double dt)
{
    refresh_forces();
    if (!ledger_started) {
        initial = kinetic_energy() + sums.elastic_normal + sums.elastic_tangential;
        last_dt = dt;
        initial_account = on_account();
        dissipated_friction = dissipated_damping = gravity_work = external_work = wall_work = 0.0;
        ledger_started = true;
    }
    auto start = std::chrono::steady_clock::now();
    constraint_work(dt);
    const Worn worn = kick_and_drift(dt);
    counters.seconds_integration += seconds_since(start);
    if (worn.lists) make_lists();
    else if (worn.nodes) list_nodes(nullptr);
    compute_contacts(dt);
    start = std::chrono::steady_clock::now();
    kick(0.5 * dt);
    correct_crossings();
    constraint_work(dt);
    time += dt;
    last_dt = dt;
    ++counters.steps;
    counters.seconds_integration += seconds_since(start);
}

void World::step(double dt)
{
    impl_->check_step(dt);
    impl_->step(dt);
}

int World::advance(double duration, double dt)
{
    if (!(duration > 0.0)) return 0;
    double longest = dt > 0.0 ? dt : impl_->automatic_step();
    if (!(longest < duration)) longest = duration;
    const double count = std::ceil(duration / longest * (1.0 - 1e-12));
    if (!(count < 2e9)) throw Error("time step", to_text(longest) + " s is too small for " + to_text(duration) + " s", "use a larger step");
    const double step = duration / count;
    impl_->check_step(step);
    const double end = impl_->time + duration;
    for (int k = 0; k < int(count); ++k) impl_->step(step);
    impl_->time = end;  // not the sum of rounded steps
    return int(count);
}

int World::relax(double overlap, int max_iterations)
{
    Impl& m = *impl_;
    constexpr double rate = 0.2, longest = 0.05;  // of the way that would close a lone spring; of the radius
    int iteration = 0;
    for (;; ++iteration) {
        for (std::size_t i = 0; i < m.x.size(); ++i)
            if (m.free(i)) {
                m.v[i].setZero();
                m.set_spin(i, Vec3::Zero());
            }
        m.forces_valid = false;
        if (m.lists_valid && m.lists_expired()) m.lists_valid = false;
        m.refresh_forces();
        if (m.sums.max_overlap <= overlap || iteration >= max_iterations) break;
        for (std::size_t i = 0; i < m.x.size(); ++i) {
            if (!m.free(i)) continue;
            const double stiffness = m.law(m.material[i], m.material[i]).kn, r = m.equivalent[i];
            Vec3 way = rate / stiffness * m.force[i];
            if (way.norm() > longest * r) way *= longest * r / way.norm();
            m.x[i] += way;
            if (!m.has_nodes[i]) continue;
            Vec3 turn = rate / (stiffness * r * r) * m.torque[i];
            if (turn.norm() > longest) turn *= longest / turn.norm();
            if (turn.norm() > 0.0) m.q[i] = (Quat(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * m.q[i]).normalized();
        }
    }
    m.ledger_started = false;
    return iteration;
}

}  // namespace coral::dem
