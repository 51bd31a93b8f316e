#pragma once
/// \file fluid/detail/faces.h
/// Rows of unknown velocity faces of one component, and the part of a control volume that lies inside the domain.
#include "fluid/grid.h"

namespace coral::fluid::detail {

inline constexpr std::size_t planes_per_block = 8;

/// Unknown faces of component `axis`: [low, high) along x, y, z.
struct FaceRange {
    Eigen::Vector3i low = Eigen::Vector3i::Zero(), high;
    FaceRange(const GridSpec& grid, int axis) : high(grid.cells)
    {
        low[axis] = grid.first_unknown(axis);
        high[axis] = std::max(low[axis], grid.last_unknown(axis));
    }
    std::size_t planes() const { return std::size_t(high.z() - low.z()); }
    std::ptrdiff_t row_length() const { return high.x() - low.x(); }
};

/// 1, or 1/2 for a face in an outlet: half of its control volume is outside.
inline double face_weight(const GridSpec& grid, int axis, int position)
{
    const bool half = (position == 0 && grid.outlet(axis, 0)) || (position == grid.cells[axis] && grid.outlet(axis, 1));
    return half ? 0.5 : 1.0;
}

/// Weight of a row (j, k) of faces of component `axis`, the ends along x left aside.
inline double row_weight(const GridSpec& grid, int axis, int j, int k)
{
    if (axis == 1) return face_weight(grid, 1, j);
    if (axis == 2) return face_weight(grid, 2, k);
    return 1.0;
}

/// Weighted sum over a row of u-like faces from a value(i), i counted from `low`.
template <class Sum, class Value>
inline double weighted_row(const GridSpec& grid, int axis, const FaceRange& range, int j, int k, const Sum& sum,
                           const Value& value)
{
    double total = sum(range.row_length(), value);
    if (axis == 0 && range.row_length() > 0) {
        if (grid.outlet(0, 0)) total -= 0.5 * double(value(0));
        if (grid.outlet(0, 1)) total -= 0.5 * double(value(range.row_length() - 1));
    }
    return row_weight(grid, axis, j, k) * total;
}

}  // namespace coral::fluid::detail
