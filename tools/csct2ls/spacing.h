#pragma once
/// \file csct2ls/spacing.h
/// The node spacing of the level sets: given, by default, or by tolerance.
#include <vector>

#include "csct2ls/convert.h"
#include "csct2ls/options.h"
#include "morph/extraction.h"
#include "sdf/level_set.h"

namespace coral::csct2ls {

double median(std::vector<double> values);        ///< 0 when empty
double upper_median(std::vector<double> values);  ///< one of the values: the upper one of the two in the middle; 0 when empty

/// Median over the grains of their scaled voxel edge, the longest of the three [m].
double typical_edge(const Eigen::Vector3d& voxel_size, const std::vector<morph::Grain>& grains);

/// Spacing without a tolerance: the option, else twice the voxel edge, or D/75 of scaled grains but not below the voxel edge. [m]
double choose_spacing(const Options& o, double edge);

/// The coarsest spacing of the ladder edge * 2^(k/4) at which
///   - no grain's level-set volume is farther than the tolerance from that of its voxels (or its mesh),
///   - the void volume of all grains together is within it, and lies within it where the CT's voids are (overlap),
///   - no larger share of the open voids is cut off from the outside, as it is behind a throat that the spacing closes.
/// The errors are measured: every spacing tried converts the grains (of more than 32 a choice over all sizes while searching; the
/// spacing found is then held against all). Says on stderr what it took and what stopped it from taking the next.
/// \param options  band of the level sets; its spacing is not used
/// \throws Error when there is no grain
double spacing_within(double tolerance, double edge, const Shapes& shapes, sdf::LevelSetOptions options);

/// Takes out the grains that scaling has made too coarse: level sets need a spacing of half a voxel or more.
void drop_coarse(morph::Extraction& extraction, const Eigen::Vector3d& voxel_size, double spacing);

}  // namespace coral::csct2ls
