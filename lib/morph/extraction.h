#pragma once
/// \file morph/extraction.h
/// From a labelled stack to measured single grains: border and size rules, islands, apparent shapes, descriptors.
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "morph/components.h"
#include "morph/descriptors.h"
#include "morph/grains.h"

namespace coral::morph {

struct ExtractionOptions {
    bool keep_border = false;      ///< keep grains the border of the stack cuts
    double minimum_diameter = 0;   ///< equivalent diameter of the apparent shape in the CT [m]; 0 = eight voxel edges
    std::size_t minimum_voxels = 64;
    double closing_radius = 0;     ///< of the ball [m, in the CT]; 0 = 0.1 of each grain's filled diameter
    double scale_to = 0;           ///< equivalent diameter every grain is scaled to [m]; 0 = sizes as in the CT
    bool list_voids = false;       ///< fill Grain::voids
};

struct Grain {
    LabelBox box;
    Islands islands;         ///< pieces cut off the largest one
    PackedMask solid;        ///< voxel_size scaled
    PackedMask apparent;
    Descriptors shape;       ///< lengths scaled
    std::vector<Void> voids; ///< one by one when asked for; lengths scaled
    double scale = 1.0;      ///< factor on lengths
};

enum class DropReason { border, small, thin, coarse };

struct Dropped {
    LabelBox box;
    DropReason reason = DropReason::small;
};

struct Extraction {
    std::vector<Grain> grains;     ///< by falling volume of the solid, label among equals
    std::vector<Dropped> dropped;  ///< by rising label: nothing vanishes silently
};

/// Memory that work on one grain takes per voxel of its box: some 55 bytes while it is measured, as many while it is converted at two
/// voxels to a node.
inline constexpr double working_bytes_per_voxel = 64;

/// Measures all grains, as many at a time as fit into 0.7 bytes per voxel of the stack (or 256 MiB, if that is more).
/// The result does not depend on the number of threads.
/// \param done  called after each grain with the voxels finished so far (from any thread, one at a time); may be empty
Extraction extract_grains(const VoxelValues& labels, const Eigen::Vector3i& size, const Eigen::Vector3d& voxel_size,
                          const ExtractionOptions& options, const std::function<void(double)>& done = {});

/// Measures one grain: islands cut off, apparent shape, descriptors, scaling. `minimum_diameter` 0 stands for eight voxel edges.
/// \return nothing, with `reason` set, when the grain is too small or has no surface; `box` is left for the caller
std::optional<Grain> measure_grain(Mask solid, const ExtractionOptions& options, DropReason& reason);

/// Descriptors of the grain with all lengths multiplied by `factor`.
Descriptors scaled(Descriptors shape, double factor);

}  // namespace coral::morph
