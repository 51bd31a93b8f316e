#pragma once
/// \file dem/detail/facets.h
/// The surface of a lattice as triangles, and what a ball presses on each of them.
///
/// A ball of radius R at c stores in the surface that it covers
///     U = k_a int (R^2 - |c - x|^2)/(2R) dA over |x - c| < R,  k_a = kn/(2 pi R),      F = -dU/dc = k_a int (c - x)/R dA
/// On a plane at overlap d this is kn d^2/2 (1 - d/2R)^2: the linear law. It is a sum over the surface, so that every wall that the ball
/// touches has its part without being found as one, and a polynomial in the plane of each triangle, so that it and its gradient are exact.
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "sdf/distance_grid.h"

namespace coral::dem::detail {

/// Integrals over a part of the surface.
struct Press {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< int (c - x)/R dA [m2]
    double energy = 0.0;                              ///< int (R^2 - |c - x|^2)/(2R) dA [m3]
};

class Facets {
public:
    explicit Facets(const sdf::DistanceGrid& grid);
    /// Of the cells within `distance` of a point (in each axis) alone: there the triangles are those of the whole surface.
    Facets(const sdf::DistanceGrid& grid, const Eigen::Vector3d& point, double distance);
    std::size_t size() const { return balls_.size(); }
    std::size_t memory() const;  ///< [bytes]

    /// A triangle and how far it is at least from a point.
    struct Near {
        std::int32_t triangle;
        float clearance;  ///< [m]
    };
    /// Appends the triangles that come within `distance` of a point, nearest first.
    void gather(const Eigen::Vector3d& point, double distance, std::vector<Near>& list) const;
    /// What a ball presses on one triangle. \returns whether it covers any of it
    bool press(std::int32_t triangle, const Eigen::Vector3d& centre, double radius, Press& press) const;

private:
    double clearance(std::int32_t triangle, const Eigen::Vector3d& point) const;
    struct Ball {  ///< around a triangle
        float x, y, z, radius;
    };
    struct Corners {
        float at[9];
    };
    std::vector<Ball> balls_;
    std::vector<Corners> corners_;
    // Triangles in the order of cubic blocks of a few cells.
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    Eigen::Vector3i blocks_ = Eigen::Vector3i::Zero();
    double edge_ = 1.0;
    std::vector<std::int32_t> start_;
};

}  // namespace coral::dem::detail
