#pragma once
/// \file dem/detail/lanes.h
/// Four numbers, or four vectors, side by side: contacts are worked four at a time. Every lane does what scalar code would, in the same
/// order, so a contact's result does not depend on its neighbours in a group.
#include <Eigen/Core>
#include <cmath>
#include <numbers>

namespace coral::dem::detail {

// GCC warns that passing these by value depends on the instruction set; all uses are inline.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

typedef double Lanes __attribute__((vector_size(32)));
typedef float FloatLanes __attribute__((vector_size(16)));

constexpr int lane_count = 4;

[[gnu::always_inline]] inline Lanes all(double value) { return Lanes{value, value, value, value}; }
[[gnu::always_inline]] inline Lanes widened(FloatLanes a) { return __builtin_convertvector(a, Lanes); }
[[gnu::always_inline]] inline Lanes sqrt(Lanes a)
{
    Lanes root;
    for (int k = 0; k < lane_count; ++k) root[k] = std::sqrt(a[k]);
    return root;
}
[[gnu::always_inline]] inline Lanes nearbyint(Lanes a)
{
    Lanes whole;
    for (int k = 0; k < lane_count; ++k) whole[k] = std::nearbyint(a[k]);
    return whole;
}
[[gnu::always_inline]] inline Lanes min(Lanes a, Lanes b) { return a < b ? a : b; }
[[gnu::always_inline]] inline Lanes max(Lanes a, Lanes b) { return a > b ? a : b; }

/// Argument of re + i im, between -pi and pi, to two units in the last place: the rational form of Cephes (Moshier 1989) for the arc tangent
/// below tan(3 pi/16), 45 degrees taken off above pi/8.
[[gnu::always_inline]] inline Lanes argument(Lanes re, Lanes im)
{
    const Lanes zero = all(0.0), x = max(re, -re), y = max(im, -im), low = min(x, y), high = max(x, y);
    const auto steep = low > all(0.41421356237309503) * high;
    const Lanes t = (steep ? low - high : low) / (steep ? low + high : high), z = t * t;
    const Lanes p = (((all(-8.750608600031904122785e-1) * z - all(1.615753718733365076637e1)) * z - all(7.500855792314704667340e1)) * z -
                     all(1.228866684490136173410e2)) * z - all(6.485021904942025371773e1);
    const Lanes q = ((((z + all(2.485846490142306297962e1)) * z + all(1.650270098316988542046e2)) * z + all(4.328810604912902668951e2)) * z +
                     all(4.853903996359136964868e2)) * z + all(1.945506571482613964425e2);
    Lanes angle = t + t * z * p / q + (steep ? all(0.25 * std::numbers::pi) : zero);
    angle = y > x ? all(0.5 * std::numbers::pi) - angle : angle;
    angle = re < zero ? all(std::numbers::pi) - angle : angle;
    return im < zero ? -angle : angle;
}

[[gnu::always_inline]] inline double sum(Lanes a) { return (a[0] + a[1]) + (a[2] + a[3]); }

struct Vec3Lanes {
    Lanes x, y, z;
};
[[gnu::always_inline]] inline Vec3Lanes operator+(const Vec3Lanes& a, const Vec3Lanes& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
[[gnu::always_inline]] inline Vec3Lanes operator-(const Vec3Lanes& a, const Vec3Lanes& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
[[gnu::always_inline]] inline Vec3Lanes operator*(Lanes s, const Vec3Lanes& a) { return {s * a.x, s * a.y, s * a.z}; }
[[gnu::always_inline]] inline Lanes dot(const Vec3Lanes& a, const Vec3Lanes& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
[[gnu::always_inline]] inline Vec3Lanes cross(const Vec3Lanes& a, const Vec3Lanes& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Vectors at four places, one a lane.
[[gnu::always_inline]] inline Vec3Lanes gather(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d)
{
    return {Lanes{a.x(), b.x(), c.x(), d.x()}, Lanes{a.y(), b.y(), c.y(), d.y()}, Lanes{a.z(), b.z(), c.z(), d.z()}};
}
[[gnu::always_inline]] inline Eigen::Vector3d lane(const Vec3Lanes& v, int k) { return {v.x[k], v.y[k], v.z[k]}; }

#pragma GCC diagnostic pop

}  // namespace coral::dem::detail
