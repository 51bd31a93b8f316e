#pragma once
/// \file dem/detail/distance_field.h
/// The distance of a shape with nodes, chosen once per pair: lattice or polyhedron. Loops branch on a pointer, no call is virtual.
#include <cstdint>

#include "dem/shape.h"

namespace coral::dem::detail {

/// The eight values of a lattice around a place of contact. A contact stays in its cell for many steps, and the lattices of a packing are far
/// larger than a cache: remembered, they save most of the time of a query.
struct CellMemory {
    std::int32_t at = -1;  ///< of the first value in the lattice; -1: none
    float values[8] = {};
};

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
    /// The same two of a place that was asked for before; the numbers are the same to the bit.
    double distance_and_gradient(const Eigen::Vector3d& p, Eigen::Vector3d& gradient, CellMemory& memory) const
    {
        return grid ? remembered(p, gradient, memory) : polyhedron->distance_and_gradient(p, gradient);
    }
    double depth_and_gradient(const Eigen::Vector3d& p, Eigen::Vector3d& gradient, CellMemory& memory) const
    {
        return grid ? remembered(p, gradient, memory) : polyhedron->depth_and_normal(p, gradient);
    }
    /// \pre a lattice, and the point lies in its box
    double distance(const Eigen::Vector3d& p, CellMemory& memory) const { return sdf::detail::interpolate(cell_of(p, memory)); }

private:
    double remembered(const Eigen::Vector3d& p, Eigen::Vector3d& gradient, CellMemory& memory) const
    {
        if (!grid->inside_box(p)) return grid->sample_with_gradient(p, gradient);
        return sdf::detail::interpolate_with_gradient(cell_of(p, memory), 1.0 / grid->spacing, gradient);
    }
    sdf::detail::Cell cell_of(const Eigen::Vector3d& p, CellMemory& memory) const
    {
        sdf::detail::Cell cell = sdf::detail::cell_at(*grid, p);
        const auto at = std::int32_t(cell.corner - grid->distance.data());
        if (memory.at != at) {
            memory.at = at;
            for (int k = 0; k < 8; ++k) memory.values[k] = cell.corner[(k & 1) + (k >> 1 & 1) * cell.row + (k >> 2) * cell.layer];
        }
        cell.corner = memory.values;
        cell.row = 2;
        cell.layer = 4;
        return cell;
    }
};

}  // namespace coral::dem::detail
