#pragma once
/// \file sdf/surface_nodes.h
/// Near-uniform nodes on a surface with their share of its area, for node-to-surface contact.
#include <Eigen/Core>
#include <vector>

#include "sdf/distance_grid.h"

namespace coral::sdf {

struct SurfaceNodes {
    std::vector<Eigen::Vector3d> positions;  ///< on the zero level of the trilinear interpolant [m]
    std::vector<Eigen::Vector3d> normals;    ///< unit, out of the solid
    std::vector<double> areas;               ///< sum to the area of the mesh of the surface [m^2]
};

/// `count` nodes over the whole surface, void walls included: Poisson-disk seeds among area-uniform samples of the mesh,
/// evened out by Lloyd steps, then projected onto d = 0; a node's area is that of the samples nearest to it (in a metric
/// that keeps the two sides of a thin wall apart). Deterministic.
/// \param ball  radius of a ball [m]: where, touching, it overlaps the surface elsewhere by more than half its radius (in voids and pores), nodes
///              are three times as far apart, so that most of them are where other grains come. 0 spreads them evenly. Cut to what the
///              grid's outside distances answer for. A twentieth of the diameter suits grains against grains.
/// \throws Error when count < 4 or the grid has no surface
SurfaceNodes surface_nodes(const DistanceGrid& grid, int count, double ball = 0);

/// Node count for a mean distance between nodes [m]: area / spacing^2.
int node_count_for_spacing(const DistanceGrid& grid, double node_spacing);

}  // namespace coral::sdf
