#pragma once
/// \file morph/voxel_stack.h
/// Voxels of a CT scan or label image, and binary boxes cut out of it. x runs fastest, then y, then z.
/// The centre of voxel (i, j, k) lies at ((i + 1/2) dx, (j + 1/2) dy, (k + 1/2) dz) of the stack, dx.. = voxel_size [m].
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "morph/voxel_values.h"

namespace coral::morph {

/// Integer voxels (grey values, masks or labels), or real grey values when the file holds fractions.
struct VoxelStack {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();          ///< voxels along x, y, z
    Eigen::Vector3d voxel_size = Eigen::Vector3d::Zero();    ///< edges of a voxel [m]; zero when the file does not say
    VoxelValues values;                                      ///< [nz, ny, nx]; empty when `reals` is used
    std::vector<float> reals;                                ///< [nz, ny, nx]; grey values of a floating-point file
    std::string name;                                        ///< file or folder the voxels came from, for messages

    std::size_t count() const { return std::size_t(size.x()) * std::size_t(size.y()) * std::size_t(size.z()); }
    std::size_t index(int i, int j, int k) const
    {
        return (std::size_t(k) * std::size_t(size.y()) + std::size_t(j)) * std::size_t(size.x()) + std::size_t(i);
    }
};

/// Binary box, for instance one grain cut out of a stack with a margin of zeros around it.
struct Mask {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();        ///< voxels along x, y, z
    Eigen::Vector3d voxel_size = Eigen::Vector3d::Ones();  ///< edges of a voxel [m]
    /// Place of the box in its stack: voxel (i, j, k) here is voxel offset + (i, j, k) there (may be negative).
    Eigen::Vector3i offset = Eigen::Vector3i::Zero();
    std::vector<std::uint8_t> voxels;  ///< 1 = solid, 0 = void; [nz, ny, nx]

    std::size_t count() const { return std::size_t(size.x()) * std::size_t(size.y()) * std::size_t(size.z()); }
    std::size_t index(int i, int j, int k) const
    {
        return (std::size_t(k) * std::size_t(size.y()) + std::size_t(j)) * std::size_t(size.x()) + std::size_t(i);
    }
    double voxel_volume() const { return voxel_size.prod(); }  ///< [m^3]
};

/// Box of zeros of the given size.
Mask make_mask(const Eigen::Vector3i& size, const Eigen::Vector3d& voxel_size);

/// Number of solid voxels.
std::size_t solid_count(const Mask& mask);

/// Copy with `margin` voxels of zeros added on both sides of each axis.
Mask padded(const Mask& mask, const Eigen::Vector3i& margin);
inline Mask padded(const Mask& mask, int margin) { return padded(mask, Eigen::Vector3i::Constant(margin)); }

}  // namespace coral::morph
