#pragma once
/// \file dem/detail/facet_quads.h
/// What a ball presses on triangles, four at a time.
///
/// A ball of radius R at c stores in the surface that it covers
///     U = k_a int (R^2 - |c - x|^2)/(2R) dA over |x - c| < R,  k_a = kn/(2 pi R),      F = -dU/dc = k_a int (c - x)/R dA
/// On a plane at overlap d this is kn d^2/2 (1 - d/2R)^2: the linear law. It is a sum over the surface, so that every wall that the ball
/// touches has its part without being found as one, and a polynomial in the plane of each triangle, so that it and its gradient are exact.
#include "dem/detail/lanes.h"

namespace coral::dem::detail {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"  // as in lanes.h

/// Four triangles side by side, with what stays the same while a ball moves over them. A contact step of a packing reads thousands of them,
/// more than its share of a cache holds, so corners are kept in the single precision that surfaces have, and none shares a line with the next.
struct alignas(64) FacetQuad {
    FloatLanes corner[3][3];  ///< by corner and axis [m]
    double clearance;         ///< no triangle was nearer than this to where they were gathered [m]
    Vec3Lanes normal;         ///< unit; the corners run counter-clockwise about it
    Lanes per_length[3];      ///< 1 / length of the side that begins at each corner [1/m]

    /// Puts a triangle into a lane, its corners rounded to single precision; they must span an area.
    void set(int lane, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);
    /// A lane that no ball touches.
    void clear(int lane);
    /// Corner k as seen from a point.
    [[gnu::always_inline]] Vec3Lanes corner_from(const Vec3Lanes& point, int k) const
    {
        return Vec3Lanes{widened(corner[k][0]), widened(corner[k][1]), widened(corner[k][2])} - point;
    }
};

inline void prefetch(const FacetQuad& quad)
{
    for (std::size_t byte = 0; byte < sizeof quad; byte += 64) __builtin_prefetch(reinterpret_cast<const char*>(&quad) + byte);
}

/// Integrals over what a ball covers of each triangle.
template <class V>
struct PressOf {
    V covered;           ///< 1 or 0: whether any of the triangle is; without it the other values mean nothing
    VectorsOf<V> force;  ///< int (c - x)/R dA [m2]
    V size;              ///< of the force [m2]
    V energy;            ///< int (R^2 - |c - x|^2)/(2R) dA [m3]
};
using QuadPress = PressOf<Lanes>;

#pragma GCC diagnostic pop

/// \returns whether the ball covers any part of any of them; `press` is set only then
bool press_on(const FacetQuad& quad, const Eigen::Vector3d& centre, double radius, QuadPress& press);
/// The same of two quads, side by side where registers are wide enough.
bool press_on(const FacetQuad& one, const FacetQuad& other, const Eigen::Vector3d& centre, double radius, QuadPress (&press)[2]);

}  // namespace coral::dem::detail
