#include "fluid/immersed.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "fluid/detail/lanes.h"
#include "fluid/detail/raster.h"

namespace coral::fluid {

using detail::CutFace;
using detail::SolidRun;
using detail::SolidSet;
using Eigen::Vector3d;

struct ImmersedBodies::Body {
    BodyShape shape;
    RigidMotion placed;
    bool found = false;                             ///< faces belong to `placed`
    std::array<SolidSet, 4> solid;                  ///< components and cells
    std::array<std::vector<SolidRun>, 3> own_runs;  ///< runs without the faces shared with other bodies
    Vector3d run_mass = Vector3d::Zero();           ///< of the own runs, in faces; about `placed` like the inertia
    Eigen::Matrix3d run_inertia = Eigen::Matrix3d::Zero();  ///< [m2]
};

struct ImmersedBodies::Shared {
    struct Share {
        std::uint32_t body = 0;
        double part = 0.0;                 ///< of the sum of fractions
        std::int16_t i = 0, j = 0, k = 0;  ///< the face as the body sees it: bodies may meet across a periodic side
    };
    std::uint32_t at = 0;
    int component = 0;
    double fraction = 0.0, weight = 0.0;
    std::vector<Share> shares;
};

ImmersedBodies::ImmersedBodies(const GridSpec& grid, const ForcingOptions& options)
    : grid_(grid), layout_(grid.cells), options_(options)
{
    for (Field& f : face_solid_) f = layout_.make_field();
    cell_solid_ = layout_.make_field();
}
ImmersedBodies::ImmersedBodies(ImmersedBodies&&) noexcept = default;
ImmersedBodies& ImmersedBodies::operator=(ImmersedBodies&&) noexcept = default;
ImmersedBodies::~ImmersedBodies() = default;

std::size_t ImmersedBodies::add(BodyShape shape, const RigidMotion& motion)
{
    auto body = std::make_unique<Body>();
    body->shape = std::move(shape);
    body->placed = motion;
    bodies_.push_back(std::move(body));
    actions_.emplace_back();
    driven_steps_.push_back(0);
    return bodies_.size() - 1;
}

void ImmersedBodies::rasterise(Body& body) const
{
    for (int component = 0; component < 4; ++component)
        body.solid[component] =
            detail::find_solid(grid_, layout_, component, body.shape, body.placed, options_.fraction);
    body.found = true;
}

void ImmersedBodies::place(std::span<const RigidMotion> motions)
{
    const double tolerance = options_.reshape_distance * grid_.cell;
    std::vector<std::size_t> moved;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        Body& body = *bodies_[b];
        const double reach = body.shape.box_min.cwiseAbs().cwiseMax(body.shape.box_max.cwiseAbs()).norm();
        const double travel = (motions[b].position - body.placed.position).norm() +
                              reach * motions[b].orientation.angularDistance(body.placed.orientation);
        if (body.found && !(travel > tolerance)) continue;
        body.placed = motions[b];
        moved.push_back(b);
    }
    if (moved.empty()) return;
    parallel_blocks(moved.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t m = begin; m < end; ++m) rasterise(*bodies_[moved[m]]);
    });
    merge();
}

std::vector<RigidMotion> ImmersedBodies::placed_motions() const
{
    std::vector<RigidMotion> motions;
    for (const auto& body : bodies_) motions.push_back(body->placed);
    return motions;
}

void ImmersedBodies::restore(std::span<const RigidMotion> placed_motions)
{
    if (placed_motions.size() != bodies_.size())
        throw Error("immersed bodies", "the checkpoint holds another number of bodies",
                    "resume with the case that wrote it");
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        bodies_[b]->placed = placed_motions[b];
        bodies_[b]->found = false;
    }
    place(placed_motions);
}

