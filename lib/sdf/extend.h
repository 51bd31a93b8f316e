#pragma once
/// \file sdf/extend.h
/// Exact extension of a narrow-band grid, so that no clamped value is ever taken for a distance.
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

}  // namespace coral::sdf
