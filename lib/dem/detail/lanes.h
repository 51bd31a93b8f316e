#pragma once
/// \file dem/detail/lanes.h
/// Numbers, or vectors, side by side: contacts are worked four or eight at a time. Every lane does what scalar code would, in the same
/// order, so a contact's result does not depend on its neighbours in a group.
#include <Eigen/Core>
#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>
#ifdef CORAL_AVX512
#include <immintrin.h>
#endif

namespace coral::dem::detail {

// GCC warns that passing these by value depends on the instruction set; all uses are inline.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

typedef double Lanes __attribute__((vector_size(32)));
typedef float FloatLanes __attribute__((vector_size(16)));
/// As many as a register of the processor holds, four at least: loops with long chains of roots and divisions hide them behind each other.
#ifdef CORAL_AVX512
typedef double WideLanes __attribute__((vector_size(64)));
#else
typedef Lanes WideLanes;
#endif

template <class V>
constexpr int lanes_of = sizeof(V) / sizeof(double);
constexpr int lane_count = lanes_of<Lanes>, wide_lane_count = lanes_of<WideLanes>;

/// of(0), of(1), ... in the lanes.
template <class V, class Of>
[[gnu::always_inline]] inline V lanes_from(const Of& of)
{
    return [&]<std::size_t... k>(std::index_sequence<k...>) { return V{double(of(int(k)))...}; }(std::make_index_sequence<lanes_of<V>>());
}
template <class V = Lanes>
[[gnu::always_inline]] inline V all(double value)
{
    return lanes_from<V>([=](int) { return value; });
}
/// Numbers one after the other, aligned or not.
template <class V = Lanes>
[[gnu::always_inline]] inline V load(const double* from)
{
    V a;
    std::memcpy(&a, from, sizeof a);
    return a;
}
[[gnu::always_inline]] inline Lanes widened(FloatLanes a) { return __builtin_convertvector(a, Lanes); }
template <class V>
[[gnu::always_inline]] inline V sqrt(V a)
{
    V root;
    for (int k = 0; k < lanes_of<V>; ++k) root[k] = std::sqrt(a[k]);
    return root;
}
template <class V>
[[gnu::always_inline]] inline V nearbyint(V a)
{
    V whole;
    for (int k = 0; k < lanes_of<V>; ++k) whole[k] = std::nearbyint(a[k]);
    return whole;
}
template <class V>
[[gnu::always_inline]] inline V min(V a, V b) { return a < b ? a : b; }
template <class V>
[[gnu::always_inline]] inline V max(V a, V b) { return a > b ? a : b; }

/// Argument of re + i im, between -pi and pi, to two units in the last place: the rational form of Cephes (Moshier 1989) for the arc tangent
/// below tan(3 pi/16), 45 degrees taken off above pi/8.
template <class V>
[[gnu::always_inline]] inline V argument(V re, V im)
{
    const V zero = all<V>(0.0), x = max(re, -re), y = max(im, -im), low = min(x, y), high = max(x, y);
    const auto steep = low > all<V>(0.41421356237309503) * high;
    const V t = (steep ? low - high : low) / (steep ? low + high : high), z = t * t;
    const V p = (((all<V>(-8.750608600031904122785e-1) * z - all<V>(1.615753718733365076637e1)) * z - all<V>(7.500855792314704667340e1)) * z -
                     all<V>(1.228866684490136173410e2)) * z - all<V>(6.485021904942025371773e1);
    const V q = ((((z + all<V>(2.485846490142306297962e1)) * z + all<V>(1.650270098316988542046e2)) * z + all<V>(4.328810604912902668951e2)) * z +
                     all<V>(4.853903996359136964868e2)) * z + all<V>(1.945506571482613964425e2);
    V angle = t + t * z * p / q + (steep ? all<V>(0.25 * std::numbers::pi) : zero);
    angle = y > x ? all<V>(0.5 * std::numbers::pi) - angle : angle;
    angle = re < zero ? all<V>(std::numbers::pi) - angle : angle;
    return im < zero ? -angle : angle;
}

/// In pairs, pairs of pairs and so on.
template <class V>
[[gnu::always_inline]] inline double sum(V a)
{
    double part[lanes_of<V>];
    for (int k = 0; k < lanes_of<V>; ++k) part[k] = a[k];
    for (int apart = 1; apart < lanes_of<V>; apart *= 2)
        for (int k = 0; k < lanes_of<V>; k += 2 * apart) part[k] += part[k + apart];
    return part[0];
}

/// Of what a comparison gives.
template <class Mask>
[[gnu::always_inline]] inline bool any(Mask mask)
{
    long long some = 0;
    for (int k = 0; k < int(sizeof(Mask) / sizeof(long long)); ++k) some |= mask[k];
    return some != 0;
}

/// What a comparison gives, a bit a lane.
template <class Mask>
[[gnu::always_inline]] inline unsigned bits(Mask mask)
{
#ifdef CORAL_AVX512
    if constexpr (sizeof(Mask) == 64) return _mm512_movepi64_mask(__m512i(mask));
#endif
    unsigned all_bits = 0;
    for (int k = 0; k < int(sizeof(Mask) / sizeof(long long)); ++k) all_bits |= unsigned(mask[k] & 1) << k;
    return all_bits;
}

template <class V>
struct VectorsOf {
    V x, y, z;
};
using Vec3Lanes = VectorsOf<Lanes>;
using WideVec3Lanes = VectorsOf<WideLanes>;
template <class V>
[[gnu::always_inline]] inline VectorsOf<V> operator+(const VectorsOf<V>& a, const VectorsOf<V>& b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class V>
[[gnu::always_inline]] inline VectorsOf<V> operator-(const VectorsOf<V>& a, const VectorsOf<V>& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
[[gnu::always_inline]] inline VectorsOf<V> operator*(V s, const VectorsOf<V>& a)
{
    return {s * a.x, s * a.y, s * a.z};
}
template <class V>
[[gnu::always_inline]] inline V dot(const VectorsOf<V>& a, const VectorsOf<V>& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class V>
[[gnu::always_inline]] inline VectorsOf<V> cross(const VectorsOf<V>& a, const VectorsOf<V>& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Vectors of(0), of(1), ..., one a lane.
template <class V, class Of>
[[gnu::always_inline]] inline VectorsOf<V> vectors_from(const Of& of)
{
    return {lanes_from<V>([&](int k) { return of(k).x(); }), lanes_from<V>([&](int k) { return of(k).y(); }), lanes_from<V>([&](int k) { return of(k).z(); })};
}

#ifdef CORAL_AVX512
/// Eight vectors of(0), of(1), ...: a load and a few shuffles each instead of a load a number.
template <class Of>
[[gnu::always_inline]] inline WideVec3Lanes wide_vectors(const Of& of)
{
    const auto half = [&](int k) { return Lanes(_mm256_maskz_loadu_pd(7, of(k).data())); };
    const auto both = [&](int k) { return __builtin_shufflevector(half(k), half(k + 4), 0, 1, 2, 3, 4, 5, 6, 7); };
    const WideLanes a = both(0), b = both(1), c = both(2), d = both(3);
    const WideLanes xz_ab = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14), y_ab = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
    const WideLanes xz_cd = __builtin_shufflevector(c, d, 0, 8, 2, 10, 4, 12, 6, 14), y_cd = __builtin_shufflevector(c, d, 1, 9, 3, 11, 5, 13, 7, 15);
    return {__builtin_shufflevector(xz_ab, xz_cd, 0, 1, 8, 9, 4, 5, 12, 13), __builtin_shufflevector(y_ab, y_cd, 0, 1, 8, 9, 4, 5, 12, 13),
            __builtin_shufflevector(xz_ab, xz_cd, 2, 3, 10, 11, 6, 7, 14, 15)};
}
#else
template <class Of>
[[gnu::always_inline]] inline WideVec3Lanes wide_vectors(const Of& of)
{
    return vectors_from<WideLanes>(of);
}
#endif

/// Four numbers of each lane that lie one after the other in memory.
struct WideFours {
    WideLanes a, b, c, d;
};
#ifdef CORAL_AVX512
template <class Of>
[[gnu::always_inline]] inline WideFours wide_fours(const Of& of)
{
    const auto both = [&](int k) { return __builtin_shufflevector(load(of(k)), load(of(k + 4)), 0, 1, 2, 3, 4, 5, 6, 7); };
    const WideLanes k0 = both(0), k1 = both(1), k2 = both(2), k3 = both(3);
    const WideLanes ac_01 = __builtin_shufflevector(k0, k1, 0, 8, 2, 10, 4, 12, 6, 14), bd_01 = __builtin_shufflevector(k0, k1, 1, 9, 3, 11, 5, 13, 7, 15);
    const WideLanes ac_23 = __builtin_shufflevector(k2, k3, 0, 8, 2, 10, 4, 12, 6, 14), bd_23 = __builtin_shufflevector(k2, k3, 1, 9, 3, 11, 5, 13, 7, 15);
    return {__builtin_shufflevector(ac_01, ac_23, 0, 1, 8, 9, 4, 5, 12, 13), __builtin_shufflevector(bd_01, bd_23, 0, 1, 8, 9, 4, 5, 12, 13),
            __builtin_shufflevector(ac_01, ac_23, 2, 3, 10, 11, 6, 7, 14, 15), __builtin_shufflevector(bd_01, bd_23, 2, 3, 10, 11, 6, 7, 14, 15)};
}
/// Back to memory, each lane to to(k).
template <class To>
[[gnu::always_inline]] inline void put_fours(const WideFours& f, const To& to)
{
    const WideLanes ab_even = __builtin_shufflevector(f.a, f.b, 0, 8, 2, 10, 4, 12, 6, 14), ab_odd = __builtin_shufflevector(f.a, f.b, 1, 9, 3, 11, 5, 13, 7, 15);
    const WideLanes cd_even = __builtin_shufflevector(f.c, f.d, 0, 8, 2, 10, 4, 12, 6, 14), cd_odd = __builtin_shufflevector(f.c, f.d, 1, 9, 3, 11, 5, 13, 7, 15);
    const auto put = [&](int k, WideLanes pair) {
        const Lanes low = __builtin_shufflevector(pair, pair, 0, 1, 2, 3), high = __builtin_shufflevector(pair, pair, 4, 5, 6, 7);
        std::memcpy(to(k), &low, sizeof low);
        std::memcpy(to(k + 4), &high, sizeof high);
    };
    put(0, __builtin_shufflevector(ab_even, cd_even, 0, 1, 8, 9, 4, 5, 12, 13));
    put(1, __builtin_shufflevector(ab_odd, cd_odd, 0, 1, 8, 9, 4, 5, 12, 13));
    put(2, __builtin_shufflevector(ab_even, cd_even, 2, 3, 10, 11, 6, 7, 14, 15));
    put(3, __builtin_shufflevector(ab_odd, cd_odd, 2, 3, 10, 11, 6, 7, 14, 15));
}
#else
template <class Of>
[[gnu::always_inline]] inline WideFours wide_fours(const Of& of)
{
    const auto number = [&](int n) { return lanes_from<WideLanes>([&](int k) { return of(k)[n]; }); };
    return {number(0), number(1), number(2), number(3)};
}
template <class To>
[[gnu::always_inline]] inline void put_fours(const WideFours& f, const To& to)
{
    for (int k = 0; k < wide_lane_count; ++k) {
        double* const at = to(k);
        at[0] = f.a[k], at[1] = f.b[k], at[2] = f.c[k], at[3] = f.d[k];
    }
}
#endif

template <class V>
[[gnu::always_inline]] inline Eigen::Vector3d lane(const VectorsOf<V>& v, int k)
{
    return {v.x[k], v.y[k], v.z[k]};
}

#pragma GCC diagnostic pop

}  // namespace coral::dem::detail
