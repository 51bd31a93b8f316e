#pragma once
/// \file sdf/detail/closest_point.h
/// Distances from lattice nodes to a surface given by foot points: nearest foot point near the surface, its number carried
/// outwards by sweeps, then refined to the closest point of the surface itself [docs/numerics.md, geometry].
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "sdf/detail/foot_points.h"

namespace coral::sdf::detail {

/// Node (i,j,k) at origin + step*(i,j,k), in the unit of the foot points.
struct Lattice {
    Eigen::Vector3i size;
    Eigen::Vector3d origin;
    double step;
    std::size_t count() const { return std::size_t(size.x()) * std::size_t(size.y()) * std::size_t(size.z()); }
};

/// Nearest foot point of each node; -1 where none is within reach.
class NearestFoot {
public:
    /// \param reach_solid, reach_open  how far to carry feet on either side of the surface
    /// \param solid                    whether a node is solid, x fastest
    NearestFoot(const Lattice& lattice, const std::vector<FootPoint>& feet, const std::vector<std::uint8_t>& solid,
                double reach_solid, double reach_open);
    std::int32_t foot(int i, int j, int k) const { return foot_[padded(i, j, k)]; }
    float squared_distance(int i, int j, int k) const { return squared_[padded(i, j, k)]; }

private:
    std::size_t padded(int i, int j, int k) const
    {
        return std::size_t(i + 1) + row_ * std::size_t(j + 1) + layer_ * std::size_t(k + 1);
    }
    void scatter();
    void sweep(int dx, int dy, int dz);
    void take_from(std::size_t row, std::ptrdiff_t other, float y, float z);
    void carry_along(std::size_t row, int dx, float y, float z);

    const Lattice& lattice_;
    const std::vector<FootPoint>& feet_;
    std::size_t row_, layer_;             // of the arrays below, which have one node more on each side: no border checks
    std::vector<std::int32_t> foot_;
    std::vector<float> squared_;          // to the foot; starts at the squared reach
    std::vector<float> x_, y_, z_;        // of the foot, beside its number: whole rows are then compared at once
    std::vector<float> along_;            // x of the nodes of a row
};

/// Closest point by steps along the tangent plane and back onto the surface, kept while they come nearer.
/// \param project  bool(Vector3d& point, Vector3d& normal): moves a point near the surface onto it
/// \param longest  longest step, about the distance between foot points
template <class Project>
double refined_distance(const Eigen::Vector3d& x, const FootPoint& foot, double longest, const Project& project)
{
    Eigen::Vector3d p = foot.position.cast<double>(), normal = foot.normal.cast<double>();
    // What a step along the surface can still take off the distance is length^2/2d on a flat one.
    constexpr double negligible = 2e-4;  // of twice the longest step
    double best = (x - p).squaredNorm(), stride = 1.0;  // stride: step per tangential residual, 1 on a flat surface
    for (int n = 0; n < 4; ++n) {
        const Eigen::Vector3d r = x - p, residual = r - r.dot(normal) * normal;
        const double length = residual.norm();
        if (length * length <= negligible * longest * std::sqrt(best)) break;
        const double step = std::min(stride * length, longest);
        const Eigen::Vector3d direction = residual / length;
        Eigen::Vector3d q = p + step * direction, q_normal;
        if (!project(q, q_normal)) break;
        // What is left of the residual after the step tells the stride on this curvature (secant).
        const Eigen::Vector3d s = x - q;
        const double left = (s - s.dot(q_normal) * q_normal).dot(direction);
        stride = std::clamp(length - left > 0 ? step / (length - left) : 2.0, 0.02, 4.0);
        const double squared = s.squaredNorm();
        if (squared < best) {
            best = squared;
            p = q;
            normal = q_normal;
        }
    }
    return std::sqrt(best);
}

/// Signed distance at each node, `reach` with the node's sign where no foot is within reach.
/// \param keep  nodes that are left alone (may be empty)
template <class Project>
void fill_distances(const Lattice& lattice, const std::vector<FootPoint>& feet, const std::vector<std::uint8_t>& solid,
                    const std::vector<std::uint8_t>& keep, double reach_solid, double reach_open, double longest,
                    double unit, const Project& project, std::vector<float>& distance)
{
    const NearestFoot nearest(lattice, feet, solid, reach_solid, reach_open);
    const std::size_t nx = std::size_t(lattice.size.x()), ny = std::size_t(lattice.size.y());
    parallel_blocks(lattice.count() / nx, 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t line = begin; line < end; ++line) {
            const int j = int(line % ny), k = int(line / ny);
            for (int i = 0; i < lattice.size.x(); ++i) {
                const std::size_t node = line * nx + std::size_t(i);
                if (!keep.empty() && keep[node]) continue;
                const double sign = solid[node] ? -1.0 : 1.0;
                const std::int32_t foot = nearest.foot(i, j, k);
                double d = solid[node] ? reach_solid : reach_open;
                if (foot >= 0) {
                    const Eigen::Vector3d x = lattice.origin + lattice.step * Eigen::Vector3d(i, j, k);
                    d = refined_distance(x, feet[std::size_t(foot)], longest, project);
                }
                distance[node] = float(sign * d * unit);
            }
        }
    });
}

}  // namespace coral::sdf::detail
