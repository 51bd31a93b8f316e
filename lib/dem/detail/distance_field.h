#pragma once
/// \file dem/detail/distance_field.h
/// The distance of a shape with nodes, chosen once per pair: lattice or polyhedron. Loops branch on a pointer, no call is virtual.
#include "dem/shape.h"

namespace coral::dem::detail {

struct DistanceField {
    const sdf::DistanceGrid* grid = nullptr;
    const Polyhedron* polyhedron = nullptr;

    DistanceField() = default;
    /// \pre the shape is no sphere
    explicit DistanceField(const Shape& shape)
        : grid(shape.kind() == ShapeKind::grid ? &shape.distance_grid() : nullptr),
          polyhedron(shape.kind() == ShapeKind::polyhedron ? &shape.polyhedron() : nullptr)
    {
    }

    /// For spheres: distance everywhere (a lattice, out to its reach) [m].
    double distance_and_gradient(const Eigen::Vector3d& p, Eigen::Vector3d& gradient) const
    {
        return grid ? grid->sample_with_gradient(p, gradient) : polyhedron->distance_and_gradient(p, gradient);
    }
    double distance(const Eigen::Vector3d& p) const { return grid ? grid->sample(p) : polyhedron->distance(p); }

    /// For nodes: distance inside, a lower bound of it outside, where nothing acts.
    double depth_and_gradient(const Eigen::Vector3d& p, Eigen::Vector3d& gradient) const
    {
        return grid ? grid->sample_with_gradient(p, gradient) : polyhedron->depth_and_normal(p, gradient);
    }
    double lower_bound(const Eigen::Vector3d& p) const
    {
        Eigen::Vector3d ignored;
        return grid ? grid->sample(p) : polyhedron->depth_and_normal(p, ignored);
    }
};

}  // namespace coral::dem::detail
