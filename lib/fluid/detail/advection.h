#pragma once
/// \file fluid/detail/advection.h
/// Momentum flux of one velocity component through one side of its control volume. Used by the predictor's sweeps and,
/// on the domain's sides, by the momentum tally: both must see the same formula.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "fluid/flow.h"

namespace coral::fluid::detail {

/// q times the upwind-biased (kappa = 1/3) value between `left` and `right`; `far_left`, `far_right` are the next ones.
/// For q > 0 it is q (-far_left + 5 left + 2 right)/6, mirrored for q < 0; written without a branch.
template <class Real>
inline Real flux_up3(Real q, Real far_left, Real left, Real right, Real far_right)
{
    const Real central = 7 * (left + right) - (far_left + far_right);
    const Real upwind = (far_right - far_left) - 3 * (right - left);
    return (q * central + std::abs(q) * upwind) * Real(1.0 / 12.0);
}

/// Koren-limited value from C, its downwind neighbour D and upwind neighbour U.
template <class Real>
inline Real koren_value(Real U, Real C, Real D)
{
    const Real a = C - U, b = D - C;
    const Real size = std::min(2 * std::abs(a), std::min((std::abs(a) + 2 * std::abs(b)) / 3, 2 * std::abs(b)));
    return C + (a * b > 0 ? std::copysign(size, a) / 2 : Real(0));
}

template <class Real>
inline Real flux_koren(Real q, Real far_left, Real left, Real right, Real far_right)
{
    return q * (q > 0 ? koren_value(far_left, left, right) : koren_value(far_right, right, left));
}

/// Pointers and strides of one component; `q` are the volume fluxes eps u (the velocities without fines).
template <class Real>
struct ComponentView {
    const Real* u = nullptr;
    const Real* q[3] = {};
    const Real* eps = nullptr;  ///< cells; only with fines
    std::ptrdiff_t stride[3] = {};
    int axis = 0;
    Real viscous = 0;  ///< nu / h [m/s]
};

/// Flux [m2/s2] through the low side (along `direction`) of the control volume of face f: at the centre of cell f - s
/// when `direction` is the component's own axis, else at the edge between f - s and f. Positive along +direction.
template <bool porous, Convection convection, class Real>
inline Real low_flux(const ComponentView<Real>& view, int direction, std::ptrdiff_t f)
{
    const std::ptrdiff_t s = view.stride[direction], own = view.stride[view.axis];
    const Real* u = view.u;
    Real flux = 0;
    if constexpr (convection != Convection::none) {
        const Real q = Real(0.5) * (view.q[direction][f - own] + view.q[direction][f]);
        if constexpr (convection == Convection::up3)
            flux = flux_up3(q, u[f - 2 * s], u[f - s], u[f], u[f + s]);
        else
            flux = flux_koren(q, u[f - 2 * s], u[f - s], u[f], u[f + s]);
    }
    Real viscous = view.viscous;
    if constexpr (porous) {
        const Real* eps = view.eps;
        viscous *= direction == view.axis ? eps[f - s] : Real(0.25) * (eps[f] + eps[f - own] + eps[f - s] + eps[f - s - own]);
    }
    return flux - viscous * (u[f] - u[f - s]);
}

/// Volume flux through the same side [m/s].
template <class Real>
inline Real low_volume_flux(const ComponentView<Real>& view, int direction, std::ptrdiff_t f)
{
    return Real(0.5) * (view.q[direction][f - view.stride[view.axis]] + view.q[direction][f]);
}

}  // namespace coral::fluid::detail
