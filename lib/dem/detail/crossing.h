#pragma once
/// \file dem/detail/crossing.h
/// Correction of one-point contacts in the step in which they open or close.
#include "dem/detail/impl.h"

namespace coral::dem::detail {

/// Work of a contact over the step in which it opens or closes, overlap d0 -> d1. The trapezoid of the two forces takes kn d1 (d1 - d0)/2
/// where the spring holds kn d1^2/2 (d0 < 0 < d1): the excess -kn d0 d1/2 goes back to the motion; on opening the same is taken.
/// The dashpot acts for half the step, but should for the part d1/(d1 - d0) of it (opening: no force is left to correct).
inline void add_crossing(std::vector<Crossing>& list, Index a, Index b, const PairLaw& pair, double before, double now, double approach,
                         double root_mass, double dt, const Vec3& normal, LoopSums& sums)
{
    if (before * now >= 0.0) return;
    const double spring = -0.5 * pair.kn * before * now;
    if (now < 0.0) {
        list.push_back({a, b, -spring, normal, Vec3::Zero()});
        return;
    }
    const double dashpot = pair.cn * root_mass * approach * approach * dt * (now / (now - before) - 0.5);
    sums.damping += dashpot;
    list.push_back({a, b, spring - dashpot, normal, Vec3::Zero()});
}

}  // namespace coral::dem::detail
