#pragma once
/// \file fluid/detail/lanes.h
/// Sums and maxima of rows that may vectorise (built with -fopenmp-simd): the order of additions depends on the machine
/// the library is built for, never on threads.
#include <cstddef>

namespace coral::fluid::detail {

/// sum over i in [0, n) of value(i), in double whatever the values are.
template <class Value>
inline double lane_sum(std::ptrdiff_t n, const Value& value)
{
    double sum = 0.0;
#pragma omp simd reduction(+ : sum)
    for (std::ptrdiff_t i = 0; i < n; ++i) sum += double(value(i));
    return sum;
}

/// largest value(i), at least 0.
template <class Value>
inline auto lane_max(std::ptrdiff_t n, const Value& value)
{
    using Real = decltype(value(n));
    Real largest = 0;
#pragma omp simd reduction(max : largest)
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const Real v = value(i);
        largest = v > largest ? v : largest;
    }
    return largest;
}

}  // namespace coral::fluid::detail
