#include "fluid/flow.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"
#include "fluid/detail/faces.h"
#include "fluid/detail/lanes.h"
#include "fluid/poisson.h"

namespace coral::fluid {

using detail::FaceRange;
using detail::planes_per_block;

namespace {

const auto add_lanes = [](std::ptrdiff_t n, const auto& value) { return detail::lane_sum(n, value); };

double seconds_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// What passes the low and the high side of each cell of a row along one axis; pointers of their own let loops vectorise.
template <class Real>
struct RowSides {
    const Real *low, *high;  ///< velocity
    // only with fines: solid flux; void fraction of the cell before, of the cell, of the one after
    const Real *J_low = nullptr, *J_high = nullptr, *eps_low = nullptr, *eps = nullptr, *eps_high = nullptr;

    RowSides(const std::array<FlowField, 3>& u, const PorousFields& porous, const Layout& layout, int axis,
             std::ptrdiff_t c0)
    {
        const auto d = std::size_t(axis);
        const std::ptrdiff_t s = layout.stride[axis];
        low = u[d].data<Real>() + c0, high = low + s;
        if (porous.void_fraction.empty()) return;
        J_low = porous.solid_flux[d].data<Real>() + c0, J_high = J_low + s;
        eps = porous.void_fraction.data<Real>() + c0, eps_low = eps - s, eps_high = eps + s;
    }
    template <bool porous>
    Real outflow(std::ptrdiff_t i) const
    {
        constexpr Real half = Real(0.5);
        if constexpr (!porous) return high[i] - low[i];
        return (half * (eps[i] + eps_high[i]) * high[i] + J_high[i]) - (half * (eps[i] + eps_low[i]) * low[i] + J_low[i]);
    }
    Real speed(std::ptrdiff_t i) const
    {
        const Real a = std::abs(low[i]), b = std::abs(high[i]);
        return a > b ? a : b;
    }
};

}  // namespace

double MomentumTally::relative_error() const
{
    const Eigen::Vector3d defect =
        after - before - (boundary_flux + boundary_pressure + body + drag + forcing - fines_pressure);
    const double size = boundary_flux.norm() + boundary_pressure.norm() + body.norm() + drag.norm() + forcing.norm() +
                        fines_pressure.norm() + (after - before).norm();
    return size > 0.0 ? defect.norm() / size : 0.0;
}

double MassTally::relative_error() const
{
    const double divergence = velocity_scale > 0.0 ? max_divergence * cell / velocity_scale : 0.0;
    return std::max(divergence, inflow > 0.0 ? std::abs(net_flux) / inflow : 0.0);
}

double fit_time_step(double stable, double remaining)
{
    return remaining <= stable ? remaining : remaining / std::ceil(remaining / stable);
}

Flow::Flow(const GridSpec& grid, const FlowOptions& options) : grid_(grid), layout_(grid.cells), options_(options)
{
    grid.validate();
    if (!(options.density > 0.0)) throw UsageError("fluid.density", "is not positive", "water has 1000 kg/m3");
    if (!(options.kinematic_viscosity > 0.0))
        throw UsageError("fluid.kinematic_viscosity", "is not positive", "water has 1e-6 m2/s");
    if (!(options.cfl > 0.0 && options.cfl <= max_cfl(options.scheme)))
        throw UsageError("time.cfl", "is outside (0, " + to_text(max_cfl(options.scheme)) + "]", "0.5 is a good choice");
    poisson_ = std::make_shared<const Poisson>(grid, options.precision);
    for (int axis = 0; axis < 3; ++axis) {
        velocity_[axis] = make_field();
        provisional_[axis] = make_field();
        rate_[axis] = make_field();
        if (options.scheme == TimeScheme::runge_kutta) start_[axis] = make_field(), held_[axis] = make_field();
    }
    pressure_ = make_field();
    work_ = poisson_->make_work();
    restart_history();
}

void Flow::restart_history()
{
    fill_velocity_ghosts();
    fill_pressure_ghosts();
    for (FlowField& rate : rate_) rate.fill(0.0);
    for (FlowField& hold : held_) hold.fill(0.0);
    flux_rate_.setZero();
    advective_sum_.setZero();
    pending_defect_.setZero();
    previous_dt_ = 0.0;
    find_fluid_mass();
    diagnose();
    momentum_ = MomentumTally{};
    momentum_.after = total_momentum();
    step_limit_ = std::numeric_limits<double>::infinity();
    step_limit_ = options_.first_step_factor * stable_time_step();
}

double max_cfl(TimeScheme scheme)
{
    return scheme == TimeScheme::runge_kutta ? 0.55 : 0.8;
}

double Flow::stable_time_step() const
{
    const double h = grid_.cell;
    const double reach = options_.scheme == TimeScheme::runge_kutta ? runge_kutta_reach : 1.0;
    const double limit = reach * 1.5 * options_.cfl / (12.0 * options_.kinematic_viscosity / (h * h) + 1.5 * max_speed_ / h);
    return std::min({limit, options_.max_time_step, step_limit_});
}

PorousFields& Flow::porous_fields_for_writing()
{
    if (porous_.void_fraction.empty()) {
        porous_.void_fraction = make_field(1.0);
        for (int axis = 0; axis < 3; ++axis) {
            porous_.solid_flux[axis] = make_field();
            porous_.drag_rate[axis] = make_field();
            porous_.drag_force[axis] = make_field();
        }
    }
    return porous_;
}

void Flow::change_void_fraction(FlowField& void_fraction)
{
    porous_fields_for_writing();
    fill_centre_ghosts(void_fraction);
    porous_.void_fraction.swap(void_fraction);
    const bool initial = !has_fines_ && previous_dt_ == 0.0;
    has_fines_ = true;
    find_fluid_mass();
    const Eigen::Vector3d momentum = total_momentum();
    if (initial) momentum_.after = momentum;
    pending_defect_ = momentum - momentum_.after;
}

/// Sum over the unknown faces of a component of eps times value(f, i) for face f + i, half at outlets.
template <class Real, class Value>
double Flow::sum_over_faces(int axis, const Value& value) const
{
    const FaceRange range(grid_, axis);
    const Real* eps = has_fines_ ? porous_.void_fraction.data<Real>() : nullptr;
    return parallel_sum(range.planes(), planes_per_block, 0.0, [&](std::size_t begin, std::size_t end) {
        double sum = 0.0;
        for (int k = range.low.z() + int(begin); k < range.low.z() + int(end); ++k)
            for (int j = range.low.y(); j < range.high.y(); ++j) {
                const std::size_t f0 = layout_.index(range.low.x(), j, k);
                const Real* high = eps ? eps + f0 : nullptr;
                const Real* low = eps ? high - layout_.stride[axis] : nullptr;
                sum += eps ? detail::weighted_row(grid_, axis, range, j, k, add_lanes,
                                                  [&](std::ptrdiff_t i) { return Real(0.5) * (low[i] + high[i]) * value(f0, i); })
                           : detail::weighted_row(grid_, axis, range, j, k, add_lanes,
                                                  [&](std::ptrdiff_t i) { return value(f0, i); });
            }
        return sum;
    });
}

/// Mass of fluid that the equations of each component move: half volumes at outlets, none at given velocities.
void Flow::find_fluid_mass()
{
    in_precision(options_.precision, [&]<class Real>(Real) {
        for (int axis = 0; axis < 3; ++axis)
            fluid_mass_[axis] = sum_over_faces<Real>(axis, [](std::size_t, std::ptrdiff_t) { return Real(1); });
    });
    fluid_mass_ *= options_.density * grid_.cell_volume();
}

Eigen::Vector3d Flow::total_momentum() const
{
    Eigen::Vector3d total;
    in_precision(options_.precision, [&]<class Real>(Real) {
        for (int axis = 0; axis < 3; ++axis) {
            const Real* u = velocity_[axis].data<Real>();
            total[axis] = sum_over_faces<Real>(axis, [u](std::size_t f0, std::ptrdiff_t i) { return u[f0 + std::size_t(i)]; });
        }
    });
    return options_.density * grid_.cell_volume() * total;
}

/// Right-hand side div(eps u* + J_s)/dt into work_.
template <class Real>
void Flow::find_source(double dt)
{
    const Real scale = Real(1.0 / (grid_.cell * dt));
    parallel_blocks(std::size_t(grid_.cells.z()), planes_per_block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            for (int j = 0; j < grid_.cells.y(); ++j) {
                const auto c0 = std::ptrdiff_t(layout_.index(0, j, int(k)));
                const RowSides<Real> x(provisional_, porous_, layout_, 0, c0), y(provisional_, porous_, layout_, 1, c0),
                    z(provisional_, porous_, layout_, 2, c0);
                Real* __restrict b = work_.data<Real>() + k * poisson_->plane() + std::size_t(j) * poisson_->row();
                const std::ptrdiff_t n = grid_.cells.x();
                if (has_fines_) {
#pragma GCC ivdep
                    for (std::ptrdiff_t i = 0; i < n; ++i)
                        b[i] = scale * (x.template outflow<true>(i) + y.template outflow<true>(i) + z.template outflow<true>(i));
                } else {
#pragma GCC ivdep
                    for (std::ptrdiff_t i = 0; i < n; ++i)
                        b[i] = scale * (x.template outflow<false>(i) + y.template outflow<false>(i) + z.template outflow<false>(i));
                }
            }
    });
}

