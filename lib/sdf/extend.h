#pragma once
/// \file sdf/extend.h
/// How far a lattice reaches: exact extension of a narrow band, so that no clamped value is ever taken for a distance, and its opposite.
#include "sdf/distance_grid.h"

namespace coral::sdf {

/// The grid on a lattice grown so that every point nearer than `outside_distance` to the surface lies in its box, with every
/// node a true distance (limits are infinite). Values inside the old band are kept bit for bit; the others are distances to
/// the nearest foot point of the surface (Newton on the Catmull-Rom interpolant of the band), refined to the closest point.
/// Signs stay as stored, so closed cavities stay.
/// Error: that of the band's own distances near the surface (0.005 spacing for a sphere of radius 10 spacings).
/// \param outside_distance  [m]; a smaller one than the grid already has leaves the box as it is
/// \throws Error when the band is narrower than 2 nodes
DistanceGrid extended(const DistanceGrid& grid, double outside_distance);

/// The nodes low..high of a lattice, both with.
DistanceGrid part(const DistanceGrid& grid, const Eigen::Vector3i& low, const Eigen::Vector3i& high);

/// The part of the lattice around the solid, with `margin` positive nodes on each side where the lattice has them (at least 1).
/// The surface stays as it is; distances farther outside go. A grid without solid stays whole.
DistanceGrid trimmed(const DistanceGrid& grid, int margin);

}  // namespace coral::sdf
