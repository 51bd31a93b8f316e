#pragma once
/// \file sh/surface_distance.h
/// True signed distance to a harmonic surface, and the nearest point on it, without a grid.
/// The foot point minimises f(u) = |x - c - r(u) u|^2 / 2 over the unit sphere: Newton's method with the exact second derivative,
/// started from every sampled surface point that is nearer than its neighbours and could hide the nearest one.
/// Error: the foot is a stationary point to 1e-12 of the radius; that it is the nearest one is sure where the basins of f are wider
/// than the samples lie apart. docs/numerics.md, Geometry, holds the measured error and cost beside those of a tabulated grid.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "sh/surface.h"

namespace coral::sh {

class SurfaceDistance {
public:
    struct Foot {
        double distance = 0.0;      ///< negative inside [m]
        Eigen::Vector3d point;      ///< nearest point of the surface, in the grain's frame [m]
        Eigen::Vector3d normal;     ///< outward unit normal there; the gradient of the distance wherever that exists
        Eigen::Vector3d direction;  ///< of the point from the centre: the guess for a query near by
    };

    /// \param samples  start points kept; 0 takes 12 (degree + 1)^2
    /// \throws Error when the radius is not positive at a sample
    explicit SurfaceDistance(const Surface& surface, int samples = 0);

    /// Nearest point of the whole surface. Thread-safe.
    Foot foot(const Eigen::Vector3d& x) const;
    /// Distance only [m].
    double distance(const Eigen::Vector3d& x) const { return foot(x).distance; }
    /// Foot point by Newton's method from a guessed direction alone: for a query that has moved little since `guess` was found.
    /// A local minimum: the nearest point as long as it stays on that side of the grain.
    Foot foot_near(const Eigen::Vector3d& x, const Eigen::Vector3d& guess) const;

    const Evaluator& evaluator() const { return evaluator_; }

private:
    static constexpr int neighbour_count = 8;
    void gather_starts(const Eigen::Vector3f& x, std::vector<std::pair<float, int>>& starts) const;
    double descend(const Eigen::Vector3d& y, Eigen::Vector3d& u) const;
    Foot finish(const Eigen::Vector3d& x, const Eigen::Vector3d& u) const;

    Evaluator evaluator_;
    std::vector<Eigen::Vector3d> directions_;                    ///< of the samples
    Eigen::ArrayXf px_, py_, pz_;                                ///< samples about the centre [m], padded to whole blocks
    std::vector<std::array<int, neighbour_count>> neighbours_;   ///< of each sample on the sphere
    std::vector<float> reach_;                                   ///< no surface point of a sample's cell is farther from it [m]
    float largest_reach_ = 0.0f;
    double step_limit_ = 0.3;                                    ///< of Newton's method [rad]
};

}  // namespace coral::sh
