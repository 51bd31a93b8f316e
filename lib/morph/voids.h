#pragma once
/// \file morph/voids.h
/// The intraparticle voids of one grain, one by one: whether a fine can get in, and how deep it would sit.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "morph/voxel_stack.h"

namespace coral::morph {

/// A 6-connected void inside the apparent shape of at least eight voxels; an open one also takes a ball of radius 1.5 c, so that the
/// dimples of a rough surface are none (c: geometric mean of the voxel edges).
struct Void {
    std::size_t voxels = 0;
    double volume = 0;           ///< [m^3]
    bool open = false;           ///< 6-connected to the outside
    /// Bottleneck to the outside [m]: twice the throat transform b(x), the largest ball radius that comes from outside to x [mercury
    /// intrusion's measure; see bottlenecks in docs/numerics.md], the largest over the voxels behind a constriction (d > b + c), the
    /// ball moved off the voxel centre. Where the void nowhere widens behind its mouth: the largest ball that comes in. 0 when closed.
    double throat_diameter = 0;
    double width = 0;            ///< diameter of the largest ball in the void [m]
    double depth = 0;            ///< distance of its deepest voxel centre to the apparent surface [m]
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< in the frame of the stack (voxel centres at (i + 1/2) dx ..) [m]
};

/// The void with all lengths multiplied by `factor`, as a stack with larger voxels has it.
Void scaled(Void v, double factor);

/// Per voxel: 1 in closed voids, 2 in voids 6-connected to the outside, 0 elsewhere and in dimples, which are told from voids as
/// Void says but on the lattice (an open void holds a voxel whose 26 neighbours are no solid). Both masks are of one box.
std::vector<std::uint8_t> void_classes(const Mask& solid, const Mask& apparent);

}  // namespace coral::morph
