#pragma once
/// \file dem/detail/plate.h
/// Unlimited horizontal plate with a square lattice of square holes: exact distances to its solid.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace coral::dem::detail {

struct Plate {
    double top = 0, thickness = 0, hole = 0, pitch = 1;
    Eigen::Vector2d hole_centre = Eigen::Vector2d::Zero();

    double middle() const { return top - 0.5 * thickness; }
    /// Position against the centre of the nearest hole.
    Eigen::Vector2d to_hole(const Eigen::Vector3d& p) const
    {
        Eigen::Vector2d q = p.head<2>() - hole_centre;
        q.x() -= pitch * std::nearbyint(q.x() / pitch);
        q.y() -= pitch * std::nearbyint(q.y() / pitch);
        return q;
    }

    /// Signed distance to the solid and its gradient.
    double distance_and_gradient(const Eigen::Vector3d& p, Eigen::Vector3d& gradient) const
    {
        const double up = p.z() < middle() ? -1.0 : 1.0;
        const double dz = std::abs(p.z() - middle()) - 0.5 * thickness;
        gradient = {0.0, 0.0, up};
        if (hole <= 0.0) return dz;
        // Across: s > 0 in a hole, distance to its nearest wall; s < 0 in the bars, distance to the nearest hole.
        const Eigen::Vector2d q = to_hole(p);
        const double sx = q.x() < 0.0 ? -1.0 : 1.0, sy = q.y() < 0.0 ? -1.0 : 1.0;
        const double bx = std::abs(q.x()) - 0.5 * hole, by = std::abs(q.y()) - 0.5 * hole;
        double s;
        Eigen::Vector2d across;
        if (bx > 0.0 && by > 0.0) {
            s = -std::sqrt(bx * bx + by * by);
            across = Eigen::Vector2d(sx * bx, sy * by) / s;
        } else {
            s = -std::max(bx, by);
            across = bx > by ? Eigen::Vector2d(-sx, 0.0) : Eigen::Vector2d(0.0, -sy);
        }
        if (s > 0.0 && dz > 0.0) {
            const double d = std::sqrt(s * s + dz * dz);
            gradient << across * (s / d), up * (dz / d);
            return d;
        }
        if (s > dz) {
            gradient << across, 0.0;
            return s;
        }
        return dz;
    }

    static constexpr int features = 5;
    /// Feature of the plate as a sphere's centre sees it: 0..3 the walls x+ x- y+ y- of the hole it is over or in, 4 the solid itself.
    /// Over a hole a large sphere may rest on all four rims at once, so each is a contact of its own.
    /// \return false when the feature does not face the point
    bool feature(int k, const Eigen::Vector3d& p, double& distance, Eigen::Vector3d& normal) const
    {
        const Eigen::Vector2d q = to_hole(p);
        const bool over_hole = std::abs(q.x()) < 0.5 * hole && std::abs(q.y()) < 0.5 * hole;
        if (k == 4) {
            if (over_hole) return false;
            distance = distance_and_gradient(p, normal);
            return true;
        }
        if (!over_hole) return false;
        const int axis = k / 2;
        const double side = k % 2 == 0 ? 1.0 : -1.0;
        const double lateral = 0.5 * hole - side * q[axis];
        const double up = p.z() < middle() ? -1.0 : 1.0;
        const double dz = std::max(std::abs(p.z() - middle()) - 0.5 * thickness, 0.0);
        distance = std::sqrt(lateral * lateral + dz * dz);
        normal.setZero();
        if (distance > 0.0) {
            normal[axis] = -side * lateral / distance;
            normal.z() = up * dz / distance;
        } else {
            normal.z() = up;
        }
        return true;
    }
};

}  // namespace coral::dem::detail
