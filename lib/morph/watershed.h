#pragma once
/// \file morph/watershed.h
/// Splitting of touching grains in a binary stack.
#include <cstdint>
#include <vector>

#include "morph/voxel_stack.h"

namespace coral::morph {

/// How split_touching_grains works.
struct WatershedOptions {
    double closing_radius = 0;  ///< ball that closes the voids first [m]; 0 = found from the grains (0.1 D)
    double dynamics = 0.12;     ///< a basin shallower than this share of its own depth (plus half a voxel) merges
};

struct WatershedResult {
    std::vector<std::uint32_t> labels;  ///< [nz, ny, nx], 0 = void, 1.. per grain in order of first voxel
    std::size_t grains = 0;
    double closing_radius = 0;  ///< in use [m]
};

/// Marker watershed by persistence on the distance map of the closed stack:
///  1. ball closing of the whole stack with radius R, so that voids inside grains do not split them;
///  2. exact distance d to what lies outside;
///  3. voxels by falling d: a new basin if no labelled 26-neighbour, else the label of the neighbour with the largest d; when
///     basins meet at depth d_s the lower merges if peak - d_s < dynamics * peak + c/2;
///  4. labels go back to the solid only.
/// Without a given radius R starts at one voxel and is renewed as 0.1 of the volume-weighted median diameter of the grains
/// found, since voids left unclosed break grains up and make them look small. A radius that leaves less than half of the
/// stack's void outside is refused: it closes the gaps between the grains, as in cemented rock, and the one before is kept.
/// \throws Error when the stack holds no solid
WatershedResult split_touching_grains(const Mask& solid, const WatershedOptions& options);

/// Step 3 alone on a filled mask: labels of `mask`, 1.. per basin in order of first voxel.
std::vector<std::uint32_t> watershed(const Mask& mask, double dynamics, std::size_t& basins);

}  // namespace coral::morph
