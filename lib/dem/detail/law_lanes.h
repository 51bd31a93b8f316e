#pragma once
/// \file dem/detail/law_lanes.h
/// The laws of contact_law.h, a register full of contacts at a time.
#include "dem/detail/contact_law.h"
#include "dem/detail/lanes.h"

namespace coral::dem::detail {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

struct LawLanes {
    WideLanes kn, kt, friction, give, cn, ct;  ///< kt, give: spring() and give() of PairLaw
};

/// law_of(0), law_of(1), ... in the lanes; the first for all where they are the same.
template <class LawOf>
[[gnu::always_inline]] inline void take_law(bool same, const LawOf& law_of, LawLanes& l)
{
    if (same) {
        const PairLaw& law = law_of(0);
        l.kn = all<WideLanes>(law.kn);
        l.kt = all<WideLanes>(law.spring());
        l.friction = all<WideLanes>(law.friction);
        l.give = all<WideLanes>(law.give());
        l.cn = all<WideLanes>(law.cn);
        l.ct = all<WideLanes>(law.ct);
        return;
    }
    const PairLaw* law[wide_lane_count];
    for (int k = 0; k < wide_lane_count; ++k) law[k] = &law_of(k);
    const auto numbers = [&](const auto& of) { return lanes_from<WideLanes>([&](int k) { return of(*law[k]); }); };
    l.kn = numbers([](const PairLaw& p) { return p.kn; });
    l.kt = numbers([](const PairLaw& p) { return p.spring(); });
    l.friction = numbers([](const PairLaw& p) { return p.friction; });
    l.give = numbers([](const PairLaw& p) { return p.give(); });
    l.cn = numbers([](const PairLaw& p) { return p.cn; });
    l.ct = numbers([](const PairLaw& p) { return p.ct; });
}

/// Springs after a step, and the forces of springs and dashpots on the first bodies.
struct Rubbed {
    WideVec3Lanes spring, total;
    decltype(WideLanes{} < WideLanes{}) slips;
};

/// \param twist  angle by which the pair turns about the normal in the step [rad]
[[gnu::always_inline]] inline Rubbed rub(const LawLanes& law, const WideVec3Lanes& normal, const WideVec3Lanes& old_slide, const WideVec3Lanes& slide,
                                         WideLanes twist, WideLanes root_mass, WideLanes force, double dt, const WideVec3Lanes& spring)
{
    using V = WideLanes;
    const V zero = all<V>(0.0), one = all<V>(1.0), half_dt = all<V>(0.5 * dt);
    const WideVec3Lanes before = spring + half_dt * old_slide;
    WideVec3Lanes s = before + twist * cross(normal, before);
    s = s - dot(normal, s) * normal;
    const V length2 = dot(before, before), turned2 = dot(s, s);
    s = (turned2 > zero ? sqrt(length2 / (turned2 > zero ? turned2 : one)) : zero) * s;
    s = s + half_dt * slide;

    // A slipping spring keeps the length of the limit, and the dashpot beside it is off; one that does not slip may pull too hard with its dashpot.
    const V bound = law.friction * force, limit = law.give * force, stretched2 = dot(s, s);
    const auto slips = stretched2 > limit * limit;
    WideVec3Lanes tangential = (-law.kt) * s + (slips ? zero : -law.ct * root_mass) * slide;
    const V size2 = dot(tangential, tangential);
    const auto over = ~slips & (size2 > bound * bound);
    if (any(slips | over)) {
        const V shrink = (slips ? limit : bound) / sqrt(slips ? stretched2 : over ? size2 : one);
        s = (slips ? shrink : one) * s;
        tangential = (slips | over ? shrink : one) * tangential;
    }
    return {s, tangential, slips};
}

#pragma GCC diagnostic pop

}  // namespace coral::dem::detail
