#pragma once
/// \file dem/detail/facets.h
/// The surface of a lattice as triangles, found by place.
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "dem/detail/facet_quads.h"
#include "sdf/distance_grid.h"

namespace coral::dem::detail {

class Facets {
public:
    explicit Facets(const sdf::DistanceGrid& grid);
    /// Of the cells within `distance` of a point (in each axis) alone: there the triangles are those of the whole surface.
    Facets(const sdf::DistanceGrid& grid, const Eigen::Vector3d& point, double distance);
    std::size_t size() const { return balls_.size(); }
    std::size_t memory() const;  ///< [bytes]

    /// A triangle and its distance from a point, rounded down.
    struct Near {
        std::int32_t triangle;
        float clearance;  ///< [m]
    };
    /// Appends the triangles that come within `distance` of a point, nearest first.
    void gather(const Eigen::Vector3d& point, double distance, std::vector<Near>& list) const;
    /// Distance of the nearest triangle, rounded down, or `distance` if that is less [m].
    double nearest(const Eigen::Vector3d& point, double distance) const;
    /// Lays triangles out for press_on(), in the order of the list; what is left over of the last quad touches nothing.
    void lay_out(std::span<const Near> list, std::vector<FacetQuad>& quads) const;

private:
    /// Calls visit(triangle) for all that may come within `distance` of the point.
    template <class Visit>
    void for_each_near(const Eigen::Vector3d& point, double distance, const Visit& visit) const;
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
