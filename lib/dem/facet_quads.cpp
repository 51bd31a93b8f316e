#include "dem/detail/facet_quads.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace coral::dem::detail {

namespace {

void set_lane(Vec3Lanes& v, int lane, const Eigen::Vector3d& value)
{
    v.x[lane] = value.x();
    v.y[lane] = value.y();
    v.z[lane] = value.z();
}

/// Integrals over the part of each triangle that lies in the disc of squared radius a2 about the foot of the ball's centre in its plane,
/// gathered side by side (Green): area, polar moment, and first moment. Angles of the arcs are multiplied up as complex numbers, so that
/// one arc tangent serves.
template <class V>
struct DiscParts {
    using Mask = decltype(V{} < V{});
    using Vectors = VectorsOf<V>;
    V a2, area{}, polar{}, turn_re = all<V>(1.0), turn_im{};
    Vectors first{};
    Mask crossed{};          ///< some side runs through the disc
    Mask foot_in = ~Mask{};  ///< the disc's middle is in the triangle
    Mask arcs{};             ///< part of the disc's rim may be in the triangle

    [[gnu::always_inline]] void arc(V e, V from, V to)
    {
        const Mask there = to > from;
        const V re = there ? e * e + from * to : all<V>(1.0), im = there ? e * (to - from) : all<V>(0.0), t = turn_re * re - turn_im * im;
        turn_im = turn_re * im + turn_im * re;
        turn_re = t;
        arcs |= there;
    }

    /// Side from p to q (from the ball's centre), the triangle on the left.
    [[gnu::always_inline]] void side(const Vectors& p, const Vectors& q, const Vectors& normal, V per_length)
    {
        const V zero = all<V>(0.0);
        const Vectors u = per_length * (q - p), out = cross(u, normal);
        const V e = dot(p, out), t1 = dot(p, u), t2 = dot(q, u), half2 = a2 - e * e, half = sqrt(max(half2, zero));
        const V low = min(max(-half, t1), t2), high = min(max(half, t1), t2);
        arc(e, t1, low);
        arc(e, high, t2);
        const V length = high - low, cube = (high * high * high - low * low * low) * all<V>(1.0 / 3.0);
        const V push = all<V>(0.5) * (cube - half2 * length);
        area += all<V>(0.5) * e * length;
        polar += all<V>(0.25) * e * (e * e * length + cube);
        first = first + push * out;
        crossed |= length > zero;
        foot_in &= e > zero;
    }

    void close()
    {
        if (!any(arcs)) return;
        const V zero = all<V>(0.0), whole = all<V>(2.0 * std::numbers::pi);
        V angle = argument(turn_re, turn_im);
        // Between 0 and 2 pi; rounding must not make one of the other.
        angle = angle < all<V>(-1e-6) ? angle + whole : angle;
        angle = crossed ? angle : foot_in ? whole : zero;
        angle = arcs ? angle : zero;
        area += all<V>(0.5) * a2 * angle;
        polar += all<V>(0.25) * a2 * a2 * angle;
    }
};

/// Corners and normals as seen from the ball's centre.
template <class V>
struct Triangles {
    VectorsOf<V> p, q, s, normal;
    V per_length[3];
};

/// See press_on.
template <class V>
[[gnu::always_inline]] inline bool press(const Triangles<V>& t, double radius, PressOf<V>& press)
{
    const V zero = all<V>(0.0), height = dot(t.normal, t.p);
    DiscParts<V> parts{all<V>(radius * radius) - height * height};
    if (!any(parts.a2 > zero)) return false;
    parts.side(t.p, t.q, t.normal, t.per_length[0]);
    parts.side(t.q, t.s, t.normal, t.per_length[1]);
    parts.side(t.s, t.p, t.normal, t.per_length[2]);
    const auto reached = (parts.a2 > zero) & (parts.crossed | parts.foot_in);
    if (!any(reached)) return false;
    parts.close();
    press.force = all<V>(-1.0 / radius) * ((height * parts.area) * t.normal + parts.first);
    press.energy = all<V>(0.5 / radius) * (parts.a2 * parts.area - parts.polar);
    press.size = sqrt(dot(press.force, press.force));
    const auto covered = reached & (parts.area > zero) & (press.energy > zero);
    press.covered = covered ? all<V>(1.0) : zero;
    return any(covered);
}

Triangles<Lanes> seen_from(const Vec3Lanes& c, const FacetQuad& quad)
{
    return {quad.corner_from(c, 0), quad.corner_from(c, 1), quad.corner_from(c, 2), quad.normal, {quad.per_length[0], quad.per_length[1], quad.per_length[2]}};
}

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

bool press_on(const FacetQuad& quad, const Eigen::Vector3d& centre, double radius, QuadPress& result)
{
    return press(seen_from({all(centre.x()), all(centre.y()), all(centre.z())}, quad), radius, result);
}

bool press_on(const FacetQuad& one, const FacetQuad& other, const Eigen::Vector3d& centre, double radius, QuadPress (&result)[2])
{
    const Vec3Lanes c{all(centre.x()), all(centre.y()), all(centre.z())};
#ifdef CORAL_AVX512
    const Triangles<Lanes> a = seen_from(c, one), b = seen_from(c, other);
    const auto both = [](Lanes low, Lanes high) { return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7); };
    const auto vectors = [&](const Vec3Lanes& low, const Vec3Lanes& high) { return WideVec3Lanes{both(low.x, high.x), both(low.y, high.y), both(low.z, high.z)}; };
    const Triangles<WideLanes> t{vectors(a.p, b.p), vectors(a.q, b.q), vectors(a.s, b.s), vectors(a.normal, b.normal),
                                 {both(a.per_length[0], b.per_length[0]), both(a.per_length[1], b.per_length[1]), both(a.per_length[2], b.per_length[2])}};
    PressOf<WideLanes> wide;
    if (!press(t, radius, wide)) return false;
    const auto low = [](WideLanes v) { return __builtin_shufflevector(v, v, 0, 1, 2, 3); };
    const auto high = [](WideLanes v) { return __builtin_shufflevector(v, v, 4, 5, 6, 7); };
    result[0] = {low(wide.covered), {low(wide.force.x), low(wide.force.y), low(wide.force.z)}, low(wide.size), low(wide.energy)};
    result[1] = {high(wide.covered), {high(wide.force.x), high(wide.force.y), high(wide.force.z)}, high(wide.size), high(wide.energy)};
    return true;
#else
    result[0].covered = result[1].covered = all(0.0);
    const bool low = press(seen_from(c, one), radius, result[0]), high = press(seen_from(c, other), radius, result[1]);
    return low | high;
#endif
}

}  // namespace coral::dem::detail
