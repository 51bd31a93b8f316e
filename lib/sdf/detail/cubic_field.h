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
    static int weights(double x, int count, std::array<float, 4>& w, std::array<float, 4>& slope)
    {
        const int first = std::clamp(int(std::floor(x)) - 1, 0, count - 4);
        const float t = float(x - (first + 1)), t2 = t * t, t3 = t2 * t;
        w = {0.5f * (-t3 + 2 * t2 - t), 0.5f * (3 * t3 - 5 * t2 + 2), 0.5f * (-3 * t3 + 4 * t2 + t), 0.5f * (t3 - t2)};
        slope = {0.5f * (-3 * t2 + 4 * t - 1), 0.5f * (9 * t2 - 10 * t), 0.5f * (-9 * t2 + 8 * t + 1), 0.5f * (3 * t2 - 2 * t)};
        return first;
    }

    double value(const Eigen::Vector3d& p, Eigen::Vector3d& gradient) const
    {
        std::array<float, 4> wx, wy, wz, sx, sy, sz;
        const int i = weights(p.x(), size.x(), wx, sx);
        const int j = weights(p.y(), size.y(), wy, sy);
        const int k = weights(p.z(), size.z(), wz, sz);
        const float* corner = values + i + row() * j + layer() * k;
        float value = 0, gx = 0, gy = 0, gz = 0;
        for (int c = 0; c < 4; ++c) {
            float plane = 0, plane_x = 0, plane_y = 0;
            for (int b = 0; b < 4; ++b) {
                const float* a = corner + layer() * c + row() * b;
                const float line = wx[0] * a[0] + wx[1] * a[1] + wx[2] * a[2] + wx[3] * a[3];
                const float line_x = sx[0] * a[0] + sx[1] * a[1] + sx[2] * a[2] + sx[3] * a[3];
                plane += wy[b] * line;
                plane_x += wy[b] * line_x;
                plane_y += sy[b] * line;
            }
            value += wz[c] * plane;
            gx += wz[c] * plane_x;
            gy += wz[c] * plane_y;
            gz += sz[c] * plane;
        }
        gradient = Eigen::Vector3d(gx, gy, gz);
        return value;
    }

    /// Newton steps p -= f g/|g|^2, at most 0.7 each, until below 1e-4. Returns whether it got there; normal = g/|g|.
    bool project(Eigen::Vector3d& p, Eigen::Vector3d& normal, int steps = 4) const
    {
        Eigen::Vector3d g;
        double move = 1.0;
        for (int n = 0; n < steps && move > 1e-4; ++n) {
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
