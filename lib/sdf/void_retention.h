#pragma once
/// \file sdf/void_retention.h
/// How much of a grain's voids its level sets keep, in volume and in place.
#include <span>

#include "sdf/level_set.h"

namespace coral::sdf {

/// Volumes [m^3]; all but `solid_lost` are 0 for a grain whose only void is dimples. A point is void in the level sets where d > 0 for the solid and d < 0 for the apparent shape.
struct VoidRetention {
    double masked = 0;   ///< all of the masks' void inside the apparent shape
    double kept = 0;     ///< of the level sets: apparent volume - volume
    double voids = 0;    ///< of the masks' voids, dimples left out
    double shared = 0;   ///< their part that is void in the level sets too, voxel centre by voxel centre (trilinear)
    double open = 0;     ///< of the masks' voids that are linked to the outside
    double cut_off = 0;  ///< their part that the level set of the solid links to the outside no more: filled, or behind a closed throat

    double solid_lost = 0;  ///< of the masks' solid that is void or outside in the level set, voxel centre by voxel centre

    double retained() const { return masked > 0 ? kept / masked : 1.0; }   ///< ratio of the sums; 1 for a grain without voids
    double overlap() const { return voids > 0 ? shared / voids : 1.0; }    ///< share of the masks' voids that is void still, in place
    double lost_link() const { return open > 0 ? cut_off / open : 0.0; }   ///< share of the open voids
    VoidRetention& operator+=(const VoidRetention& other);
};

/// \param solid, apparent  masks the grain was made of, both of one box
/// \param classes          per voxel of that box: 1 in closed voids, 2 in voids linked to the outside, 0 elsewhere and in dimples
/// \param grain            its level sets, centre as grain_from_masks leaves it
/// Links in the level set go over faces of positive nodes, which never links what the interpolant keeps apart.
VoidRetention void_retention(const GrainMask& solid, const GrainMask& apparent, std::span<const std::uint8_t> classes, const GrainLevelSet& grain);

}  // namespace coral::sdf