/// Sums the solid fractions of all bodies and sets aside the faces on which several meet.
void ImmersedBodies::merge()
{
    struct Claim {
        std::uint32_t at, body;
        CutFace face;
    };
    std::array<std::vector<Claim>, 3> claims;
    parallel_blocks(4, 1, [&](std::size_t component, std::size_t) {
        Field& sum = component < 3 ? face_solid_[component] : cell_solid_;
        std::fill(sum.begin(), sum.end(), 0.0);
        for (const auto& body : bodies_) {
            const SolidSet& set = body->solid[component];
            for (const SolidRun& run : set.runs)
                for (int l = 0; l < run.length; ++l) sum[run.at + std::uint32_t(l)] += 1.0;
            for (const CutFace& cut : set.cuts) sum[cut.at] += double(cut.fraction);
        }
        if (component == detail::cells_component) {
            for (double& value : sum) value = std::min(value, 1.0);
            return;
        }
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            SolidSet& set = bodies_[b]->solid[component];
            std::vector<SolidRun>& own = bodies_[b]->own_runs[component];
            own.clear();
            for (CutFace& cut : set.cuts) {
                cut.shared = sum[cut.at] != double(cut.fraction);
                if (cut.shared) claims[component].push_back({cut.at, std::uint32_t(b), cut});
            }
            for (const SolidRun& run : set.runs) {
                bool open = false;  // whether the last own run goes on
                for (int l = 0; l < run.length; ++l) {
                    const std::uint32_t at = run.at + std::uint32_t(l);
                    const auto i = std::int16_t(run.i + l);
                    if (sum[at] != 1.0) {
                        claims[component].push_back({at, std::uint32_t(b), {at, i, run.j, run.k, true, 1.0F, 0.0F}});
                        open = false;
                    } else if (open) {
                        ++own.back().length;
                    } else {
                        own.push_back({at, i, run.j, run.k, 1});
                        open = true;
                    }
                }
            }
        }
        for (const Claim& claim : claims[component]) sum[claim.at] = std::min(sum[claim.at], 1.0);
    });
    shared_.clear();
    for (int component = 0; component < 3; ++component) {
        std::vector<Claim>& list = claims[component];
        std::sort(list.begin(), list.end(),
                  [](const Claim& a, const Claim& b) { return std::pair(a.at, a.body) < std::pair(b.at, b.body); });
        for (std::size_t first = 0, last = 0; first < list.size(); first = last) {
            Shared shared;
            shared.at = list[first].at;
            shared.component = component;
            double total = 0.0;
            for (last = first; last < list.size() && list[last].at == list[first].at; ++last)
                total += double(list[last].face.fraction);
            for (std::size_t c = first; c < last; ++c) {
                const CutFace& face = list[c].face;
                shared.shares.push_back({list[c].body, double(face.fraction) / total, face.i, face.j, face.k});
            }
            shared.fraction = std::min(1.0, total);
            shared_.push_back(std::move(shared));
        }
    }
    ++version_;
    weigh();
}

double ImmersedBodies::seen_volume(std::size_t body) const
{
    const SolidSet& cells = bodies_[body]->solid[detail::cells_component];
    double volume = 0.0;
    for (const SolidRun& run : cells.runs) volume += run.length;
    for (const CutFace& cut : cells.cuts) volume += double(cut.fraction);
    return volume * grid_.cell_volume();
}

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
double forcing_weight(const ForcingOptions& options, double phi, double slip, double dt, double nu, double cell)
{
    if (phi >= 1.0) return 1.0;
    if (options.plain_blend) return phi;
    const double rate = options.viscous_rate * nu / (cell * cell) + options.inertial_rate * std::abs(slip) / cell;
    const double chi = dt * rate * phi / (1.0 - phi);
    return chi / (1.0 + chi);
}

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

/// Reaction of the solid rows of one component; sums of (u* - u_s) eps, not yet times rho V / dt.
template <int c, bool porous>
void measure_runs(const Flow& flow, const std::vector<SolidRun>& runs, const Carrier& carrier, FluidAction& action)
{
    const double* us = flow.provisional(c).data();
    const double* eps = porous ? flow.porous_fields().void_fraction.data() : nullptr;
    const std::ptrdiff_t own = flow.layout().stride[c];
    const double slope = row_slope<c>(carrier);
    double force = 0.0;
    Vector3d torque = Vector3d::Zero();
    for (const SolidRun& run : runs) {
        const Vector3d r = carrier.arm(c, run.i, run.j, run.k);
        const double body = carrier.component_velocity(c, r);
        const double* row = us + run.at;
        const auto slip = [&](std::ptrdiff_t l) {
            const double plain = row[l] - (body + slope * double(l));
            if constexpr (porous) return 0.5 * (eps[run.at + l] + eps[run.at + l - own]) * plain;
            return plain;
        };
        const double f = detail::lane_sum(run.length, slip);
        const double fx =
            c == 0 ? 0.0
                   : carrier.cell * detail::lane_sum(run.length, [&](std::ptrdiff_t l) { return double(l) * slip(l); });
        force += f;
        add_torque<c>(torque, r, f, fx);
    }
    action.force[c] += force;
    action.torque += torque;
}

