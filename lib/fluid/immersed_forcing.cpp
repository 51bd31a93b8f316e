// What a step exchanges with the bodies: the forces it needs, and the velocities it gives.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "fluid/detail/immersed_body.h"
#include "fluid/immersed.h"

namespace coral::fluid {

using detail::OwnFaces;
using detail::SolidRun;
using Eigen::Vector3d;

namespace {

/// Rigid motion seen from the unwrapped faces of a body that was placed elsewhere, perhaps in another periodic image.
struct Carrier {
    Vector3d origin;  ///< of the grid, relative to the body's centre
    Vector3d velocity, spin;
    double cell = 0.0;

    Carrier(const GridSpec& grid, const RigidMotion& placed, const RigidMotion& motion)
        : velocity(motion.velocity), spin(motion.angular_velocity), cell(grid.cell)
    {
        Vector3d shift = motion.position - placed.position;
        for (int d = 0; d < 3; ++d)
            if (grid.periodic(d)) shift[d] -= grid.size()[d] * std::round(shift[d] / grid.size()[d]);
        origin = grid.origin - (placed.position + shift);
    }
    /// From the body's centre to the middle of face (i, j, k) of a component.
    Vector3d arm(int component, int i, int j, int k) const
    {
        Vector3d r = origin + cell * Vector3d(i + 0.5, j + 0.5, k + 0.5);
        r[component] -= 0.5 * cell;
        return r;
    }
    double component_velocity(int c, const Vector3d& r) const
    {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        return velocity[c] + spin[a] * r[b] - spin[b] * r[a];
    }
};

/// Adds r x (f e_c) for a sum of f and, along a row, of (x - x0) f.
template <int c>
void add_torque(Vector3d& torque, const Vector3d& r, double f, double f_times_x)
{
    if constexpr (c == 0) torque += Vector3d(0.0, r.z() * f, -r.y() * f);
    if constexpr (c == 1) torque += Vector3d(-r.z() * f, 0.0, r.x() * f + f_times_x);
    if constexpr (c == 2) torque += Vector3d(r.y() * f, -(r.x() * f + f_times_x), 0.0);
}

/// Second moments of a mass that only resists motion along c: aa, bb, ab with a, b the axes after c.
template <int c>
void add_moments(Vector3d& moments, const Vector3d& r, double mass)
{
    constexpr int a = (c + 1) % 3, b = (c + 2) % 3;  // velocity along c is spin_a r_b - spin_b r_a
    moments += mass * Vector3d(r[b] * r[b], r[a] * r[a], r[a] * r[b]);
}

template <int c>
void add_inertia(Eigen::Matrix3d& inertia, const Vector3d& moments)
{
    constexpr int a = (c + 1) % 3, b = (c + 2) % 3;
    inertia(a, a) += moments[0];
    inertia(b, b) += moments[1];
    inertia(a, b) -= moments[2];
    inertia(b, a) -= moments[2];
}

/// Calls body(std::integral_constant<int, c>) for the three components.
template <class Body>
void for_each_component(const Body& body)
{
    body(std::integral_constant<int, 0>{});
    body(std::integral_constant<int, 1>{});
    body(std::integral_constant<int, 2>{});
}

/// w of a face with solid fraction phi  [docs/numerics.md, eq. 7, 8].
struct ForcingRate {
    double viscous, inertial;  ///< dt C1 nu/h2; dt C2/h [s/m]
    bool plain_blend;

