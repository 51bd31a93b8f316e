#pragma once
/// \file sdf/level_set.h
/// From the binary mask of one grain to its signed distance, intraparticle voids kept.
/// Metres; negative in solid, positive outside and in voids.
#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "sdf/distance_grid.h"

namespace coral::sdf {

/// Crop of one grain out of a CT stack. Outside the crop counts as void; no padding is needed.
struct GrainMask {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();          ///< voxels per axis
    Eigen::Vector3d voxel_size = Eigen::Vector3d::Zero();    ///< edges [m], may differ by axis
    Eigen::Vector3d first_centre = Eigen::Vector3d::Zero();  ///< centre of voxel (0,0,0) [m], any frame
    std::span<const std::uint8_t> solid;                     ///< x fastest; non-zero = solid
};

struct LevelSetOptions {
    double spacing = 2e-4;       ///< node spacing [m]
    double inside_band = 6.0;    ///< depth of true distances in the solid [nodes]
    double outside_band = 9.0;   ///< the same outside and in voids [nodes]
    double smoothing = 0.7;      ///< sigma of the Gaussian on the occupancy [voxels], 0.3 to 1
    bool keep_volume = true;     ///< shift the distance by one constant (at most 0.2 voxel) so that the voxels' volume is met
};

/// What the conversion did; all of it is for reports.
struct LevelSetReport {
    double voxel_volume = 0.0;        ///< of the mask [m^3]
    double volume = 0.0;              ///< of the level set, smoothed Heaviside [m^3]
    double shift = 0.0;               ///< constant added to the distance [m]
    bool shift_limited = false;       ///< whether more than 0.2 voxel was wanted: volume is then not met
    std::size_t foot_points = 0;      ///< surface points found
    std::size_t voxels_smoothed_out = 0;  ///< solid voxels outside the smoothed surface (spikes, specks)
    int solid_components = 0;         ///< pieces of negative nodes (26-connected); more than 1: necks thinner than the spacing
};

/// Signed distance of a mask, in the mask's frame, clamped to the band (limits are set accordingly).
/// Occupancy smoothed by a Gaussian, surface points by Newton on its Catmull-Rom interpolant, nearest surface point carried
/// outwards over the lattice and refined there; signs from the smoothed occupancy, so closed cavities stay
/// [docs/numerics.md, geometry]. Voxels that differ by axis are resampled to the finest edge with a cubic.
/// Error against true shapes: 0.11 voxel RMS. Throats under 1.5 and walls under 1 node spacing may close.
/// \param lattice  when given, the nodes lie on the lattice of this grid (same spacing), as for an apparent twin
/// \throws Error on an empty mask, or when `spacing` is less than half the finest voxel edge
DistanceGrid level_set_from_mask(const GrainMask& mask, const LevelSetOptions& options, LevelSetReport* report = nullptr,
                                 const DistanceGrid* lattice = nullptr);

/// One grain as grains.vdb holds it: both level sets in the frame with the solid's centre of mass at the origin, axes of the CT.
struct GrainLevelSet {
    int id = 0;                           ///< 1..n by falling volume
    std::uint32_t label = 0;              ///< in the CT labels
    DistanceGrid solid;                   ///< voids kept
    DistanceGrid apparent;                ///< filled; same frame and lattice
    double volume = 0.0;                  ///< of the solid [m^3]
    double apparent_volume = 0.0;         ///< [m^3]
    double equivalent_diameter = 0.0;     ///< of the sphere of apparent_volume [m]
    double intraparticle_porosity = 0.0;  ///< (apparent_volume - volume)/apparent_volume [-]
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< of the solid at unit density about its centroid [m^5]
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();   ///< solid's centre of mass in the frame of the masks [m]
};

/// Both level sets of a grain and its mass properties. `id` and `label` are left for the caller.
/// \param solid, apparent  masks in one frame (they may be cropped differently); apparent holds the solid
/// \throws Error as level_set_from_mask
GrainLevelSet grain_from_masks(const GrainMask& solid, const GrainMask& apparent, const LevelSetOptions& options,
                               LevelSetReport* solid_report = nullptr, LevelSetReport* apparent_report = nullptr);

}  // namespace coral::sdf
