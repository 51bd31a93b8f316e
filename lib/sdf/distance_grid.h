#pragma once
/// \file sdf/distance_grid.h
/// Dense lattice of signed distances: the form in which every module samples a shape.
/// Metres throughout; negative in solid, positive outside and in voids.
#include <Eigen/Core>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace coral::sdf {

/// Signed distance at the nodes of a cubic lattice, x fastest: node (i,j,k) lies at origin + spacing*(i,j,k).
/// The solid lies wholly inside the box of the nodes (the outermost nodes are positive).
struct DistanceGrid {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();      ///< nodes per axis, each at least 2
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();    ///< first node [m]
    double spacing = 0.0;                                ///< [m]
    std::vector<float> distance;                         ///< size.prod() values [m]
    /// Values at or beyond these magnitudes are clamped, not distances; infinite when every value is a distance [m].
    /// Contact must not use a clamped value: see sdf/extend.h.
    double outside_limit = std::numeric_limits<double>::infinity();
    double inside_limit = std::numeric_limits<double>::infinity();

    std::size_t node_count() const { return std::size_t(size.x()) * std::size_t(size.y()) * std::size_t(size.z()); }
    std::size_t index(int i, int j, int k) const
    {
        return std::size_t(i) + std::size_t(size.x()) * (std::size_t(j) + std::size_t(size.y()) * std::size_t(k));
    }
    Eigen::Vector3d node(int i, int j, int k) const { return origin + spacing * Eigen::Vector3d(i, j, k); }
    /// Last node, the upper corner of the box [m].
    Eigen::Vector3d upper() const { return origin + spacing * (size.cast<double>().array() - 1.0).matrix(); }
    /// Whether the point lies in the box of the nodes, faces included.
    bool inside_box(const Eigen::Vector3d& point) const
    {
        const Eigen::Vector3d last = upper();
        return point.x() >= origin.x() && point.y() >= origin.y() && point.z() >= origin.z() &&
               point.x() <= last.x() && point.y() <= last.y() && point.z() <= last.z();
    }

    /// Distance at a point [m], trilinear inside the box.
    /// Outside the box: sqrt(s^2 + max(d(q), 0)^2) with q the nearest point of the box and s = |point - q|. It is continuous
    /// over the faces, positive, and never above the true distance when d(q) is one (the box is convex and holds the solid):
    /// good for "no contact", not a distance. Where a true distance is wanted, extend the grid (sdf/extend.h).
    double sample(const Eigen::Vector3d& point) const;

    /// The same value, and its exact gradient: that of the interpolant itself, not normalised (|grad d| = 1 only where the
    /// nodes hold true distances and the surface is flat), so that a force along it does exactly the work of the potential.
    /// On faces between cells the gradient is that of the upper cell.
    double sample_with_gradient(const Eigen::Vector3d& point, Eigen::Vector3d& gradient) const;
};

namespace detail {

/// The eight values around a point and its position in their cell.
struct Cell {
    const float* corner;
    std::ptrdiff_t row, layer;  ///< strides in y and z
    double u, v, w;             ///< in [0, 1]
};

/// \pre the point lies in the box
inline Cell cell_at(const DistanceGrid& grid, const Eigen::Vector3d& point)
{
    assert(grid.size.minCoeff() >= 2);
    const double scale = 1.0 / grid.spacing;
    const double x = (point.x() - grid.origin.x()) * scale;
    const double y = (point.y() - grid.origin.y()) * scale;
    const double z = (point.z() - grid.origin.z()) * scale;
    const int i = std::clamp(int(x), 0, grid.size.x() - 2);
    const int j = std::clamp(int(y), 0, grid.size.y() - 2);
    const int k = std::clamp(int(z), 0, grid.size.z() - 2);
    const std::ptrdiff_t row = grid.size.x(), layer = row * grid.size.y();
    return {grid.distance.data() + i + j * row + k * layer, row, layer, x - i, y - j, z - k};
}

inline double interpolate(const Cell& c)
{
    const float* a = c.corner;
    const double x00 = a[0] + c.u * (double(a[1]) - a[0]);
    const double x10 = a[c.row] + c.u * (double(a[c.row + 1]) - a[c.row]);
    a += c.layer;
    const double x01 = a[0] + c.u * (double(a[1]) - a[0]);
    const double x11 = a[c.row] + c.u * (double(a[c.row + 1]) - a[c.row]);
    const double y0 = x00 + c.v * (x10 - x00), y1 = x01 + c.v * (x11 - x01);
    return y0 + c.w * (y1 - y0);
}

inline double interpolate_with_gradient(const Cell& c, double scale, Eigen::Vector3d& gradient)
{
    const float *a = c.corner, *b = c.corner + c.layer;
    const double d00 = double(a[1]) - a[0], d10 = double(a[c.row + 1]) - a[c.row];
    const double d01 = double(b[1]) - b[0], d11 = double(b[c.row + 1]) - b[c.row];
    const double x00 = a[0] + c.u * d00, x10 = a[c.row] + c.u * d10;
    const double x01 = b[0] + c.u * d01, x11 = b[c.row] + c.u * d11;
    const double y0 = x00 + c.v * (x10 - x00), y1 = x01 + c.v * (x11 - x01);
    const double g0 = d00 + c.v * (d10 - d00), g1 = d01 + c.v * (d11 - d01);
    gradient.x() = scale * (g0 + c.w * (g1 - g0));
    gradient.y() = scale * ((x10 - x00) + c.w * ((x11 - x01) - (x10 - x00)));
    gradient.z() = scale * (y1 - y0);
    return y0 + c.w * (y1 - y0);
}

}  // namespace detail

inline double DistanceGrid::sample(const Eigen::Vector3d& point) const
{
    if (inside_box(point)) return detail::interpolate(detail::cell_at(*this, point));
    const Eigen::Vector3d nearest = point.cwiseMax(origin).cwiseMin(upper());
    const double d = std::max(detail::interpolate(detail::cell_at(*this, nearest)), 0.0);
    return std::sqrt((point - nearest).squaredNorm() + d * d);
}

inline double DistanceGrid::sample_with_gradient(const Eigen::Vector3d& point, Eigen::Vector3d& gradient) const
{
    if (inside_box(point)) return detail::interpolate_with_gradient(detail::cell_at(*this, point), 1.0 / spacing, gradient);
    const Eigen::Vector3d nearest = point.cwiseMax(origin).cwiseMin(upper());
    const Eigen::Vector3d beyond = point - nearest;
    Eigen::Vector3d face_gradient;
    const double on_face = detail::interpolate_with_gradient(detail::cell_at(*this, nearest), 1.0 / spacing, face_gradient);
    const double d = std::max(on_face, 0.0);
    const double bound = std::sqrt(beyond.squaredNorm() + d * d);
    for (int axis = 0; axis < 3; ++axis)  // along the axes left behind the nearest point stays; along the others it follows
        gradient[axis] = (beyond[axis] != 0.0 ? beyond[axis] : d * face_gradient[axis]) / bound;
    return bound;
}

}  // namespace coral::sdf