/// Rows of component `axis` at plane k: u = u* - dt grad(pi)/eps. \returns the weighted sum of eps u
template <class Real>
double Flow::correct_row(int axis, const FaceRange& range, int j, int k, double dt)
{
    const Real factor = Real(dt / grid_.cell);
    const Real* pi = work_.data<Real>();
    const auto f0 = std::ptrdiff_t(layout_.index(range.low.x(), j, k));
    const std::ptrdiff_t own = layout_.stride[axis];
    const Real* us = provisional_[axis].data<Real>() + f0;
    Real* __restrict u = velocity_[axis].data<Real>() + f0;
    const Real* eps = has_fines_ ? porous_.void_fraction.data<Real>() + f0 : nullptr;
    const auto face_eps = [&](std::ptrdiff_t i) { return eps ? Real(0.5) * (eps[i] + eps[i - own]) : Real(1); };
    const auto row_of = [&](int jj, int kk) {
        return pi + std::size_t(kk) * poisson_->plane() + std::size_t(jj) * poisson_->row();
    };
    const int n = grid_.cells[axis];
    if (axis == 0) {
        const Real* row = row_of(j, k);
        const int low = range.low.x();
        for (int i = std::max(low, 1); i < std::min(range.high.x(), n); ++i)
            u[i - low] = us[i - low] - factor * (row[i] - row[i - 1]) / (eps ? face_eps(i - low) : Real(1));
        if (low == 0) {
            const Real before = grid_.periodic(0) ? row[n - 1] : -row[0];
            u[0] = us[0] - factor * (row[0] - before) / face_eps(0);
        }
        if (range.high.x() > n) u[n - low] = us[n - low] + 2 * factor * row[n - 1] / face_eps(n - low);
    } else {
        const int position = axis == 1 ? j : k;
        const auto row_at = [&](int at) { return axis == 1 ? row_of(at, k) : row_of(j, at); };
        const Real* high = row_at(std::min(position, n - 1));
        const Real* low = row_at(position > 0 ? position - 1 : (grid_.periodic(axis) ? n - 1 : 0));
        // the increment is zero on an outlet face: the cell beyond it holds the negative
        const Real high_sign = position == n ? Real(-1) : Real(1);
        const Real low_sign = position == 0 && !grid_.periodic(axis) ? Real(-1) : Real(1);
        const std::ptrdiff_t m = range.row_length();
        if (eps)
            for (std::ptrdiff_t i = 0; i < m; ++i)
                u[i] = us[i] - factor * (high_sign * high[i] - low_sign * low[i]) / face_eps(i);
        else
            for (std::ptrdiff_t i = 0; i < m; ++i) u[i] = us[i] - factor * (high_sign * high[i] - low_sign * low[i]);
    }
    if (eps)
        return detail::weighted_row(grid_, axis, range, j, k, add_lanes,
                                    [&](std::ptrdiff_t i) { return face_eps(i) * u[i]; });
    return detail::weighted_row(grid_, axis, range, j, k, add_lanes, [&](std::ptrdiff_t i) { return u[i]; });
}

