#pragma once
/// \file phantom/grain.h
/// One grain of a phantom: outline, voids, orientation; imaged on voxels with its true figures.
///
/// Exact (from the formulas): apparent volume, equivalent diameter, surface area of the outline, sphericity, throat
/// diameters of the channels, radii of the chambers. Counted on a lattice `supersample` times finer than the voxels:
/// solid volume, porosity, open and closed void volume, number of voids.
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "phantom/outline.h"
#include "phantom/voids.h"

namespace coral::phantom {

struct GrainSpec {
    bool stick = false;
    OutlineSpec outline;
    VoidSpec voids;
};

/// True figures of one grain, SI.
struct Truth {
    double volume = 0, apparent_volume = 0, equivalent_diameter = 0, surface_area = 0, sphericity = 0;
    double intraparticle_porosity = 0;  ///< (apparent_volume - volume)/apparent_volume
    double open_void_volume = 0,
           closed_void_volume = 0;  ///< reached from outside through faces of the fine lattice, or not
    int void_count = 0, open_void_count = 0, closed_void_count = 0;  ///< pieces of at least 8 voxels
    std::vector<double> throat_diameters, chamber_radii;
};

/// A grain on voxels: box of size[0] x size[1] x size[2], x fastest.
struct GrainImage {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();
    std::vector<std::uint8_t> solid;     ///< 1 where the centre of the voxel is solid
    std::vector<std::uint8_t> apparent;  ///< 1 where any part of the voxel lies inside the outline
    std::vector<float> fraction;         ///< share of the voxel that is solid
    Eigen::Vector3d centre =
        Eigen::Vector3d::Zero();  ///< of mass of the solid, from the outer corner of voxel (0,0,0) [m]
    Truth truth;
};

class Grain {
public:
    Grain(const GrainSpec& spec, RandomSource& random);
    const Outline& outline() const { return *outline_; }
    const Voids& voids() const { return *voids_; }
    const Eigen::Matrix3d& rotation() const { return rotation_; }  ///< grain axes -> stack axes

    /// \param voxel_size   edges [m]
    /// \param supersample  odd, points per voxel and axis
    GrainImage image(const Eigen::Vector3d& voxel_size, int supersample) const;

private:
    std::unique_ptr<Outline> outline_;
    std::unique_ptr<Voids> voids_;
    Eigen::Matrix3d rotation_;
    Eigen::Vector3d shift_;  ///< of the grain against the voxels, in voxels
};

}  // namespace coral::phantom
