#pragma once
/// \file fluid/detail/lanes.h
/// Sums and maxima of rows in eight fixed lanes: they vectorise without relaxing the order of additions.
#include <algorithm>
#include <cstddef>

namespace coral::fluid::detail {

inline constexpr int lane_count = 8;

/// sum over i in [0, n) of value(i).
template <class Value>
inline double lane_sum(std::ptrdiff_t n, const Value& value)
{
    double lane[lane_count] = {};
    std::ptrdiff_t i = 0;
    for (; i + lane_count <= n; i += lane_count)
        for (int l = 0; l < lane_count; ++l) lane[l] += value(i + l);
    for (; i < n; ++i) lane[i % lane_count] += value(i);
    return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}

/// largest value(i), at least 0.
template <class Value>
inline double lane_max(std::ptrdiff_t n, const Value& value)
{
    double lane[lane_count] = {};
    std::ptrdiff_t i = 0;
    for (; i + lane_count <= n; i += lane_count)
        for (int l = 0; l < lane_count; ++l) {
            const double v = value(i + l);
            lane[l] = v > lane[l] ? v : lane[l];
        }
    for (; i < n; ++i) lane[0] = std::max(lane[0], value(i));
    return *std::max_element(lane, lane + lane_count);
}

}  // namespace coral::fluid::detail
