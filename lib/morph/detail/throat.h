#pragma once
/// \file morph/detail/throat.h
/// Width of a constriction below the voxel: the ball of the throat transform moved off the voxel centre.
#include <cstddef>

#include "morph/detail/closing.h"

namespace coral::morph::detail {

/// Diameter [m] of the largest ball about the narrowest place of a throat. The ball of the lattice has its centre on a voxel centre and is
/// measured to voxel centres; here it is moved across the throat, by a voxel at most, to where the surface of the smoothed occupancy
/// (extract_surface) leaves the most room. Along the throat it stays: that direction is the one in which no near surface faces it.
/// \param saddle  voxel of the box where the throat transform found the constriction
/// \param radius  of the lattice's ball there, in units of c
double throat_diameter(const Closing& closing, std::size_t saddle, float radius);

}  // namespace coral::morph::detail
