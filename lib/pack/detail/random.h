#pragma once
/// \file pack/detail/random.h
/// Random draws that are the same on every platform; the standard library's distributions are not.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

namespace coral::pack::detail {

using Random = std::mt19937_64;

/// Evenly distributed in [0, 1).
inline double uniform(Random& random) { return double(random() >> 11) * 0x1p-53; }

/// Evenly distributed rotation [Shoemake 1992].
inline Eigen::Quaterniond random_rotation(Random& random)
{
    const double u = uniform(random), v = 2 * std::numbers::pi * uniform(random), w = 2 * std::numbers::pi * uniform(random);
    const double a = std::sqrt(1 - u), b = std::sqrt(u);
    return {b * std::cos(w), a * std::sin(v), a * std::cos(v), b * std::sin(w)};
}

}  // namespace coral::pack::detail
