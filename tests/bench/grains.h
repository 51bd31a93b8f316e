#pragma once
/// \file bench/grains.h
/// A grain in closed form for benchmarks: a lumpy ball of 15 mm with a void that opens to the outside.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "sdf/level_set.h"

namespace coral::bench {

inline constexpr double grain_diameter = 15e-3;  ///< [m]

/// Radius of the apparent surface in a direction [m]: three bumps of a tenth.
inline double grain_radius(const Eigen::Vector3d& u)
{
    return 0.5 * grain_diameter * (1 + 0.1 * std::sin(3 * std::atan2(u.y(), u.x())) * (1 - u.z() * u.z()) + 0.05 * u.z() * u.z());
}

/// Whether a point lies in the solid: inside the apparent surface, outside a void of 4 mm with a neck of 1.6 mm along +z.
inline bool in_grain(const Eigen::Vector3d& p)
{
    const double r = p.norm();
    if (r > 0 && r > grain_radius(p / r)) return false;
    const Eigen::Vector3d centre(0, 0, 2e-3);
    if ((p - centre).norm() < 2e-3) return false;
    return !(p.z() > centre.z() && std::hypot(p.x(), p.y()) < 0.8e-3);
}

/// Voxels of the grain as a CT would give them. The mask refers to the vector.
struct VoxelGrain {
    std::vector<std::uint8_t> voxels;
    sdf::GrainMask mask;

    explicit VoxelGrain(double voxel_size)
    {
        const int n = static_cast<int>(std::ceil(1.25 * grain_diameter / voxel_size));
        mask.size.setConstant(n);
        mask.voxel_size.setConstant(voxel_size);
        mask.first_centre.setConstant(-0.5 * voxel_size * (n - 1));
        for (int k = 0; k < n; ++k)
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i)
                    voxels.push_back(in_grain(mask.first_centre + voxel_size * Eigen::Vector3d(i, j, k)));
        mask.solid = voxels;
    }
    VoxelGrain(const VoxelGrain&) = delete;
    VoxelGrain& operator=(const VoxelGrain&) = delete;
};

}  // namespace coral::bench
