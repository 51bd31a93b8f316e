#pragma once
/// \file suffusion/throats.h
/// How wide the ways out of the voids of a grain are.
#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "dem/world.h"
#include "sdf/distance_grid.h"

namespace coral::suffusion {

/// Throat transform of one shape: b(x) = max over paths from outside to x of the least distance to the solid on the path, the measure of mercury
/// intrusion. A node of the lattice stands for the largest distance within half a spacing of it, so that throats between nodes keep their width:
/// in bores through a shell, 3 to 12 spacings wide, 0 to 1 spacing too narrow, never too wide (by the nodes alone: 1.5).
class Throats {
public:
    explicit Throats(const sdf::DistanceGrid& grid);

    /// Width of the widest way out [m] for a ball about a point (shape frame), in steps of 1/255 of the widest gap on the lattice; 0: sealed in.
    /// Where the ball is held does not count: places within half its radius are as good.
    double width(const Eigen::Vector3d& point, double radius) const;

private:
    Eigen::Vector3i size_;
    Eigen::Vector3d origin_;
    double spacing_, step_ = 0.0;
    std::vector<std::uint8_t> radius_;  ///< b / step_, rounded down
};

/// Throats of the shapes of a world, each found when it is first asked for.
class ThroatLibrary {
public:
    /// Of a body with a lattice. \param point, radius  world frame [m]  \returns [m]
    double width(const dem::World& world, int body, const Eigen::Vector3d& from_centre, double radius);

private:
    std::map<int, Throats> by_shape_;
};

}  // namespace coral::suffusion
