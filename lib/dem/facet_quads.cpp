#include "dem/detail/facet_quads.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace coral::dem::detail {

namespace {

using Mask = decltype(Lanes{} < Lanes{});

bool any(Mask m)
{
    return (m[0] | m[1] | m[2] | m[3]) != 0;
}

void set_lane(Vec3Lanes& v, int lane, const Eigen::Vector3d& value)
{
    v.x[lane] = value.x();
    v.y[lane] = value.y();
    v.z[lane] = value.z();
}

/// Integrals over the part of each triangle that lies in the disc of squared radius a2 about the foot of the ball's centre in its plane,
/// gathered side by side (Green): area, polar moment, and first moment. Angles of the arcs are multiplied up as complex numbers, so that
/// one arc tangent serves.
struct DiscParts {
    Lanes a2, area = all(0.0), polar = all(0.0), turn_re = all(1.0), turn_im = all(0.0);
    Vec3Lanes first{all(0.0), all(0.0), all(0.0)};
    Mask crossed{};                      ///< some side runs through the disc
    Mask foot_in = Mask{-1, -1, -1, -1};  ///< the disc's middle is in the triangle
    Mask arcs{};                         ///< part of the disc's rim may be in the triangle

    [[gnu::always_inline]] void arc(Lanes e, Lanes from, Lanes to)
    {
        const Mask there = to > from;
        const Lanes re = there ? e * e + from * to : all(1.0), im = there ? e * (to - from) : all(0.0), t = turn_re * re - turn_im * im;
        turn_im = turn_re * im + turn_im * re;
        turn_re = t;
        arcs |= there;
    }

    /// Side from p to q (from the ball's centre), the triangle on the left.
    [[gnu::always_inline]] void side(const Vec3Lanes& p, const Vec3Lanes& q, const Vec3Lanes& normal, Lanes per_length)
    {
        const Lanes zero = all(0.0);
        const Vec3Lanes u = per_length * (q - p), out = cross(u, normal);
        const Lanes e = dot(p, out), t1 = dot(p, u), t2 = dot(q, u), half2 = a2 - e * e, half = sqrt(max(half2, zero));
        const Lanes low = min(max(-half, t1), t2), high = min(max(half, t1), t2);
        arc(e, t1, low);
        arc(e, high, t2);
        const Lanes length = high - low, cube = (high * high * high - low * low * low) * all(1.0 / 3.0);
        const Lanes push = all(0.5) * (cube - half2 * length);
        area += all(0.5) * e * length;
        polar += all(0.25) * e * (e * e * length + cube);
        first = first + push * out;
        crossed |= length > zero;
        foot_in &= e > zero;
    }

    void close()
    {
        if (!any(arcs)) return;
        const Lanes zero = all(0.0), whole = all(2.0 * std::numbers::pi);
        Lanes angle = argument(turn_re, turn_im);
        // Between 0 and 2 pi; rounding must not make one of the other.
        angle = angle < all(-1e-6) ? angle + whole : angle;
        angle = crossed ? angle : foot_in ? whole : zero;
        angle = arcs ? angle : zero;
        area += all(0.5) * a2 * angle;
        polar += all(0.25) * a2 * a2 * angle;
    }
};

}  // namespace

void FacetQuad::set(int lane, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c)
{
    const Eigen::Vector3f rounded[] = {a.cast<float>(), b.cast<float>(), c.cast<float>()};
    const auto side = [&](int from, int to) { return (rounded[to].cast<double>() - rounded[from].cast<double>()).eval(); };
    for (int k = 0; k < 3; ++k) {
        for (int axis = 0; axis < 3; ++axis) corner[k][axis][lane] = rounded[k][axis];
        per_length[k][lane] = 1.0 / side(k, (k + 1) % 3).norm();
    }
    set_lane(normal, lane, side(0, 1).cross(side(0, 2)).normalized());
}

void FacetQuad::clear(int lane)
{
    constexpr double far = 1e6;  // [m]
    set(lane, {0.0, 0.0, far}, {1.0, 0.0, far}, {0.0, 1.0, far});
}

bool press_on(const FacetQuad& quad, const Eigen::Vector3d& centre, double radius, QuadPress& press)
{
    const Lanes zero = all(0.0);
    const Vec3Lanes c{all(centre.x()), all(centre.y()), all(centre.z())};
    const Vec3Lanes p = quad.corner_from(c, 0);
    const Lanes height = dot(quad.normal, p);
    DiscParts parts{all(radius * radius) - height * height};
    if (!any(parts.a2 > zero)) return false;
    const Vec3Lanes q = quad.corner_from(c, 1), s = quad.corner_from(c, 2);
    parts.side(p, q, quad.normal, quad.per_length[0]);
    parts.side(q, s, quad.normal, quad.per_length[1]);
    parts.side(s, p, quad.normal, quad.per_length[2]);
    const Mask reached = (parts.a2 > zero) & (parts.crossed | parts.foot_in);
    if (!any(reached)) return false;
    parts.close();
    press.force = all(-1.0 / radius) * ((height * parts.area) * quad.normal + parts.first);
    press.energy = all(0.5 / radius) * (parts.a2 * parts.area - parts.polar);
    press.size = sqrt(dot(press.force, press.force));
    const Mask covered = reached & (parts.area > zero) & (press.energy > zero);
    press.covered = covered ? all(1.0) : zero;
    return any(covered);
}

}  // namespace coral::dem::detail