/// The same for cut faces, whose weights are found here.
template <int c, bool porous>
void measure_cuts(const Flow& flow, const ForcingOptions& options, double dt, std::vector<CutFace>& cuts,
                  const Carrier& carrier, FluidAction& action)
{
    const double* us = flow.provisional(c).data();
    const double* eps = porous ? flow.porous_fields().void_fraction.data() : nullptr;
    const std::ptrdiff_t own = flow.layout().stride[c];
    double force = 0.0, total = 0.0;
    Vector3d torque = Vector3d::Zero(), moments = Vector3d::Zero();
    for (CutFace& cut : cuts) {
        if (cut.shared) continue;
        const Vector3d r = carrier.arm(c, cut.i, cut.j, cut.k);
        const double slip = us[cut.at] - carrier.component_velocity(c, r);
        const double weight =
            forcing_weight(options, double(cut.fraction), slip, dt, flow.options().kinematic_viscosity, carrier.cell);
        cut.weight = float(weight);
        double mass = double(cut.weight);
        if constexpr (porous) mass *= 0.5 * (eps[cut.at] + eps[std::ptrdiff_t(cut.at) - own]);
        force += mass * slip;
        total += mass;
        add_torque<c>(torque, r, mass * slip, 0.0);
        add_moments<c>(moments, r, mass);
    }
    action.force[c] += force;
    action.torque += torque;
    action.forced_mass[c] += total;
    add_inertia<c>(action.forced_inertia, moments);
}

/// u* <- u* + w (u_s - u*) on the faces of one component. \returns the sum of eps times the change
template <int c, bool porous>
double force_faces(Flow& flow, const std::vector<SolidRun>& runs, const std::vector<CutFace>& cuts,
                   const Carrier& carrier)
{
    double* us = flow.provisional(c).data();
    const double* eps = porous ? flow.porous_fields().void_fraction.data() : nullptr;
    const std::ptrdiff_t own = flow.layout().stride[c];
    const double slope = row_slope<c>(carrier);
    double impulse = 0.0;
    for (const SolidRun& run : runs) {
        const double solid = carrier.component_velocity(c, carrier.arm(c, run.i, run.j, run.k));
        double* row = us + run.at;
        impulse += detail::lane_sum(run.length, [&](std::ptrdiff_t l) {
            const double change = solid + slope * double(l) - row[l];
            if constexpr (porous) return 0.5 * (eps[run.at + l] + eps[run.at + l - own]) * change;
            return change;
        });
        for (int l = 0; l < run.length; ++l) row[l] = solid + slope * l;
    }
    for (const CutFace& cut : cuts) {
        if (cut.shared) continue;
        const double solid = carrier.component_velocity(c, carrier.arm(c, cut.i, cut.j, cut.k));
        const double change = double(cut.weight) * (solid - us[cut.at]);
        us[cut.at] += change;
        impulse += (porous ? 0.5 * (eps[cut.at] + eps[std::ptrdiff_t(cut.at) - own]) : 1.0) * change;
    }
    return impulse;
}

}  // namespace

/// What the solid rows resist with; it does not change from step to step.
void ImmersedBodies::weigh()
{
    parallel_blocks(bodies_.size(), 1, [&](std::size_t b, std::size_t) {
        Body& body = *bodies_[b];
        const Carrier carrier(grid_, body.placed, body.placed);
        body.run_mass.setZero();
        body.run_inertia.setZero();
        for_each_component([&](auto component) {
            weigh_runs<component>(body.own_runs[component], carrier, body.run_mass, body.run_inertia);
        });
    });
}

