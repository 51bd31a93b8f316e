#pragma once
/// \file dem/detail/point_contact.h
/// The law of one-point contacts, four at a time, with exact work.
///
/// Velocity Verlet takes from the motion, in the step from n to n+1, dt/2 (F_n . u_n + F_{n+1} . u_{n+1}), u the velocity in the middle of
/// the step seen from the geometry at either end. What is no spring's force is dissipated, by that very sum. The friction spring moves
/// half a step in the geometry of either end, which gives it just the work that the motion loses:
///     s_{n+1} = R (s_n + dt/2 u_n) + dt/2 u_{n+1}
#include "dem/detail/impl.h"
#include "dem/detail/lanes.h"

namespace coral::dem::detail {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

/// Four contacts of the same sort as they stand; lanes beyond the last contact repeat it.
struct PointGroup {
    Vec3Lanes normal, relative;  ///< of a against b; velocity in the middle of the step
    Vec3Lanes spin_a, spin_b;
    Lanes overlap, approach, root_mass;
    Lanes radius_a, radius_b, share;  ///< arms of the contact point: radius - share overlap; b's is radius_b - (1 - share) overlap
    Lanes smaller;                    ///< radius
    Lanes kn, kt, friction, cn, ct;
    Vec3Lanes old_spring, old_normal, old_drag;
    Lanes old_overlap, touched;       ///< touched: 1 where the contact was there at the end of the last step
};

struct PointResult {
    Vec3Lanes tangential, spring, drag;
    Lanes force, arm_a, arm_b;
    Lanes stored_normal, stored_tangential, friction, damping;
};

[[gnu::always_inline]] inline PointResult point_law(const PointGroup& g, double cap, double dt)
{
    const Lanes zero = all(0.0), half = all(0.5), one = all(1.0), half_dt = all(0.5 * dt);
    PointResult r;
    const Lanes deepest = cap * g.smaller, pressed = min(g.overlap, deepest);
    const Lanes elastic = g.kn * pressed;
    r.force = max(elastic + g.cn * g.root_mass * g.approach, zero);
    r.arm_a = g.radius_a - g.share * g.overlap;
    r.arm_b = g.radius_b - (one - g.share) * g.overlap;

    const Vec3Lanes full = g.relative - cross(r.arm_a * g.spin_a + r.arm_b * g.spin_b, g.normal);
    const Vec3Lanes slide = full - dot(full, g.normal) * g.normal;
    const Lanes old_arm_a = g.radius_a - g.share * g.old_overlap, old_arm_b = g.radius_b - (one - g.share) * g.old_overlap;
    const Vec3Lanes old_full = g.relative - cross(old_arm_a * g.spin_a + old_arm_b * g.spin_b, g.old_normal);
    const Vec3Lanes old_slide = g.touched * (old_full - dot(old_full, g.old_normal) * g.old_normal);

    const Vec3Lanes before = g.old_spring + half_dt * old_slide;
    const Lanes twist = all(0.5 * dt) * dot(g.spin_a + g.spin_b, g.normal);
    Vec3Lanes s = before + twist * cross(g.normal, before);
    s = s - dot(g.normal, s) * g.normal;
    const Lanes length2 = dot(before, before), turned2 = dot(s, s);
    s = (turned2 > zero ? sqrt(length2 / (turned2 > zero ? turned2 : one)) : zero) * s;
    s = s + half_dt * slide;

    // A slipping spring keeps the length of the limit, and the dashpot beside it is off.
    const Lanes bound = g.friction * r.force, stretched2 = dot(s, s);
    const Lanes limit = g.kt > zero ? bound / (g.kt > zero ? g.kt : one) : zero;
    const auto slips = stretched2 > limit * limit;
    const Lanes shrink = slips ? limit / sqrt(slips ? stretched2 : one) : one;
    r.spring = shrink * s;
    const Vec3Lanes pull = (-g.kt) * r.spring;
    const Lanes dashpot = slips ? zero : -g.ct * g.root_mass;
    Vec3Lanes total = pull + dashpot * slide;
    const Lanes size2 = dot(total, total);
    const auto over = size2 > bound * bound;
    total = (over ? bound / sqrt(over ? size2 : one) : one) * total;
    r.tangential = total;
    r.drag = (r.force - elastic) * g.normal + (total - pull);

    const Lanes kept2 = dot(r.spring, r.spring), held2 = dot(g.old_spring, g.old_spring);
    r.stored_normal = g.kn * pressed * (g.overlap - half * pressed);
    r.stored_tangential = half * g.kt * kept2;
    const Lanes taken = half * g.kt * (all(dt) * (dot(g.old_spring, old_slide) + dot(r.spring, slide)) - kept2 + held2);
    r.friction = slips ? taken : (g.touched > zero ? zero : taken);
    r.damping = -half_dt * (dot(g.old_drag, old_full) * g.touched + dot(r.drag, full));
    return r;
}

#pragma GCC diagnostic pop

}  // namespace coral::dem::detail
