#pragma once
/// \file fluid/detail/component_sweep.h
/// The explicit terms of one velocity component, plane by plane, so that the sweeps of the three components can go through the fields
/// side by side: what one has read is in the cache for the next.
#include "fluid/detail/advection.h"
#include "fluid/detail/faces.h"
#include "fluid/detail/lanes.h"

namespace coral::fluid::detail {

/// One evaluation of the explicit terms: u* = u + (now R - before R_old)/eps - push (grad p - f) + held H, times in s.
struct Stage {
    double now = 0.0, before = 0.0;  ///< of the rate just found and of the one before it
    double push = 0.0;               ///< of the pressure gradient and the body acceleration
    double held = 0.0;               ///< of what drag and forcing did in the last step
};

/// Fields that a sweep reads and writes besides those of its ComponentView.
template <class Real>
struct SweepFields {
    const Real* pressure = nullptr;
    const Real* held = nullptr;  ///< null where the stage takes none of it
    Real* rate = nullptr;        ///< R_old in, R out
    Real* out = nullptr;         ///< u*
    double acceleration = 0.0;   ///< f [m/s2]
};

/// Sweep over neighbouring planes, upwards: rate = -div(flux) (+ u div q with fines), then as Stage says. Each flux is computed once:
/// rows keep those of the low y side, planes those of the low z side.
template <class Real, bool porous, Convection convection>
class ComponentSweep {
public:
    /// Values that a sweep keeps: two planes, five rows.
    static std::size_t memory(const Layout& layout) { return std::size_t(2 * layout.stride[2] + 5 * layout.stride[1]); }

    ComponentSweep(const GridSpec& grid, const Layout& layout, const ComponentView<Real>& view, const SweepFields<Real>& fields,
                   const Stage& stage, Real* memory)
        : grid_(grid), layout_(layout), view_(view), fields_(fields), stage_(stage), range_(grid, view.axis)
    {
        const std::ptrdiff_t sy = layout.stride[1], sz = layout.stride[2];
        gz_ = memory, qz_ = gz_ + sz;
        gy_ = qz_ + sz, qy_ = gy_ + sy, gx_ = qy_ + sy, qx_ = gx_ + sy, transported_ = qx_ + sy;
    }

    /// Plane k, the first or the one after the last; nothing where the component has no unknown faces there.
    void plane(int k)
    {
        if (k < range_.low.z() || k >= range_.high.z()) return;
        const std::ptrdiff_t n = range_.row_length(), sy = layout_.stride[1];
        if (!started_)
            for (int j = range_.low.y(); j < range_.high.y(); ++j) start_row(2, at(j, k), n, gz_ + j * sy, qz_ + j * sy);
        started_ = true;
        start_row(1, at(range_.low.y(), k), n, gy_, qy_);
        for (int j = range_.low.y(); j < range_.high.y(); ++j) row(j, k);
    }

    /// Of u div q over the rows so far [m2/s2, per h].
    double transported() const { return transported_sum_; }

private:
    static constexpr bool advective = porous && convection != Convection::none;

    std::ptrdiff_t at(int j, int k) const { return std::ptrdiff_t(layout_.index(range_.low.x(), j, k)); }

    void row(int j, int k)
    {
        const std::ptrdiff_t f0 = at(j, k), n = range_.row_length();
        start_row(0, f0, n + 1, gx_, qx_);
        advance(f0, n, gz_ + j * layout_.stride[1], qz_ + j * layout_.stride[1]);
        if (fields_.held) {
            const Real* const hold = fields_.held;
            Real* const out = fields_.out;
            const Real held = Real(stage_.held);
#pragma GCC ivdep
            for (std::ptrdiff_t f = f0; f < f0 + n; ++f) out[f] += held * hold[f];
        }
        if constexpr (advective)
            transported_sum_ += weighted_row(
                grid_, view_.axis, range_, j, k, [](std::ptrdiff_t m, const auto& v) { return lane_sum(m, v); },
                [this](std::ptrdiff_t i) { return transported_[i]; });
    }

    void start_row(int direction, std::ptrdiff_t f0, std::ptrdiff_t count, Real* __restrict g, Real* __restrict q) const
    {
        const ComponentView<Real> view = view_;
#pragma GCC ivdep
        for (std::ptrdiff_t i = 0; i < count; ++i) g[i] = low_flux<porous, convection>(view, direction, f0 + i);
        if constexpr (advective) {
#pragma GCC ivdep
            for (std::ptrdiff_t i = 0; i < count; ++i) q[i] = low_volume_flux(view, direction, f0 + i);
        }
    }

    void advance(std::ptrdiff_t f0, std::ptrdiff_t n, Real* __restrict g, Real* __restrict q)
    {
        const ComponentView<Real> view = view_;
        const std::ptrdiff_t sy = layout_.stride[1], sz = layout_.stride[2], own = layout_.stride[view.axis];
        const Real now = Real(stage_.now), before = Real(stage_.before), push = Real(stage_.push);
        const Real acceleration = Real(fields_.acceleration), inverse_h = Real(1.0 / grid_.cell);
        const Real *const u = view.u, *const p = fields_.pressure, *const eps = view.eps;
        Real *const out = fields_.out, *const rate = fields_.rate;
        Real* __restrict gy = gy_;
        Real* __restrict qy = qy_;
        Real* __restrict gx = gx_;
        Real* __restrict qx = qx_;
        Real* __restrict transported = transported_;
#pragma GCC ivdep
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            const std::ptrdiff_t f = f0 + i;
            const Real high_y = low_flux<porous, convection>(view, 1, f + sy);
            const Real high_z = low_flux<porous, convection>(view, 2, f + sz);
            Real r = ((gx[i] - gx[i + 1]) + (gy[i] - high_y) + (g[i] - high_z)) * inverse_h;
            gy[i] = high_y;
            g[i] = high_z;
            if constexpr (advective) {
                const Real q_y = low_volume_flux(view, 1, f + sy), q_z = low_volume_flux(view, 2, f + sz);
                transported[i] = u[f] * ((qx[i + 1] - qx[i]) + (q_y - qy[i]) + (q_z - q[i]));
                qy[i] = q_y;
                q[i] = q_z;
                r += transported[i] * inverse_h;
            }
            const Real ab = now * r - before * rate[f];
            rate[f] = r;
            const Real force = porous ? ab / (Real(0.5) * (eps[f] + eps[f - own])) : ab;
            out[f] = u[f] + force - push * ((p[f] - p[f - own]) * inverse_h - acceleration);
        }
    }

    const GridSpec& grid_;
    const Layout& layout_;
    ComponentView<Real> view_;
    SweepFields<Real> fields_;
    Stage stage_;
    FaceRange range_;
    bool started_ = false;
    double transported_sum_ = 0.0;
    Real *gz_, *qz_, *gy_, *qy_, *gx_, *qx_, *transported_;  // momentum and volume fluxes through low sides; u div q
};

}  // namespace coral::fluid::detail