template <class Real>
void Flow::correct(double dt)
{
    const FaceRange ranges[3] = {FaceRange(grid_, 0), FaceRange(grid_, 1), FaceRange(grid_, 2)};
    const auto planes = std::size_t(grid_.cells.z()) + 1;
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    const Eigen::Vector3d sum = parallel_sum(planes, planes_per_block, zero, [&](std::size_t begin, std::size_t end) {
        Eigen::Vector3d part = Eigen::Vector3d::Zero();
        for (int k = int(begin); k < int(end); ++k) {
            for (int axis = 0; axis < 3; ++axis) {
                if (k < ranges[axis].low.z() || k >= ranges[axis].high.z()) continue;
                for (int j = ranges[axis].low.y(); j < ranges[axis].high.y(); ++j)
                    part[axis] += correct_row<Real>(axis, ranges[axis], j, k, dt);
            }
            if (k == grid_.cells.z()) continue;
            for (int j = 0; j < grid_.cells.y(); ++j) {
                Real* p = pressure_.data<Real>() + layout_.index(0, j, k);
                const Real* pi = work_.data<Real>() + std::size_t(k) * poisson_->plane() + std::size_t(j) * poisson_->row();
                for (int i = 0; i < grid_.cells.x(); ++i) p[i] += pi[i];
            }
        }
        return part;
    });
    momentum_.after = options_.density * grid_.cell_volume() * sum;
}

