#pragma once
/// \file dem/detail/point_contact.h
/// The law of one-point contacts, a register full at a time, with exact work.
///
/// Velocity Verlet takes from the motion, in the step from n to n+1, dt/2 (F_n . u_n + F_{n+1} . u_{n+1}), u the velocity in the middle of
/// the step seen from the geometry at either end. What is no spring's force is dissipated, by that very sum. The friction spring moves
/// half a step in the geometry of either end, which gives it just the work that the motion loses:
///     s_{n+1} = R (s_n + dt/2 u_n) + dt/2 u_{n+1}
#include "dem/detail/impl.h"
#include "dem/detail/law_lanes.h"

namespace coral::dem::detail {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

/// Contacts of the same sort as they stand; lanes beyond the last contact repeat it.
struct PointGroup : LawLanes {
    WideVec3Lanes normal, relative;  ///< of a against b; velocity in the middle of the step
    WideVec3Lanes spin_a, spin_b;
    WideLanes overlap, approach, root_mass;
    WideLanes radius_a, radius_b, share;  ///< arms of the contact point: radius - share overlap; b's is radius_b - (1 - share) overlap
    WideLanes smaller;                    ///< radius
    WideVec3Lanes old_spring, old_normal, old_total;
    WideLanes old_overlap;
};

struct PointResult {
    WideVec3Lanes total, spring;  ///< total: force on a
    WideLanes force;  ///< along the normal
    WideLanes stored_normal, stored_tangential, friction, damping;
};

[[gnu::always_inline]] inline PointResult point_law(const PointGroup& g, double cap, double dt)
{
    using V = WideLanes;
    const V zero = all<V>(0.0), half = all<V>(0.5), one = all<V>(1.0), half_dt = all<V>(0.5 * dt);
    PointResult r;
    const V deepest = cap * g.smaller, pressed = min(g.overlap, deepest), old_pressed = min(g.old_overlap, deepest);
    const V elastic = g.kn * pressed;
    r.force = max(elastic + g.cn * g.root_mass * g.approach, zero);

    const V arm_a = g.radius_a - g.share * g.overlap, arm_b = g.radius_b - (one - g.share) * g.overlap;
    const WideVec3Lanes full = g.relative - cross(arm_a * g.spin_a + arm_b * g.spin_b, g.normal);
    const WideVec3Lanes slide = full - dot(full, g.normal) * g.normal;
    const V touched = dot(g.old_normal, g.old_normal) > half ? one : zero;
    const V old_arm_a = g.radius_a - g.share * g.old_overlap, old_arm_b = g.radius_b - (one - g.share) * g.old_overlap;
    const WideVec3Lanes old_full = g.relative - cross(old_arm_a * g.spin_a + old_arm_b * g.spin_b, g.old_normal);
    const WideVec3Lanes old_slide = touched * (old_full - dot(old_full, g.old_normal) * g.old_normal);
    const WideVec3Lanes old_drag = g.old_total - g.kn * old_pressed * g.old_normal + g.kt * g.old_spring;

    const V twist = half_dt * dot(g.spin_a + g.spin_b, g.normal);
    const Rubbed rubbed = rub(g, g.normal, old_slide, slide, twist, g.root_mass, r.force, dt, g.old_spring);
    const WideVec3Lanes s = rubbed.spring, tangential = rubbed.total;
    r.spring = s;
    const WideVec3Lanes pull = (-g.kt) * s;
    r.total = r.force * g.normal + tangential;

    const WideVec3Lanes drag = (r.force - elastic) * g.normal + (tangential - pull);
    const V kept2 = dot(s, s), held2 = dot(g.old_spring, g.old_spring);
    r.stored_normal = g.kn * pressed * (g.overlap - half * pressed);
    r.stored_tangential = half * g.kt * kept2;
    const V taken = half * g.kt * (all<V>(dt) * (dot(g.old_spring, old_slide) + dot(s, slide)) - kept2 + held2);
    r.friction = rubbed.slips ? taken : (touched > zero ? zero : taken);
    r.damping = -half_dt * (dot(old_drag, old_full) * touched + dot(drag, full));
    return r;
}

#pragma GCC diagnostic pop

}  // namespace coral::dem::detail
