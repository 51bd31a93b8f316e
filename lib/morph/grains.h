#pragma once
/// \file morph/grains.h
/// Single grains out of a labelled stack.
#include <cstdint>
#include <span>
#include <vector>

#include "morph/voxel_stack.h"

namespace coral::morph {

/// Where one label lies.
struct LabelBox {
    std::uint32_t label = 0;
    Eigen::Vector3i low = Eigen::Vector3i::Zero();   ///< first voxel of the box
    Eigen::Vector3i high = Eigen::Vector3i::Zero();  ///< one past its last voxel
    std::size_t voxels = 0;
    bool touches_border = false;     ///< box meets the first or last index of an axis
    bool touches_neighbour = false;  ///< a voxel has another label in its 26-neighbourhood
};

/// Boxes of all labels but 0, by rising label; any ids up to 2^32 - 1.
std::vector<LabelBox> label_boxes(const VoxelValues& labels, const Eigen::Vector3i& size);

/// The voxels of one label in their box.
Mask cut_out(const VoxelValues& labels, const Eigen::Vector3i& size, const Eigen::Vector3d& voxel_size, const LabelBox& box);

/// One bit per voxel, to keep many masks.
class PackedMask {
public:
    PackedMask() = default;
    explicit PackedMask(const Mask& mask);
    Mask unpack() const;
    std::size_t count() const { return frame_.count(); }  ///< voxels of the box

private:
    Mask frame_;  ///< without voxels
    std::vector<std::uint64_t> bits_;
};

}  // namespace coral::morph