    ForcingRate(const ForcingOptions& options, double dt, double nu, double cell)
        : viscous(dt * options.viscous_rate * nu / (cell * cell)), inertial(dt * options.inertial_rate / cell),
          plain_blend(options.plain_blend)
    {
    }
    /// \param slip before forcing. The rate is that of the slip after it, |slip|/(1 + chi): a quadratic in chi.
    double weight(double phi, double slip) const
    {
        const double open = 1.0 - phi, a = viscous * phi, b = a + open;
        const double chi = a - open + std::sqrt(b * b + 4.0 * open * inertial * std::abs(slip) * phi);  // 2 (1 - phi) chi
        return plain_blend || phi >= 1.0 ? phi : chi / (2.0 * open + chi);
    }
};

/// Growth of the solid's velocity per cell along a row.
template <int c>
double row_slope(const Carrier& carrier)
{
    if constexpr (c == 1) return carrier.spin.z() * carrier.cell;
    if constexpr (c == 2) return -carrier.spin.y() * carrier.cell;
    return 0.0;
}

/// Number of faces and second moment of the solid rows of one component.
template <int c>
void weigh_runs(const std::vector<SolidRun>& runs, const Carrier& carrier, Vector3d& mass, Eigen::Matrix3d& inertia)
{
    Vector3d moments = Vector3d::Zero();
    double spreads = 0.0;
    for (const SolidRun& run : runs) {
        const double n = run.length;
        mass[c] += n;
        add_moments<c>(moments,
                       carrier.arm(c, run.i, run.j, run.k) + Vector3d(0.5 * (n - 1.0) * carrier.cell, 0.0, 0.0), n);
        spreads += n * (n * n - 1.0) / 12.0 * carrier.cell * carrier.cell;  // about the row's own middle
    }
    add_inertia<c>(inertia, moments);
    if (c == 1) inertia(2, 2) += spreads;
    if (c == 2) inertia(1, 1) += spreads;
}

/// Mean void fraction of the two cells of a face.
template <bool porous, class Real>
double face_void(const Real* eps, std::ptrdiff_t own, std::size_t at)
{
    if constexpr (porous) return 0.5 * double(eps[at] + eps[std::ptrdiff_t(at) - own]);
    return 1.0;
}

/// Rows and cut faces lie scattered in fields that do not fit the cache: what the loops will need is asked for in time.
template <bool porous, class Real>
class Prefetch {
public:
    Prefetch(const Real* us, const Real* eps, std::ptrdiff_t own) : us_(us), eps_(eps), own_(own) {}
    void row(const std::vector<SolidRun>& runs, std::size_t now) const
    {
        constexpr std::size_t ahead = 4;
        constexpr int line = 64 / sizeof(Real);
        if (now + ahead >= runs.size()) return;
        const SolidRun& run = runs[now + ahead];
        for (int l = 0; l < run.length + line - 1; l += line) face(run.at + std::uint32_t(std::min(l, run.length - 1)));
    }
    void face(std::uint32_t at) const
    {
        __builtin_prefetch(us_ + at, 1);
        if constexpr (porous) {
            __builtin_prefetch(eps_ + at);
            __builtin_prefetch(eps_ + (std::ptrdiff_t(at) - own_));
        }
    }

private:
    const Real *us_, *eps_;
    std::ptrdiff_t own_;
};
constexpr int cuts_ahead = 24;

/// Reaction of the solid rows of one component; sums of (u* - u_s) eps, not yet times rho V / dt.
template <class Real, int c, bool porous>
void measure_runs(const Flow& flow, const std::vector<SolidRun>& runs, const Carrier& carrier, FluidAction& action)
{
    const Real* us = flow.provisional(c).data<Real>();
    const Real* eps = porous ? flow.porous_fields().void_fraction.data<Real>() : nullptr;
    const std::ptrdiff_t own = flow.layout().stride[c];
    const double slope = row_slope<c>(carrier);
    const Prefetch<porous, Real> prefetch(us, eps, own);
    double force = 0.0;
    Vector3d torque = Vector3d::Zero();
    for (std::size_t n = 0; n < runs.size(); ++n) {
        prefetch.row(runs, n);
        const SolidRun& run = runs[n];
        const Vector3d r = carrier.arm(c, run.i, run.j, run.k);
        const double body = carrier.component_velocity(c, r);
        const Real *row = us + run.at, *high = porous ? eps + run.at : nullptr, *low = porous ? high - own : nullptr;
        const int length = run.length;
        double f = 0.0, fx = 0.0;
#pragma omp simd reduction(+ : f, fx)
        for (int l = 0; l < length; ++l) {
            double part = double(row[l]) - (body + slope * l);
            if constexpr (porous) part *= 0.5 * double(high[l] + low[l]);
            f += part;
            if constexpr (c != 0) fx += l * part;
        }
        force += f;
        add_torque<c>(torque, r, f, carrier.cell * fx);
    }
    action.force[c] += force;
    action.torque += torque;
}

/// The same for cut faces, whose weights are found here.
template <class Real, int c, bool porous>
void measure_cuts(const Flow& flow, const ForcingOptions& options, double dt, OwnFaces& faces, const Carrier& carrier,
                  FluidAction& action)
{
    constexpr int a = (c + 1) % 3, b = (c + 2) % 3;
    const Real* us = flow.provisional(c).data<Real>();
    const Real* eps = porous ? flow.porous_fields().void_fraction.data<Real>() : nullptr;
    const std::ptrdiff_t own = flow.layout().stride[c];
    const ForcingRate rate(options, dt, flow.options().kinematic_viscosity, carrier.cell);
    const Vector3d first = carrier.arm(c, 0, 0, 0);
    const std::uint32_t* at = faces.at.data();
    const std::int16_t *place_a = faces.place[0].data(), *place_b = faces.place[1].data();
    const float* fraction = faces.fraction.data();
    float* weight = faces.weight.data();
    const int count = int(faces.at.size());
    double force = 0.0, force_a = 0.0, force_b = 0.0, total = 0.0, total_aa = 0.0, total_ab = 0.0, total_bb = 0.0;
    const Prefetch<porous, Real> prefetch(us, eps, own);
    for (int n = 0; n < count; ++n) {
        if (n + cuts_ahead < count) prefetch.face(at[n + cuts_ahead]);
        const double ra = first[a] + carrier.cell * place_a[n], rb = first[b] + carrier.cell * place_b[n];
        const double slip = double(us[at[n]]) - (carrier.velocity[c] + carrier.spin[a] * rb - carrier.spin[b] * ra);
        weight[n] = float(rate.weight(double(fraction[n]), slip));
        const double mass = double(weight[n]) * face_void<porous>(eps, own, at[n]);
        const double f = mass * slip;
        force += f, force_a += f * ra, force_b += f * rb;
        total += mass, total_aa += mass * ra * ra, total_ab += mass * ra * rb, total_bb += mass * rb * rb;
    }
    action.force[c] += force;
    action.torque[a] += force_b;
    action.torque[b] -= force_a;
    action.forced_mass[c] += total;
    add_inertia<c>(action.forced_inertia, Vector3d(total_bb, total_aa, total_ab));
}

/// u* <- u* + w (u_s - u*) on the faces of one component. \returns the sum of eps times the change
template <class Real, int c, bool porous>
double force_faces(Flow& flow, const OwnFaces& faces, const Carrier& carrier)
{
    constexpr int a = (c + 1) % 3, b = (c + 2) % 3;
    Real* us = flow.provisional(c).data<Real>();
    const Real* eps = porous ? flow.porous_fields().void_fraction.data<Real>() : nullptr;
    FlowField* const held = flow.held_acceleration(c);
    Real* hold = held ? held->data<Real>() : nullptr;
    const double per_step = 1.0 / flow.step_length();
    const std::ptrdiff_t own = flow.layout().stride[c];
    const double slope = row_slope<c>(carrier);
    double impulse = 0.0;
    const Prefetch<porous, Real> prefetch(us, eps, own);
    for (std::size_t n = 0; n < faces.runs.size(); ++n) {
        prefetch.row(faces.runs, n);
        const SolidRun& run = faces.runs[n];
        const double body = carrier.component_velocity(c, carrier.arm(c, run.i, run.j, run.k));
        Real* row = us + run.at;
        const Real *high = porous ? eps + run.at : nullptr, *low = porous ? high - own : nullptr;
        const int length = run.length;
        if (hold)
            for (int l = 0; l < length; ++l) hold[run.at + l] += Real(per_step * (body + slope * l - double(row[l])));
        double sum = 0.0;
#pragma omp simd reduction(+ : sum)
        for (int l = 0; l < length; ++l) {
            const Real solid = Real(body + slope * l);
            double change = double(solid - row[l]);
            if constexpr (porous) change *= 0.5 * double(high[l] + low[l]);
            sum += change;
            row[l] = solid;
        }
        impulse += sum;
    }
    const Vector3d first = carrier.arm(c, 0, 0, 0);
    const std::uint32_t* at = faces.at.data();
    const std::int16_t *place_a = faces.place[0].data(), *place_b = faces.place[1].data();
    const int count = int(faces.at.size());
    double sum = 0.0;
    for (int n = 0; n < count; ++n) {
        if (n + cuts_ahead < count) prefetch.face(at[n + cuts_ahead]);
        const double ra = first[a] + carrier.cell * place_a[n], rb = first[b] + carrier.cell * place_b[n];
        const double solid = carrier.velocity[c] + carrier.spin[a] * rb - carrier.spin[b] * ra;
        const Real old = us[at[n]];
        us[at[n]] = Real(double(old) + double(faces.weight[std::size_t(n)]) * (solid - double(old)));
        const double change = double(us[at[n]]) - double(old);
        if (hold) hold[at[n]] += Real(per_step * change);
        sum += face_void<porous>(eps, own, at[n]) * change;
    }
    return impulse + sum;
}

/// One for each body.
template <class Bodies>
std::vector<Carrier> carriers_of(const GridSpec& grid, const Bodies& bodies, std::span<const RigidMotion> motions)
{
    std::vector<Carrier> carriers;
    carriers.reserve(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b) carriers.emplace_back(grid, bodies[b]->placed, motions[b]);
    return carriers;
}

/// Velocity of the solid on a shared face: mean of the bodies weighted by their fractions.
template <int c, class Claim>
double shared_velocity(std::span<const Claim> claims, const std::vector<Carrier>& carriers)
{
    double solid = 0.0;
    for (const Claim& claim : claims) {
        const Carrier& carrier = carriers[claim.body];
        solid += claim.part * carrier.component_velocity(c, carrier.arm(c, claim.i, claim.j, claim.k));
    }
    return solid;
}

}  // namespace

/// What the solid rows resist with; it does not change from step to step.
void ImmersedBodies::weigh(Body& body) const
{
    const Carrier carrier(grid_, body.placed, body.placed);
    body.run_mass.setZero();
    body.run_inertia.setZero();
    for_each_component([&](auto component) {
        weigh_runs<component>(body.own[component].runs, carrier, body.run_mass, body.run_inertia);
    });
}

/// The projection keeps every cell's volume, come what may: where solid fills the whole section, the given inflow goes
/// through the solid and the pressure rises from step to step without end. Inside a body that flow can pass, the slip
/// before forcing is a small part of the velocity, but for the first steps after a sudden change.
void ImmersedBodies::watch_for_blockage(const Flow& flow, std::span<const Vector3d> slip)
{
    constexpr double share = 0.5;
    constexpr int patience = 300;
    const double speed = flow.mass().velocity_scale;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        const bool driven = speed > 0.0 && slip[b].cwiseAbs().maxCoeff() > share * speed;
        driven_steps_[b] = driven ? driven_steps_[b] + 1 : 0;
        if (driven_steps_[b] < patience) continue;
        const Vector3d x = bodies_[b]->placed.position;
        throw Error("flow",
                    "is driven through the solid at (" + to_text(x.x()) + ", " + to_text(x.y()) + ", " + to_text(x.z()) +
                        ") m: its way from the inlet is blocked, and the pressure rises without end",
                    "open a way to the outlet, with throats of at least two cells");
    }
}

