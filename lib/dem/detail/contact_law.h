#pragma once
/// \file dem/detail/contact_law.h
/// The scalar laws that all contact loops share. SI; forces act on the first body, normals point from the second to the first.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "dem/detail/lanes.h"

namespace coral::dem::detail {

using Vec3 = Eigen::Vector3d;

/// Two materials in contact.
struct PairLaw {
    double kn = 0, kt = 0, friction = 0, damping = 0;
    double cn = 0, ct = 0;  ///< 2 zeta sqrt(kn), 2 zeta sqrt(kt); times sqrt(m*) they are the dashpots
};

/// Energies of the contacts of a block of the loop; summed block by block, in order.
struct LoopSums {
    double elastic_normal = 0, elastic_tangential = 0;  ///< [J]
    double friction = 0, damping = 0;                   ///< dissipated in this step [J]
    std::int64_t touching = 0, tests = 0, deep = 0;
    std::int64_t node_queries = 0;
    double max_overlap = 0;  ///< overlap / smaller radius
    void add(const LoopSums& o)
    {
        elastic_normal += o.elastic_normal;
        elastic_tangential += o.elastic_tangential;
        friction += o.friction;
        damping += o.damping;
        touching += o.touching;
        tests += o.tests;
        node_queries += o.node_queries;
        deep += o.deep;
        max_overlap = std::max(max_overlap, o.max_overlap);
    }
};

/// Normal force of the linear law with damping that never pulls:
///     f = max(kn delta + c v_a, 0), c = 2 zeta sqrt(m* kn)
/// \param elastic   elastic part kn delta (times |grad Phi|) [N]
/// \param approach  v_a at the end of the step, foreseen with the accelerations of its start: with the velocity of the middle
///                  the damping would lag half a step behind the spring, and stiffen it by zeta omega dt
inline double normal_force(double elastic, double approach, const PairLaw& law, double root_mass, double dt, LoopSums& sums)
{
    if (law.cn == 0.0) return elastic;
    const double drag = law.cn * root_mass * approach;
    if (elastic + drag <= 0.0) {
        // The clamp lets the spring relax without pushing: what it held is lost at the rate it relaxes.
        sums.damping -= elastic * approach * dt;
        return 0.0;
    }
    sums.damping += drag * approach * dt;
    return elastic + drag;
}

/// Advances a friction spring and returns the tangential force on the first body:
///     s turns with the pair, s += v_t dt, |s| <= mu fn/kt;  F_t = -kt s - c_t v_t while it sticks, |F_t| <= mu fn
/// \param velocity  tangential velocity of the first body against the second [m/s]
/// \param root_mass  sqrt(m*)
/// \param twist     mean spin of the pair about the normal [rad/s]
/// \param share     part of the pair's force that this spring carries (1 for one-point contacts)
[[gnu::always_inline]] inline Vec3 tangential_force(const PairLaw& law, double fn, const Vec3& n, const Vec3& velocity, double twist, double root_mass, double dt,
                             double share, Vec3& spring, LoopSums& sums)
{
    if (law.friction == 0.0 || law.kt == 0.0) {
        spring.setZero();
        return Vec3::Zero();
    }
    const double length2 = spring.squaredNorm();
    if (length2 > 0.0) {
        spring += (twist * dt) * n.cross(spring);
        spring -= n.dot(spring) * n;
        const double turned2 = spring.squaredNorm();
        if (turned2 > 0.0) spring *= std::sqrt(length2 / turned2);
    }
    spring += velocity * dt;
    const double limit = law.friction * fn / law.kt;
    const double stretched2 = spring.squaredNorm();
    if (stretched2 > limit * limit) {
        const double stretched = std::sqrt(stretched2);
        sums.friction += law.kt * share * limit * (stretched - limit);
        spring *= limit / stretched;
        sums.elastic_tangential += 0.5 * law.kt * share * limit * limit;
        return -law.kt * share * spring;
    }
    sums.elastic_tangential += 0.5 * law.kt * share * stretched2;
    Vec3 force = -law.kt * spring;
    if (law.damping > 0.0) {
        const Vec3 drag = (-law.ct * root_mass) * velocity;
        Vec3 total = force + drag;
        const double size2 = total.squaredNorm(), bound = law.friction * fn;
        if (size2 > bound * bound) total *= bound / std::sqrt(size2);
        sums.damping -= share * (total - force).dot(velocity) * dt;
        force = total;
    }
    return share * force;
}

/// c of the node potential [docs/numerics.md, contact].
inline constexpr double sigmoid = 100.0;

/// Energy-conserving node potential of depth d (sigmoid of the paper family), per k_a A:
///     U = d u/sqrt(1+u^2),  f = u (2+u^2)/(1+u^2)^1.5,  u = 100 d/d*
struct NodePotential {
    double energy, force;
};
inline NodePotential node_potential(double depth, double inverse_length)
{
    const double u = depth * inverse_length, q = 1.0 + u * u, root = std::sqrt(q);
    return {depth * u / root, u * (1.0 + q) / (q * root)};
}

/// Nearest image of a difference of positions.
struct Periodic {
    Vec3 length = Vec3::Zero(), inverse = Vec3::Zero();
    bool any = false;
    Vec3 operator()(Vec3 r) const
    {
        if (any)
            for (int k = 0; k < 3; ++k) r[k] -= length[k] * std::nearbyint(r[k] * inverse[k]);
        return r;
    }
    Vec3Lanes operator()(Vec3Lanes r) const
    {
        if (any) {
            r.x -= length.x() * nearbyint(r.x * inverse.x());
            r.y -= length.y() * nearbyint(r.y * inverse.y());
            r.z -= length.z() * nearbyint(r.z * inverse.z());
        }
        return r;
    }
};

}  // namespace coral::dem::detail
