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
    double spring() const { return friction > 0.0 ? kt : 0.0; }                  ///< of friction
    double give() const { return spring() > 0.0 ? friction / spring() : 0.0; }  ///< longest spring over the normal force
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
inline double normal_force(double elastic, double approach, const PairLaw& law, double root_mass)
{
    if (law.cn == 0.0) return elastic;
    return std::max(elastic + law.cn * root_mass * approach, 0.0);
}

/// How a place of contact slides in a step.
struct Slide {
    const PairLaw& law;
    const Vec3& normal;          ///< at the end of the step
    const Vec3& slide;           ///< tangential velocity in the middle of the step, seen from the geometry at its end [m/s]
    const Vec3& old_slide;       ///< the same from the geometry at its start; zero for a new contact
    double twist;                ///< mean spin of the pair about the normal [rad/s]
    double root_mass;            ///< sqrt(m*)
};
/// Forces on the first body: of the spring, and with the dashpot.
struct Friction {
    Vec3 pull, total;
};

/// Advances a friction spring by half a step in the geometry of either end, turning it with the pair in between; it then stores just what
/// the motion loses: s' = R (s + dt/2 u) + dt/2 u', |s'| <= mu fn/kt;  F_t = -kt s' - c_t u' while it sticks, |F_t| <= mu fn.
inline Friction rub(const Slide& c, double fn, double dt, Vec3& spring)
{
    const PairLaw& law = c.law;
    if (law.friction == 0.0 || law.kt == 0.0) {
        spring.setZero();
        return {Vec3::Zero(), Vec3::Zero()};
    }
    spring += 0.5 * dt * c.old_slide;
    const double length2 = spring.squaredNorm();
    if (length2 > 0.0) {
        spring += (c.twist * dt) * c.normal.cross(spring);
        spring -= c.normal.dot(spring) * c.normal;
        const double turned2 = spring.squaredNorm();
        if (turned2 > 0.0) spring *= std::sqrt(length2 / turned2);
    }
    spring += 0.5 * dt * c.slide;
    const double bound = law.friction * fn, limit = bound / law.kt, stretched2 = spring.squaredNorm();
    if (stretched2 > limit * limit) {
        spring *= limit / std::sqrt(stretched2);
        const Vec3 pull = -law.kt * spring;
        return {pull, pull};
    }
    const Vec3 pull = -law.kt * spring;
    Vec3 total = pull - (law.ct * c.root_mass) * c.slide;
    const double size2 = total.squaredNorm();
    if (size2 > bound * bound) total *= bound / std::sqrt(size2);
    return {pull, total};
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
    template <class V>
    VectorsOf<V> operator()(VectorsOf<V> r) const
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
