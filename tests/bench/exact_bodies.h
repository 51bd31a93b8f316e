#pragma once
/// \file bench/exact_bodies.h
/// Bodies whose distance, volume and inertia are known exactly, and their voxels. Lengths in any one unit; negative in solid.
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "sdf/level_set.h"

namespace coral::bench {

/// Body about its own origin.
struct ExactBody {
    std::string name;
    std::function<double(const Eigen::Vector3d&)> distance;    ///< signed, exact everywhere
    double reach = 0;                                          ///< radius of a ball about the origin that holds it
    double volume = 0;
    Eigen::Vector3d inertia = Eigen::Vector3d::Zero();         ///< about the centroid at unit density, rising
    double throat = 0;                                         ///< diameter of its hole, which runs along +z; 0: none
    std::array<double, 2> throat_range{};                      ///< z over which the hole is round and of that width
};

inline Eigen::Vector3d rising(std::array<double, 3> values)
{
    std::sort(values.begin(), values.end());
    return {values[0], values[1], values[2]};
}

inline ExactBody exact_ellipsoid(double a, double b, double c)
{
    const Eigen::Vector3d axes(a, b, c);
    ExactBody body;
    body.name = a == b && b == c ? "sphere" : "ellipsoid";
    // Foot point p_i = a_i^2 x_i/(t + a_i^2) with t the largest root of sum (a_i x_i/(t + a_i^2))^2 = 1: the sum is convex and
    // falls in t, so that Newton from a point where it exceeds 1 climbs to the root.
    body.distance = [axes](const Eigen::Vector3d& x) {
        const Eigen::Array3d y = x.array().abs().max(1e-12 * axes.x()), e = axes.array();
        double t = (e * y - e * e).maxCoeff();
        for (int n = 0; n < 60; ++n) {
            const Eigen::Array3d q = e * y / (t + e * e);
            const double f = q.square().sum() - 1, slope = -2 * (q.square() / (t + e * e)).sum(), step = -f / slope;
            t += step;
            if (std::abs(step) < 1e-14 * axes.x() * axes.x()) break;
        }
        const Eigen::Array3d foot = e * e * y / (t + e * e);
        return (t < 0 ? -1.0 : 1.0) * (y - foot).matrix().norm();
    };
    body.reach = axes.maxCoeff();
    body.volume = 4.0 / 3.0 * std::numbers::pi * a * b * c;
    body.inertia = body.volume / 5 * rising({b * b + c * c, c * c + a * a, a * a + b * b});
    return body;
}

/// Circle of radius `tube` swept along one of radius `ring` about z.
inline ExactBody exact_torus(double ring, double tube)
{
    ExactBody body;
    body.name = "torus";
    body.distance = [=](const Eigen::Vector3d& x) { return std::hypot(std::hypot(x.x(), x.y()) - ring, x.z()) - tube; };
    body.reach = ring + tube;
    body.volume = 2 * std::pow(std::numbers::pi, 2) * ring * tube * tube;
    const double across = body.volume * (0.5 * ring * ring + 0.625 * tube * tube), along = body.volume * (ring * ring + 0.75 * tube * tube);
    body.inertia = rising({across, across, along});
    return body;
}

/// Hollow sphere with a straight round hole of radius `hole` through its wall along +z.
/// A cut by any plane through z is the same, so distances are those in the plane to two arcs and the straight hole.
inline ExactBody exact_shell(double outer, double inner, double hole)
{
    ExactBody body;
    body.name = "shell with hole";
    const double outer_end = std::sqrt(outer * outer - hole * hole), inner_end = std::sqrt(inner * inner - hole * hole);
    body.distance = [=](const Eigen::Vector3d& x) {
        const double rho = std::hypot(x.x(), x.y()), z = x.z(), r = std::hypot(rho, z);
        const auto to_arc = [&](double radius, double end) {
            const bool beside = rho * end >= z * hole;  // the nearest point of the whole circle is not in the hole
            return beside ? std::abs(r - radius) : std::hypot(rho - hole, z - end);
        };
        const double to_hole = std::hypot(rho - hole, z - std::clamp(z, inner_end, outer_end));
        const double d = std::min({to_arc(outer, outer_end), to_arc(inner, inner_end), to_hole});
        const bool solid = r < outer && r > inner && !(z > 0 && rho < hole);
        return solid ? -d : d;
    };
    body.reach = outer;
    body.throat = 2 * hole;
    body.throat_range = {inner_end, outer_end};

    // Moments of the whole shell less those of the hole: rings of width d rho, Simpson's rule.
    const auto ball = [](double r, int power) { return 4 * std::numbers::pi * std::pow(r, power + 3) / ((power + 3) * (power == 0 ? 1 : 3)); };
    double m0 = ball(outer, 0) - ball(inner, 0), mz = 0, mzz = ball(outer, 2) - ball(inner, 2), mxx = mzz;
    const int n = 2000;
    for (int i = 0; i <= n; ++i) {
        const double rho = hole * i / n, weight = (i == 0 || i == n ? 1 : i % 2 ? 4 : 2) * hole / (3.0 * n) * 2 * std::numbers::pi * rho;
        const double high = std::sqrt(outer * outer - rho * rho), low = std::sqrt(inner * inner - rho * rho);
        m0 -= weight * (high - low);
        mz -= weight * (high * high - low * low) / 2;
        mzz -= weight * (std::pow(high, 3) - std::pow(low, 3)) / 3;
        mxx -= weight * (high - low) * rho * rho / 2;
    }
    mzz -= mz * mz / m0;
    body.volume = m0;
    body.inertia = rising({mxx + mzz, mxx + mzz, 2 * mxx});
    return body;
}

/// A body somewhere in a stack, and its binary voxels: solid where the centre of the voxel is.
struct VoxelBody {
    ExactBody body;
    Eigen::Matrix3d frame;   ///< body axes -> stack axes
    Eigen::Vector3d centre;  ///< of the body; voxel (0,0,0) has its centre at the origin
    Eigen::Vector3i size;
    Eigen::Vector3d voxel_size;
    std::vector<std::uint8_t> voxels;

    VoxelBody(ExactBody exact, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& shift, const Eigen::Vector3d& edges)
        : body(std::move(exact)), frame(rotation), voxel_size(edges)
    {
        size = (2 * body.reach / edges.array()).ceil().cast<int>() + 4;
        centre = (0.5 * (size.cast<double>().array() - 1) + shift.array()).matrix().cwiseProduct(edges);
        voxels.reserve(std::size_t(size.prod()));
        for (int k = 0; k < size.z(); ++k)
            for (int j = 0; j < size.y(); ++j)
                for (int i = 0; i < size.x(); ++i) voxels.push_back(distance(Eigen::Vector3d(i, j, k).cwiseProduct(edges)) < 0);
    }
    double distance(const Eigen::Vector3d& x) const { return body.distance(frame.transpose() * (x - centre)); }
    sdf::GrainMask mask() const { return {size, voxel_size, Eigen::Vector3d::Zero(), voxels}; }
};

}  // namespace coral::bench
