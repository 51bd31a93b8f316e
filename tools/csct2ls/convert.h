#pragma once
/// \file csct2ls/convert.h
/// Measured grains to level sets.
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "morph/extraction.h"
#include "sdf/level_set.h"
#include "sdf/mesh.h"
#include "sdf/void_retention.h"

namespace coral::csct2ls {

/// What the conversion of one grain did.
struct Converted {
    sdf::LevelSetReport report;                         ///< of the solid
    sdf::VoidRetention voids;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();   ///< centre of mass in the frame of the stack [m]

    double volume_error() const { return report.volume / report.voxel_volume - 1.0; }  ///< of the level set
};

/// What level sets are made of.
struct Shapes {
    std::span<const morph::Grain> grains;
    std::span<const sdf::TriangleMesh> surfaces;  ///< of the grains, when they came as meshes; else empty
    double budget = 0;                            ///< memory to work in [bytes]; one grain at a time may need more
};

/// Level sets of grain number g. \param converted  filled in
sdf::GrainLevelSet convert(const Shapes& shapes, std::size_t g, const sdf::LevelSetOptions& options, Converted& converted);

/// Several grains at a time, the largest first.
/// \param which  numbers of the grains
/// \param take   gets each grain's number and level sets, from any thread, several at once; may be empty
/// \param what   for the progress bar; empty for none
std::vector<Converted> convert_all(const Shapes& shapes, const std::vector<std::size_t>& which, const sdf::LevelSetOptions& options,
                                   const std::string& what, const std::function<void(std::size_t, sdf::GrainLevelSet&)>& take);

}  // namespace coral::csct2ls