std::span<const FluidAction> ImmersedBodies::measure(Flow& flow, double dt, std::span<const RigidMotion> motions)
{
    const Stopwatch watch(flow.times().forcing);
    const std::vector<Carrier> carriers = carriers_of(grid_, bodies_, motions);
    std::vector<Vector3d> mean_slip(bodies_.size(), Vector3d::Zero());  // over the solid rows
    parallel_blocks(bodies_.size(), 1, [&](std::size_t b, std::size_t) {
        Body& body = *bodies_[b];
        const Carrier& carrier = carriers[b];
        FluidAction action;
        action.forced_mass = body.run_mass;
        action.forced_inertia = body.run_inertia;
        for_each_component([&](auto component) {
            constexpr int c = component;
            const auto add = [&]<class Real, bool porous>() {
                measure_runs<Real, c, porous>(flow, body.own[c].runs, carrier, action);
                mean_slip[b][c] = action.force[c] / std::max(1.0, body.run_mass[c]);
                measure_cuts<Real, c, porous>(flow, options_, dt, body.own[c], carrier, action);
                if (body.still) body.given[c] = force_faces<Real, c, porous>(flow, body.own[c], carrier);
            };
            in_precision(flow.options().precision, [&]<class Real>(Real) {
                flow.porous() ? add.template operator()<Real, true>() : add.template operator()<Real, false>();
            });
        });
        actions_[b] = action;
    });
    watch_for_blockage(flow, mean_slip);
    const ForcingRate rate(options_, dt, flow.options().kinematic_viscosity, grid_.cell);
    for_each_component([&](auto component) {
        constexpr int c = component;
        for (Shared& shared : shared_[c]) {
            const std::span<const Claim> claims(claims_[c].data() + shared.first, claims_[c].data() + shared.last);
            const double slip = flow.provisional(c)[shared.at] - shared_velocity<c>(claims, carriers);
            shared.weight = rate.weight(shared.fraction, slip);
            for (const Claim& claim : claims) {
                const Vector3d r = carriers[claim.body].arm(c, claim.i, claim.j, claim.k);
                const double part = claim.part * shared.weight * flow.face_void_fraction(c, shared.at);
                FluidAction& action = actions_[claim.body];
                Vector3d moments = Vector3d::Zero();
                action.force[c] += part * slip;
                action.forced_mass[c] += part;
                add_torque<c>(action.torque, r, part * slip, 0.0);
                add_moments<c>(moments, r, part);
                add_inertia<c>(action.forced_inertia, moments);
            }
        }
    });
    const double mass = flow.options().density * grid_.cell_volume();
    for (FluidAction& action : actions_) {
        action.force *= mass / dt;
        action.torque *= mass / dt;
        action.forced_mass *= mass;
        action.forced_inertia *= mass;
    }
    return actions_;
}

