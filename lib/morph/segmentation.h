#pragma once
/// \file morph/segmentation.h
/// What the numbers of a stack mean: which are solid, and whether they are labels.
#include <string>
#include <vector>

#include "morph/voxel_stack.h"

namespace coral::morph {

enum class LabelMode { automatic, binary, labels };

struct SegmentationOptions {
    LabelMode mode = LabelMode::automatic;
    std::string solid = "bright";  ///< bright, dark, or the number that is solid
    std::string threshold;         ///< empty, "otsu", or a grey value: bright solid is above it, dark solid at or below it
};

struct Segmentation {
    bool binary = false;
    Mask solid;                         ///< when binary
    VoxelValues labels;                 ///< otherwise: [nz, ny, nx], 0 = void
    std::string decision;               ///< one line saying how the numbers were taken
};

/// Automatic mode: a threshold or a solid value given, or two distinct values, mean binary; more values are labels with 0 as
/// void, unless neighbouring voxels mostly differ, as grey values do. Takes the voxels out of `stack`.
/// \throws UsageError  grey values without threshold (says how many levels), a solid value that does not occur, contradictions
/// \throws Error       a stack of one value only
Segmentation segment(VoxelStack&& stack, const SegmentationOptions& options);

/// Otsu's threshold of integer or real grey values: maximises the variance between the two classes [Otsu 1979], with 256
/// classes between the least and the largest value unless integers are fewer.
double otsu_threshold(const VoxelStack& stack);

}  // namespace coral::morph