/// Over the cells: cell times |div(eps u + J_s)|, and sum_i |u_i| [m/s].
template <class Real>
Eigen::Vector2d Flow::largest_divergence_and_speed() const
{
    std::vector<Eigen::Vector2d> largest((std::size_t(grid_.cells.z()) + planes_per_block - 1) / planes_per_block,
                                         {0.0, 0.0});
    parallel_blocks(std::size_t(grid_.cells.z()), planes_per_block, [&](std::size_t begin, std::size_t end) {
        Eigen::Vector2d& block = largest[begin / planes_per_block];
        for (int k = int(begin); k < int(end); ++k)
            for (int j = 0; j < grid_.cells.y(); ++j) {
                const auto c0 = std::ptrdiff_t(layout_.index(0, j, k));
                const RowSides<Real> x(velocity_, porous_, layout_, 0, c0), y(velocity_, porous_, layout_, 1, c0),
                    z(velocity_, porous_, layout_, 2, c0);
                const std::ptrdiff_t n = grid_.cells.x();
                const Real speed =
                    detail::lane_max(n, [=](std::ptrdiff_t i) { return x.speed(i) + y.speed(i) + z.speed(i); });
                const auto divergence = [=](auto porous) {
                    return detail::lane_max(n, [=](std::ptrdiff_t i) {
                        constexpr bool p = decltype(porous)::value;
                        return std::abs(x.template outflow<p>(i) + y.template outflow<p>(i) + z.template outflow<p>(i));
                    });
                };
                const Real out = has_fines_ ? divergence(std::true_type{}) : divergence(std::false_type{});
                block = block.cwiseMax(Eigen::Vector2d(double(out), double(speed)));
            }
    });
    Eigen::Vector2d all = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& block : largest) all = all.cwiseMax(block);
    return all;
}

void Flow::diagnose()
{
    const Eigen::Vector2d largest =
        in_precision(options_.precision, [&]<class Real>(Real) { return largest_divergence_and_speed<Real>(); });
    mass_ = MassTally{};
    mass_.cell = grid_.cell;
    mass_.max_divergence = largest[0] / grid_.cell;
    mass_.velocity_scale = max_speed_ = largest[1];
    balance_sides();
}