void ImmersedBodies::apply(Flow& flow, std::span<const RigidMotion> motions)
{
    const Stopwatch watch(flow.times().forcing);
    const double mass = flow.options().density * grid_.cell_volume();
    const std::vector<Carrier> carriers = carriers_of(grid_, bodies_, motions);
    impulses_.resize(bodies_.size());
    Vector3d impulse = parallel_sum(bodies_.size(), 1, Vector3d(0.0, 0.0, 0.0), [&](std::size_t b, std::size_t) {
        const Body& body = *bodies_[b];
        const Carrier& carrier = carriers[b];
        Vector3d part = body.given;
        for_each_component([&](auto component) {
            constexpr int c = component;
            if (body.still) return;
            part[c] = in_precision(flow.options().precision, [&]<class Real>(Real) {
                return flow.porous() ? force_faces<Real, c, true>(flow, body.own[c], carrier)
                                     : force_faces<Real, c, false>(flow, body.own[c], carrier);
            });
        });
        impulses_[b] = mass * part;
        return part;
    });
    for_each_component([&](auto component) {
        constexpr int c = component;
        for (const Shared& shared : shared_[c]) {
            const std::span<const Claim> claims(claims_[c].data() + shared.first, claims_[c].data() + shared.last);
            FlowField& us = flow.provisional(c);
            const double old = us[shared.at];
            us.set(shared.at, old + shared.weight * (shared_velocity<c>(claims, carriers) - old));
            const double change = us[shared.at] - old;
            if (FlowField* hold = flow.held_acceleration(c)) hold->set(shared.at, (*hold)[shared.at] + change / flow.step_length());
            const double given = flow.face_void_fraction(c, shared.at) * change;
            impulse[c] += given;
            for (const Claim& claim : claims) impulses_[claim.body][c] += mass * claim.part * given;
        }
    });
    flow.add_forcing_impulse(mass * impulse);
}

}  // namespace coral::fluid
