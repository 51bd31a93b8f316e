#pragma once
/// \file morph/hull.h
/// Convex hull and least oriented box of a set of points, by CGAL (kept in its own library: CGAL needs -frounding-math).
#include <Eigen/Core>
#include <span>

namespace coral::morph {

struct HullProperties {
    double volume = 0;                                 ///< of the convex hull [m^3]
    Eigen::Vector3d box = Eigen::Vector3d::Zero();     ///< edges of the least-volume oriented box, longest first [m]
};

/// \throws Error when the points lie in one plane
HullProperties hull_properties(std::span<const Eigen::Vector3d> points);

}  // namespace coral::morph
