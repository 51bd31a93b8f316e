#pragma once
/// \file suffusion/apparent.h
/// Which points lie in the voids of a grain: inside its apparent shape and outside its solid.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sdf/distance_grid.h"

namespace coral::suffusion {

/// Void region of one shape, on a lattice of its frame.
/// Apparent shape: ball-reachable closing. With E the points farther than R from the solid and connected to the outside, a point
/// is inside when its distance to E exceeds R (half a spacing of tolerance)      [docs/numerics.md, geometry; R = 0.1 d]
class ApparentShape {
public:
    /// \param diameter  equivalent diameter of the apparent shape [m]
    ApparentShape(const sdf::DistanceGrid& grid, double diameter);

    /// Whether a point of the shape frame [m] lies in the filled outline (solid or void), nearest node.
    bool contains(const Eigen::Vector3d& point) const
    {
        const Eigen::Vector3d at = (point - origin_) / spacing_;
        const int i = static_cast<int>(std::floor(at.x() + 0.5)), j = static_cast<int>(std::floor(at.y() + 0.5)),
                  k = static_cast<int>(std::floor(at.z() + 0.5));
        if (i < 0 || j < 0 || k < 0 || i >= size_.x() || j >= size_.y() || k >= size_.z()) return false;
        return inside_[static_cast<std::size_t>(i) + static_cast<std::size_t>(size_.x()) * (static_cast<std::size_t>(j) + static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(k))] != 0;
    }
    double volume() const;  ///< of the nodes inside [m3]

private:
    Eigen::Vector3i size_;
    Eigen::Vector3d origin_;
    double spacing_;
    std::vector<std::uint8_t> inside_;
};

}  // namespace coral::suffusion
