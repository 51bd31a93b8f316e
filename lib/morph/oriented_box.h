#pragma once
/// \file morph/oriented_box.h
/// Least oriented box of a set of points.
#include <Eigen/Core>
#include <span>

namespace coral::morph {

/// Edges of the oriented box of least volume that holds all points, longest first, in the unit of the points. The turn of the box
/// is searched over all rotations that differ by more than a symmetry of the cube, then refined; the same points give the
/// same box. For speed give the corners of the convex hull alone. How near it comes to the least box: docs/numerics.md.
/// \throws Error when there are no points
Eigen::Vector3d least_box(std::span<const Eigen::Vector3d> points);

}  // namespace coral::morph
