// The explicit half of a step: convection, viscosity, old pressure gradient, drag of the fines.
#include <chrono>
#include <vector>

#include "core/parallel.h"
#include "fluid/detail/advection.h"
#include "fluid/detail/component_sweep.h"
#include "fluid/detail/faces.h"
#include "fluid/detail/lanes.h"
#include "fluid/flow.h"

namespace coral::fluid {

using detail::ComponentView;
using detail::FaceRange;
using detail::low_flux;
using detail::low_volume_flux;
using detail::planes_per_block;
using detail::Stage;

namespace {

double seconds_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

template <class Real, bool porous>
static ComponentView<Real> view_of(int axis, const Layout& layout, const std::array<FlowField, 3>& velocity,
                                   const std::array<FlowField, 3>& flux, const FlowField& eps, double viscous)
{
    ComponentView<Real> view;
    view.u = velocity[axis].data<Real>();
    for (int d = 0; d < 3; ++d) {
        view.q[d] = porous ? flux[d].data<Real>() : velocity[d].data<Real>();
        view.stride[d] = layout.stride[d];
    }
    view.eps = porous ? eps.data<Real>() : nullptr;
    view.axis = axis;
    view.viscous = Real(viscous);
    return view;
}

/// Explicit terms of all components, in blocks of planes.
template <class Real, bool porous, Convection convection>
void Flow::sweep_components(const Stage& stage)
{
    using Sweep = detail::ComponentSweep<Real, porous, convection>;
    const double h = grid_.cell;
    const auto sweep_of = [&](int axis, Real* memory) {
        const ComponentView<Real> view = view_of<Real, porous>(axis, layout_, velocity_, volume_flux_, porous_.void_fraction,
                                                               options_.kinematic_viscosity / h);
        return Sweep(grid_, layout_, view,
                     {pressure_.data<Real>(), stage.held != 0.0 ? held_[axis].data<Real>() : nullptr, rate_[axis].data<Real>(),
                      provisional_[axis].data<Real>(), options_.body_acceleration[axis]},
                     stage, memory);
    };
    const std::size_t each = Sweep::memory(layout_);
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    advective_sum_ = parallel_sum(std::size_t(grid_.cells.z()) + 1, planes_per_block, zero, [&](std::size_t begin, std::size_t end) {
        thread_local std::vector<Real, CacheAligned<Real>> memory;
        memory.resize(3 * each);
        Sweep sweeps[3] = {sweep_of(0, memory.data()), sweep_of(1, memory.data() + each), sweep_of(2, memory.data() + 2 * each)};
        for (int k = int(begin); k < int(end); ++k)
            for (Sweep& sweep : sweeps) sweep.plane(k);
        return Eigen::Vector3d(sweeps[0].transported(), sweeps[1].transported(), sweeps[2].transported());
    });
    advective_sum_ *= options_.density * h * h;
}

template <Convection convection>
void Flow::sweep_all(const Stage& stage)
{
    in_precision(options_.precision, [&]<class Real>(Real) {
        has_fines_ ? sweep_components<Real, true, convection>(stage) : sweep_components<Real, false, convection>(stage);
    });
}

/// Explicit terms of one stage, velocity_ to provisional_, and their part of the tallies.
void Flow::sweep(const Stage& stage)
{
    if (has_fines_) in_precision(options_.precision, [&]<class Real>(Real) { build_volume_flux<Real>(); });
    const Eigen::Vector3d rate = boundary_flux_rate(), advective_before = advective_sum_;
    momentum_.boundary_flux += stage.now * rate - stage.before * flux_rate_;
    flux_rate_ = rate;
    switch (options_.convection) {
        case Convection::none:
            sweep_all<Convection::none>(stage);
            break;
        case Convection::up3:
            sweep_all<Convection::up3>(stage);
            break;
        case Convection::koren:
            sweep_all<Convection::koren>(stage);
            break;
    }
    advective_impulse_ += stage.now * advective_sum_ - stage.before * advective_before;
}

/// Makes the provisional velocity the one that the next stage starts from.
void Flow::start_next_stage()
{
    velocity_.swap(provisional_);
    fill_velocity_ghosts();
}

/// The stages of one step; velocity_ is u^n again afterwards. Projection, drag and forcing are left to the end. So that
/// the stages between stand near the same balance, they take their part of the old pressure gradient and of what drag
/// and forcing did in the last step; the last stage gives the latter back.
void Flow::run_stages(double dt)
{
    if (options_.scheme == TimeScheme::adams_bashforth) {
        // Adams-Bashforth 2 for a changing step; the ratio is limited because a far extrapolation of a noisy rate is
        // not stable
        const double ratio = previous_dt_ > 0.0 ? std::min(dt / previous_dt_, 1.5) : 0.0;
        sweep({(1.0 + 0.5 * ratio) * dt, 0.5 * ratio * dt, dt, 0.0});
        return;
    }
    // Wray's low-storage scheme (Spalart, Moser & Rogers 1991, J. Comput. Phys. 96, appendix A)
    const double first = 8.0 / 15.0 * dt, second = 2.0 / 15.0 * dt;
    sweep({first, 0.0, first, first});
    start_.swap(velocity_);
    start_next_stage();
    sweep({5.0 / 12.0 * dt, 17.0 / 60.0 * dt, second, second});
    start_next_stage();
    sweep({3.0 / 4.0 * dt, 5.0 / 12.0 * dt, dt / 3.0, -(first + second)});
    velocity_.swap(start_);
    if (has_fines_) return;  // apply_fines writes every face
    for (FlowField& f : held_) f.fill(0.0);
}

/// eps u on every face, ghosts included.
template <class Real>
void Flow::build_volume_flux()
{
    if (volume_flux_[0].empty())
        for (FlowField& f : volume_flux_) f = make_field();
    const Real* eps = porous_.void_fraction.data<Real>();
    const auto planes = layout_.total / std::size_t(layout_.stride[2]);
    parallel_blocks(planes, planes_per_block, [&](std::size_t begin, std::size_t end) {
        for (int axis = 0; axis < 3; ++axis) {
            const std::ptrdiff_t s = layout_.stride[axis];
            const std::ptrdiff_t first = std::max(std::ptrdiff_t(begin) * layout_.stride[2], s);
            const Real* u = velocity_[axis].data<Real>();
            Real* q = volume_flux_[axis].data<Real>();
            for (std::ptrdiff_t f = first; f < std::ptrdiff_t(end) * layout_.stride[2]; ++f)
                q[f] = Real(0.5) * (eps[f] + eps[f - s]) * u[f];
        }
    });
}

/// Sum of the momentum fluxes of a component through the low sides of its control volumes at one side of the domain, upwards [m2/s2].
template <class Real, bool porous, Convection convection>
double Flow::side_flux(const ComponentView<Real>& view, int direction, int side) const
{
    const FaceRange range(grid_, view.axis);
    const std::ptrdiff_t inwards = side == 0 ? layout_.stride[direction] : -layout_.stride[direction];
    // half of the control volume of an outlet face is outside: the flux at the face is the mean of both sides
    const bool mean = direction == view.axis && grid_.outlet(direction, side);
    const auto flux = [&](std::ptrdiff_t f) {
        const Real at_side = low_flux<porous, convection>(view, direction, f);
        return mean ? Real(0.5) * (at_side + low_flux<porous, convection>(view, direction, f + inwards)) : at_side;
    };
    const int place = side == 0 ? range.low[direction] : range.high[direction];
    double sum = 0.0;
    if (direction == 0) {
        for (int k = range.low.z(); k < range.high.z(); ++k)
            for (int j = range.low.y(); j < range.high.y(); ++j) {
                const double weight = view.axis == 0 ? 1.0 : detail::row_weight(grid_, view.axis, j, k);
                sum += weight * double(flux(std::ptrdiff_t(layout_.index(place, j, k))));
            }
        return sum;
    }
    const int other = 3 - direction;
    for (int n = range.low[other]; n < range.high[other]; ++n) {
        const int j = direction == 1 ? place : n, k = direction == 1 ? n : place;
        const auto f0 = std::ptrdiff_t(layout_.index(range.low.x(), j, k));
        const auto value = [&](std::ptrdiff_t i) { return flux(f0 + i); };
        const auto lanes = [](std::ptrdiff_t m, const auto& v) { return detail::lane_sum(m, v); };
        sum += direction == view.axis ? lanes(range.row_length(), value)
                                      : detail::weighted_row(grid_, view.axis, range, j, k, lanes, value);
    }
    return sum;
}

/// Momentum entering the fluid through the domain's sides per time [N], with the same fluxes as the sweep.
template <class Real, bool porous, Convection convection>
Eigen::Vector3d Flow::boundary_flux_rate() const
{
    Eigen::Vector3d total = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis) {
        const ComponentView<Real> view = view_of<Real, porous>(axis, layout_, velocity_, volume_flux_, porous_.void_fraction,
                                                               options_.kinematic_viscosity / grid_.cell);
        for (int d = 0; d < 3; ++d)
            if (!grid_.periodic(d))
                total[axis] += side_flux<Real, porous, convection>(view, d, 0) - side_flux<Real, porous, convection>(view, d, 1);
    }
    return options_.density * grid_.cell * grid_.cell * total;
}

template <class Real, Convection convection>
Eigen::Vector3d Flow::boundary_flux_rate() const
{
    return has_fines_ ? boundary_flux_rate<Real, true, convection>() : boundary_flux_rate<Real, false, convection>();
}

Eigen::Vector3d Flow::boundary_flux_rate() const
{
    return in_precision(options_.precision, [&]<class Real>(Real) {
        switch (options_.convection) {
            case Convection::none:
                return boundary_flux_rate<Real, Convection::none>();
            case Convection::koren:
                return boundary_flux_rate<Real, Convection::koren>();
            case Convection::up3:
                break;
        }
        return boundary_flux_rate<Real, Convection::up3>();
    });
}

/// Repairs the momentum moved by the porosity field with a uniform acceleration, then applies the drag of the fines:
/// eps u* <- eps u* + dt (A u^n - B - A u*)   [docs/numerics.md, eq. 5, with A = eps K, B = eps G].
template <class Real>
void Flow::apply_fines(double dt)
{
    const Real step = Real(dt);
    const double volume = options_.density * grid_.cell_volume();
    momentum_.porosity_defect = pending_defect_ + advective_impulse_;
    pending_defect_.setZero();
    for (int axis = 0; axis < 3; ++axis) {
        const FaceRange range(grid_, axis);
        const std::ptrdiff_t own = layout_.stride[axis];
        const Real repair = Real(fluid_mass_[axis] > 0.0 ? -momentum_.porosity_defect[axis] / fluid_mass_[axis] : 0.0);
        const Real* eps = porous_.void_fraction.data<Real>();
        const Real* A = porous_.drag_rate[axis].data<Real>();
        const Real* B = porous_.drag_force[axis].data<Real>();
        const Real* p = pressure_.data<Real>();
        const Real* u = velocity_[axis].data<Real>();
        Real* __restrict us = provisional_[axis].data<Real>();
        Real* __restrict hold = held_[axis].empty() ? nullptr : held_[axis].data<Real>();
        using Pair = Eigen::Vector2d;  // drag on the fluid, pressure gradient on the fines
        const Pair sums =
            parallel_sum(range.planes(), planes_per_block, Pair(0.0, 0.0), [&](std::size_t begin, std::size_t end) {
                Pair sum(0.0, 0.0);
                const std::ptrdiff_t n = range.row_length();
                std::vector<Real> drag(static_cast<std::size_t>(n)), fines(drag), unheld(drag);
                Real *const drag_row = drag.data(), *const fines_row = fines.data();
                const auto lanes = [](std::ptrdiff_t m, const auto& v) { return detail::lane_sum(m, v); };
                for (int k = range.low.z() + int(begin); k < range.low.z() + int(end); ++k)
                    for (int j = range.low.y(); j < range.high.y(); ++j) {
                        const auto f0 = std::ptrdiff_t(layout_.index(range.low.x(), j, k));
                        Real* __restrict hold_row = hold ? hold + f0 : unheld.data();
#pragma GCC ivdep
                        for (std::ptrdiff_t i = 0; i < n; ++i) {
                            const std::ptrdiff_t f = f0 + i;
                            const Real face_eps = Real(0.5) * (eps[f] + eps[f - own]);
                            const Real start = us[f] + repair;
                            const Real change = (A[f] * (u[f] - start) - B[f]) / (face_eps + step * A[f]);
                            us[f] = start + step * change;
                            hold_row[i] = change;
                            drag_row[i] = face_eps * step * change;
                            fines_row[i] = (face_eps - 1) * (p[f] - p[f - own]);
                        }
                        sum[0] += detail::weighted_row(grid_, axis, range, j, k, lanes,
                                                       [&](std::ptrdiff_t i) { return drag_row[i]; });
                        sum[1] += detail::weighted_row(grid_, axis, range, j, k, lanes,
                                                       [&](std::ptrdiff_t i) { return fines_row[i]; });
                    }
                return sum;
            });
        momentum_.drag[axis] = volume * sums[0];
        momentum_.fines_pressure[axis] = volume / grid_.cell * dt * sums[1];
    }
}

void Flow::predict(double dt)
{
    const auto start = std::chrono::steady_clock::now();
    const Eigen::Vector3d last = momentum_.after;
    momentum_ = MomentumTally{};
    momentum_.before = last;
    advective_impulse_.setZero();
    step_ = dt;
    run_stages(dt);
    momentum_.body = dt * fluid_mass_.cwiseProduct(options_.body_acceleration);
    step_limit_ = options_.step_growth * stable_time_step();
    const auto swept = std::chrono::steady_clock::now();
    times_.predictor += std::chrono::duration<double>(swept - start).count();
    if (has_fines_) {
        in_precision(options_.precision, [&]<class Real>(Real) { apply_fines<Real>(dt); });
        times_.fines += seconds_since(swept);
    }
}

}  // namespace coral::fluid