/// Keeps only `part` of the last increment in the pressure. What the step before left undone inside grains is an impulse
/// of its own length; a step of a fiftieth of that would answer with fifty times the pressure, and hand it on.
template <class Real>
void Flow::relax_pressure(double part)
{
    parallel_blocks(std::size_t(grid_.cells.z()), planes_per_block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            for (int j = 0; j < grid_.cells.y(); ++j) {
                Real* p = pressure_.data<Real>() + layout_.index(0, j, int(k));
                const Real* pi = work_.data<Real>() + k * poisson_->plane() + std::size_t(j) * poisson_->row();
                for (int i = 0; i < grid_.cells.x(); ++i) p[i] -= Real(1.0 - part) * pi[i];
            }
    });
    fill_pressure_ghosts();
}

void Flow::project(double dt)
{
    const auto start = std::chrono::steady_clock::now();
    apply_given_velocities(provisional_);
    in_precision(options_.precision, [&]<class Real>(Real) { find_source<Real>(dt); });
    poisson_->solve(work_, turned_);
    const auto solved = std::chrono::steady_clock::now();
    in_precision(options_.precision, [&]<class Real>(Real) { correct<Real>(dt); });
    if (!momentum_.after.allFinite())
        throw Error("flow", "the velocity is no longer finite after step " + std::to_string(times_.steps),
                    "lower time.cfl or cap the time step");
    fill_velocity_ghosts();
    fill_pressure_ghosts();
    momentum_.boundary_pressure = dt * boundary_pressure_force();
    if (dt < 0.7 * previous_dt_)
        in_precision(options_.precision, [&]<class Real>(Real) { relax_pressure<Real>(dt / previous_dt_); });
    diagnose();
    previous_dt_ = dt;
    ++times_.steps;
    times_.poisson += std::chrono::duration<double>(solved - start).count();
    times_.correction += seconds_since(solved);
}

FlowState Flow::save() const
{
    FlowState state;
    state.velocity = velocity_;
    state.pressure = pressure_;
    state.previous_rate = options_.scheme == TimeScheme::runge_kutta ? held_ : rate_;
    if (has_fines_) state.void_fraction = porous_.void_fraction;
    state.scalars = {previous_dt_, step_limit_, max_speed_, double(times_.steps)};
    for (const Eigen::Vector3d& v : {flux_rate_, advective_sum_, pending_defect_, momentum_.after})
        state.scalars.insert(state.scalars.end(), v.data(), v.data() + 3);
    state.scalars.push_back(double(options_.scheme));
    return state;
}

void Flow::restore(const FlowState& state)
{
    const auto fits = [&](const FlowField& f) { return f.size() == layout_.total; };
    const std::size_t scalars = state.scalars.size();  // states of before there were two schemes have one less
    bool whole = fits(state.pressure) && (scalars == 16 || scalars == 17) &&
                 (state.void_fraction.empty() || fits(state.void_fraction));
    for (int axis = 0; axis < 3; ++axis) whole = whole && fits(state.velocity[axis]) && fits(state.previous_rate[axis]);
    if (!whole) throw Error("flow state", "belongs to another grid", "resume with the case that wrote it");
    const Precision precision = options_.precision;
    for (int axis = 0; axis < 3; ++axis) velocity_[axis] = state.velocity[axis].in(precision);
    pressure_ = state.pressure.in(precision);
    const bool same_scheme = double(options_.scheme) == (scalars == 17 ? state.scalars.back() : 0.0);
    std::array<FlowField, 3>& history = options_.scheme == TimeScheme::runge_kutta ? held_ : rate_;
    for (int axis = 0; axis < 3; ++axis) history[axis] = same_scheme ? state.previous_rate[axis].in(precision) : make_field();
    has_fines_ = !state.void_fraction.empty();
    if (has_fines_) porous_fields_for_writing().void_fraction = state.void_fraction.in(precision);
    const double* s = state.scalars.data();
    previous_dt_ = same_scheme ? s[0] : 0.0, step_limit_ = s[1], times_.steps = std::uint64_t(s[3]);
    const double speed = s[2];
    s += 4;
    momentum_ = MomentumTally{};
    for (Eigen::Vector3d* v : {&flux_rate_, &advective_sum_, &pending_defect_, &momentum_.after}) {
        *v = Eigen::Vector3d(s[0], s[1], s[2]);
        s += 3;
    }
    find_fluid_mass();
    diagnose();
    max_speed_ = speed;
}

}  // namespace coral::fluid
