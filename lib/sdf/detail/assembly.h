#pragma once
/// \file sdf/detail/assembly.h
/// Last steps of a grain's level sets, whatever they were made from.
#include "sdf/level_set.h"

namespace coral::sdf::detail {

/// Pieces of negative nodes, joined over faces, edges and corners.
int count_components(const DistanceGrid& grid);

/// Clamps to the band of the options and sets the limits.
void clamp_to_band(DistanceGrid& grid, double shift, const LevelSetOptions& options);

/// Mass properties of `solid` and `apparent`, and both moved to the solid's centre of mass.
/// \throws Error when no volume is left on the spacing
void complete(GrainLevelSet& grain);

}  // namespace coral::sdf::detail
