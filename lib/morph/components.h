#pragma once
/// \file morph/components.h
/// Connected components. Solid is 26-connected, void 6-connected (a dual pair; never the same for both).
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "morph/voxel_stack.h"

namespace coral::morph {

enum class Connectivity { faces = 6, full = 26 };

struct Components {
    VoxelValues labels;              ///< [nz, ny, nx], 0 = not of the value asked for; numbered 1.. by first voxel in memory order
    std::vector<std::size_t> sizes;  ///< voxels of component l at sizes[l - 1]
};

/// Components of the voxels equal to `value`, by union-find over runs of x.
/// \throws Error when there are more than 2^32 - 2 of them
Components connected_components(std::span<const std::uint8_t> voxels, const Eigen::Vector3i& size, std::uint8_t value,
                                Connectivity connectivity);

/// Marks (1) the voxels equal to `value` that are 6-connected to the border of the box through such voxels.
std::vector<std::uint8_t> connected_to_border(std::span<const std::uint8_t> voxels, const Eigen::Vector3i& size, std::uint8_t value);

/// What keep_largest_component removed.
struct Islands {
    std::size_t count = 0, voxels = 0;
};

/// Keeps the largest 26-connected solid component (the first in memory order among equals) and clears the others.
Islands keep_largest_component(Mask& mask);

}  // namespace coral::morph
