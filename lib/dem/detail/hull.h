#pragma once
/// \file dem/detail/hull.h
/// Convex hull of points as triangles, by CGAL (in a library of its own: CGAL needs -frounding-math).
#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace coral::dem::detail {

struct HullTriangles {
    std::vector<Eigen::Vector3d> vertices;      ///< corners of the hull, in lexicographic order
    std::vector<std::array<int, 3>> triangles;  ///< counter-clockwise seen from outside, smallest number first, sorted
};

/// The hull depends on the points alone, not on their order. Empty when they lie in one plane.
HullTriangles convex_hull(std::span<const Eigen::Vector3d> points);

}  // namespace coral::dem::detail
