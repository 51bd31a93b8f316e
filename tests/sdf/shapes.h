#pragma once
/// Shapes with known distances, as analytic functions, masks and grids.
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "sdf/level_set.h"

namespace coral::sdf::test {

using Distance = std::function<double(const Eigen::Vector3d&)>;

inline Distance sphere(const Eigen::Vector3d& centre, double radius)
{
    return [=](const Eigen::Vector3d& x) { return (x - centre).norm() - radius; };
}

/// Solid between two radii.
inline Distance shell(const Eigen::Vector3d& centre, double outer, double inner)
{
    return [=](const Eigen::Vector3d& x) { const double r = (x - centre).norm(); return std::max(r - outer, inner - r); };
}

inline Distance torus(const Eigen::Vector3d& centre, const Eigen::Matrix3d& frame, double ring, double tube)
{
    return [=](const Eigen::Vector3d& x) {
        const Eigen::Vector3d p = frame.transpose() * (x - centre);
        return std::hypot(std::hypot(p.x(), p.y()) - ring, p.z()) - tube;
    };
}

inline double sphere_volume(double radius) { return 4.0 / 3.0 * std::numbers::pi * radius * radius * radius; }

/// Owns the voxels of a mask.
struct Mask {
    std::vector<std::uint8_t> voxels;
    GrainMask view;
};

/// Voxels whose centre is solid in a box of `size` voxels whose first centre is the origin.
inline Mask voxelise(const Distance& distance, const Eigen::Vector3i& size, const Eigen::Vector3d& voxel_size)
{
    Mask mask;
    mask.voxels.reserve(std::size_t(size.prod()));
    for (int k = 0; k < size.z(); ++k)
        for (int j = 0; j < size.y(); ++j)
            for (int i = 0; i < size.x(); ++i)
                mask.voxels.push_back(distance(Eigen::Vector3d(i, j, k).cwiseProduct(voxel_size)) < 0);
    mask.view = {size, voxel_size, Eigen::Vector3d::Zero(), mask.voxels};
    return mask;
}

/// Exact distances on a lattice, optionally clamped to a band of nodes.
inline DistanceGrid tabulated(const Distance& distance, const Eigen::Vector3d& origin, const Eigen::Vector3i& size, double spacing,
                              double inside_band = 0, double outside_band = 0)
{
    DistanceGrid grid{size, origin, spacing, {}};
    for (int k = 0; k < size.z(); ++k)
        for (int j = 0; j < size.y(); ++j)
            for (int i = 0; i < size.x(); ++i) grid.distance.push_back(float(distance(grid.node(i, j, k))));
    if (inside_band > 0) {
        const float inside = float(inside_band * spacing), outside = float(outside_band * spacing);
        for (float& d : grid.distance) d = std::clamp(d, -inside, outside);
        grid.inside_limit = inside;
        grid.outside_limit = outside;
    }
    return grid;
}

/// Error of a grid against true distances at nodes nearer than `reach` to the surface, in units of `unit`.
struct DistanceError {
    double rms = 0, largest = 0, gradient_rms = 0;
    int wrong_signs = 0;  ///< of nodes farther than half a unit from the surface
};

inline DistanceError distance_error(const DistanceGrid& grid, const Distance& truth, double reach, double unit)
{
    DistanceError e;
    double count = 0;
    for (int k = 1; k + 1 < grid.size.z(); ++k)
        for (int j = 1; j + 1 < grid.size.y(); ++j)
            for (int i = 1; i + 1 < grid.size.x(); ++i) {
                const double d = truth(grid.node(i, j, k));
                const double found = grid.distance[grid.index(i, j, k)];
                if (std::abs(d) > 0.5 * unit && (d < 0) != (found < 0)) ++e.wrong_signs;
                if (std::abs(d) >= reach) continue;
                const double error = (found - d) / unit;
                Eigen::Vector3d g;
                for (int axis = 0; axis < 3; ++axis) {
                    const Eigen::Vector3i s = Eigen::Vector3i::Unit(axis);
                    g[axis] = (grid.distance[grid.index(i + s.x(), j + s.y(), k + s.z())] - double(grid.distance[grid.index(i - s.x(), j - s.y(), k - s.z())])) / (2 * grid.spacing);
                }
                e.rms += error * error;
                e.gradient_rms += (g.norm() - 1) * (g.norm() - 1);
                e.largest = std::max(e.largest, std::abs(error));
                ++count;
            }
    e.rms = std::sqrt(e.rms / count);
    e.gradient_rms = std::sqrt(e.gradient_rms / count);
    return e;
}

inline Eigen::Matrix3d some_rotation(double seed)
{
    return (Eigen::AngleAxisd(seed, Eigen::Vector3d(1, 2, 3).normalized()) * Eigen::AngleAxisd(2 * seed, Eigen::Vector3d::UnitX())).toRotationMatrix();
}

}  // namespace coral::sdf::test
