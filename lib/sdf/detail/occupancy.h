#pragma once
/// \file sdf/detail/occupancy.h
/// Smoothed occupancy of a mask: the field whose zero level is the grain's surface.
#include <vector>

#include "sdf/level_set.h"

namespace coral::sdf::detail {

/// f = 1/2 - Gauss(occupancy), negative in solid, on cubic steps; zero-padded so that the border is open.
struct OccupancyField {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< of value (0,0,0) in the mask's frame [m]
    double step = 0.0;                                 ///< the mask's finest voxel edge [m]
    std::vector<float> values;                         ///< x fastest
    std::size_t solid_voxels = 0;
    std::size_t smoothed_out = 0;                      ///< solid voxels with f > 0
};

/// Gaussian of `sigma` voxels along each axis (index space), then cubic resampling of coarser axes to the finest edge.
/// \throws Error on an empty mask, a wrong size of the voxel array, or voxel edges that are not positive
OccupancyField smoothed_occupancy(const GrainMask& mask, double sigma);

}  // namespace coral::sdf::detail
