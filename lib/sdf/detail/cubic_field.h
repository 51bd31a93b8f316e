#pragma once
/// \file sdf/detail/cubic_field.h
/// Catmull-Rom interpolation of a lattice of values, and Newton's method onto its zero level. Lengths in lattice steps.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

namespace coral::sdf::detail {

/// View of values on an integer lattice, x fastest, at least 4 nodes per axis. Negative in solid.
struct CubicField {
    Eigen::Vector3i size;
    const float* values;

    std::ptrdiff_t row() const { return size.x(); }
    std::ptrdiff_t layer() const { return std::ptrdiff_t(size.x()) * size.y(); }
    bool inside(const Eigen::Vector3d& p) const
    {
        return (p.array() >= 0.0).all() && (p.array() <= size.cast<double>().array() - 1.0).all();
    }

    /// Weights of the four nodes around a position, and their derivatives; returns the first node. Within one step of the
    /// border the outermost four nodes are used, as an extrapolation.
    static int weights(double x, int count, Eigen::Array4f& w, Eigen::Array4f& slope)
    {
        const int first = std::clamp(int(std::floor(x)) - 1, 0, count - 4);
        const float t = float(x - (first + 1)), t2 = t * t, t3 = t2 * t;
        w = {0.5f * (-t3 + 2 * t2 - t), 0.5f * (3 * t3 - 5 * t2 + 2), 0.5f * (-3 * t3 + 4 * t2 + t), 0.5f * (t3 - t2)};
        slope = {0.5f * (-3 * t2 + 4 * t - 1), 0.5f * (9 * t2 - 10 * t), 0.5f * (-9 * t2 + 8 * t + 1), 0.5f * (3 * t2 - 2 * t)};
        return first;
    }

    double value(const Eigen::Vector3d& p, Eigen::Vector3d& gradient) const
    {
        Eigen::Array4f wx, wy, wz, sx, sy, sz;
        const int i = weights(p.x(), size.x(), wx, sx);
        const int j = weights(p.y(), size.y(), wy, sy);
        const int k = weights(p.z(), size.z(), wz, sz);
        const float* corner = values + i + row() * j + layer() * k;
        // Lines along x stay four abreast until the end: one load and a few multiplications for each of the sixteen.
        Eigen::Array4f value = Eigen::Array4f::Zero(), gy = value, gz = value;
        for (int c = 0; c < 4; ++c) {
            Eigen::Array4f plane = Eigen::Array4f::Zero(), plane_y = plane;
            for (int b = 0; b < 4; ++b) {
                const Eigen::Array4f line = Eigen::Map<const Eigen::Array4f>(corner + layer() * c + row() * b);
                plane += wy[b] * line;
                plane_y += sy[b] * line;
            }
            value += wz[c] * plane;
            gy += wz[c] * plane_y;
            gz += sz[c] * plane;
        }
        gradient = Eigen::Vector3d((value * sx).sum(), (gy * wx).sum(), (gz * wx).sum());
        return (value * wx).sum();
    }

    /// Newton steps p -= f g/|g|^2, at most 0.7 each, until below `enough`. Returns whether it came within 0.05; normal = g/|g|.
    bool project(Eigen::Vector3d& p, Eigen::Vector3d& normal, int steps = 4, double enough = 1e-4) const
    {
        Eigen::Vector3d g;
        double move = 1.0;
        for (int n = 0; n < steps && move > enough; ++n) {
            const double f = value(p, g), slope2 = g.squaredNorm();
            if (slope2 < 1e-12) return false;
            const Eigen::Vector3d step = (f / slope2) * g;
            move = step.norm();
            p -= move > 0.7 ? Eigen::Vector3d(step * (0.7 / move)) : step;
            if (!inside(p)) return false;
        }
        normal = g.normalized();
        return move < 0.05;
    }
};

}  // namespace coral::sdf::detail
