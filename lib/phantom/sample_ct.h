#pragma once
/// \file phantom/sample_ct.h
/// Coral-like CT phantom: random grains with known voids, placed in a stack.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "core/table.h"
#include "morph/voxel_stack.h"
#include "phantom/grain.h"

namespace coral::phantom {

enum class Contents { labels, binary, grey };

struct SampleSpec {
    int grains = 6;
    int sticks = 1;                                     ///< how many of the grains are sticks; the last ones
    double diameter = 8e-3;                             ///< mean equivalent diameter [m]
    double spread = 0.1;                                ///< diameters uniform in diameter * (1 +- spread)
    std::array<double, 2> lump_sphericity{0.80, 0.95};  ///< smallest, largest [Huang et al. 2023]
    std::array<double, 2> stick_sphericity{0.72, 0.82};
    double stick_stretch = 2.0;
    int degree = 10;
    VoidSpec voids;
    Eigen::Vector3d voxel_size = Eigen::Vector3d::Constant(125e-6);  ///< [m]
    double gap = 3;         ///< voxels between the boxes of grains that do not touch
    bool touching = false;  ///< slide the grains together until they touch
    int supersample = 3;    ///< odd; lattice on which the truth is counted
    std::uint64_t seed = 1;
};

/// Grain of the sample: where it lies and its true figures.
struct PlacedGrain {
    bool stick = false;
    Eigen::Vector3d centre =
        Eigen::Vector3d::Zero();  ///< of mass of the solid, from the outer corner of voxel (0,0,0) of the stack [m]
    Truth truth;
};

struct Sample {
    morph::VoxelStack labels;     ///< 0, or 1 + index into `grains`
    std::vector<float> fraction;  ///< solid share of each voxel
    std::vector<PlacedGrain> grains;
};

/// \throws UsageError for impossible porosity, chambers or sphericity (see Grain), or an even supersample
Sample make_sample(const SampleSpec& spec);

/// One row a grain, columns as in data/samples/README.md.
Table truth_table(const Sample& sample);

struct GreySpec {
    double void_grey = 60, solid_grey = 180;
    double noise = 10;  ///< standard deviation [grey levels]
};

/// Solid 255, void 0.
morph::VoxelStack binary_stack(const Sample& sample);
/// Partial volume (grey in proportion to the solid share of a voxel) and Gaussian noise, rounded and cut to 0..255.
morph::VoxelStack grey_stack(const Sample& sample, const GreySpec& spec, std::uint64_t seed);

}  // namespace coral::phantom
