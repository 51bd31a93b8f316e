#pragma once
/// \file morph/hull.h
/// Convex hull of a set of points, by CGAL (kept in its own library: CGAL needs -frounding-math).
#include <Eigen/Core>
#include <span>
#include <vector>

namespace coral::morph {

struct HullProperties {
    double volume = 0;                     ///< [m^3]
    std::vector<Eigen::Vector3d> corners;  ///< in a fixed order [m]
};

/// \throws Error when the points lie in one plane
HullProperties hull_properties(std::span<const Eigen::Vector3d> points);

}  // namespace coral::morph