/// Velocity of the solid on a shared face: mean of the bodies weighted by their fractions.
double ImmersedBodies::shared_velocity(const Shared& shared, std::span<const RigidMotion> motions) const
{
    double solid = 0.0;
    for (const Shared::Share& share : shared.shares) {
        const Carrier carrier(grid_, bodies_[share.body]->placed, motions[share.body]);
        solid += share.part *
                 carrier.component_velocity(shared.component, carrier.arm(shared.component, share.i, share.j, share.k));
    }
    return solid;
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
    std::vector<Vector3d> mean_slip(bodies_.size(), Vector3d::Zero());  // over the solid rows
    parallel_blocks(bodies_.size(), 1, [&](std::size_t b, std::size_t) {
        Body& body = *bodies_[b];
        const Carrier carrier(grid_, body.placed, motions[b]);
        FluidAction action;
        action.forced_mass = body.run_mass;
        action.forced_inertia = body.run_inertia;
        for_each_component([&](auto component) {
            constexpr int c = component;
            if (flow.porous()) {
                measure_runs<c, true>(flow, body.own_runs[c], carrier, action);
                mean_slip[b][c] = action.force[c] / std::max(1.0, body.run_mass[c]);
                measure_cuts<c, true>(flow, options_, dt, body.solid[c].cuts, carrier, action);
            } else {
                measure_runs<c, false>(flow, body.own_runs[c], carrier, action);
                mean_slip[b][c] = action.force[c] / std::max(1.0, body.run_mass[c]);
                measure_cuts<c, false>(flow, options_, dt, body.solid[c].cuts, carrier, action);
            }
        });
        actions_[b] = action;
    });
    watch_for_blockage(flow, mean_slip);
    for (Shared& shared : shared_) {
        for_each_component([&](auto component) {
            constexpr int c = component;
            if (shared.component != c) return;
            const double slip = flow.provisional(c)[shared.at] - shared_velocity(shared, motions);
            shared.weight =
                forcing_weight(options_, shared.fraction, slip, dt, flow.options().kinematic_viscosity, grid_.cell);
            for (const Shared::Share& share : shared.shares) {
                const Carrier carrier(grid_, bodies_[share.body]->placed, motions[share.body]);
                const Vector3d r = carrier.arm(c, share.i, share.j, share.k);
                const double part = share.part * shared.weight * flow.face_void_fraction(c, shared.at);
                FluidAction& action = actions_[share.body];
                Vector3d moments = Vector3d::Zero();
                action.force[c] += part * slip;
                action.forced_mass[c] += part;
                add_torque<c>(action.torque, r, part * slip, 0.0);
                add_moments<c>(moments, r, part);
                add_inertia<c>(action.forced_inertia, moments);
            }
        });
    }
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
    impulses_.resize(bodies_.size());
    Vector3d impulse = parallel_sum(bodies_.size(), 1, Vector3d(0.0, 0.0, 0.0), [&](std::size_t b, std::size_t) {
        const Body& body = *bodies_[b];
        const Carrier carrier(grid_, body.placed, motions[b]);
        Vector3d part = Vector3d::Zero();
        for_each_component([&](auto component) {
            constexpr int c = component;
            part[c] = flow.porous() ? force_faces<c, true>(flow, body.own_runs[c], body.solid[c].cuts, carrier)
                                    : force_faces<c, false>(flow, body.own_runs[c], body.solid[c].cuts, carrier);
        });
        impulses_[b] = mass * part;
        return part;
    });
    for (const Shared& shared : shared_) {
        const int c = shared.component;
        double& us = flow.provisional(c)[shared.at];
        const double change = shared.weight * (shared_velocity(shared, motions) - us);
        us += change;
        const double given = flow.face_void_fraction(c, shared.at) * change;
        impulse[c] += given;
        for (const Shared::Share& share : shared.shares) impulses_[share.body][c] += mass * share.part * given;
    }
    flow.add_forcing_impulse(mass * impulse);
}

}  // namespace coral::fluid
