#pragma once
/// \file sdf/mesh_level_set.h
/// From the closed triangle mesh of one grain to its level sets, without voxels in between.
#include "sdf/level_set.h"
#include "sdf/mesh.h"

namespace coral::sdf {

/// Signed distance to a closed mesh, clamped to the band. Distances by OpenVDB's meshToVolume, which measures them to the triangles; signs by
/// solid_nodes. OpenVDB's own signs come from flooding in from outside: they fill closed cavities, and throats narrower than the spacing.
/// \param mesh  [m], as closed_body leaves it
/// \param report  `voxel_volume` is the volume the mesh encloses, `foot_points` its triangles
/// \note OpenVDB carries the nearest triangle outwards from node to node, which misses the true one at times: 0.03 spacing RMS within four spacings
///       of a ball of radius 20 spacings, 0.2 spacing at most in a cavity of radius 12. Parts thinner than the spacing may miss every node, as from masks.
DistanceGrid level_set_from_mesh(const TriangleMesh& mesh, const LevelSetOptions& options, LevelSetReport* report = nullptr);

/// Both level sets of a grain: the solid from its mesh, the apparent shape from a mask of its closing, joined with the solid.
/// \param apparent  voids filled, in the mesh's frame; `options.spacing` is at least half its voxel edge
/// \throws Error as grain_from_masks
GrainLevelSet grain_from_mesh(const TriangleMesh& mesh, const GrainMask& apparent, const LevelSetOptions& options, LevelSetReport* report = nullptr);

}  // namespace coral::sdf
