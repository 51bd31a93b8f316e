#include "sdf/mass_properties.h"

#include <array>
#include <numbers>

#include "core/parallel.h"

namespace coral::sdf {
namespace {

constexpr double support = 1.0;  // of smoothed_solid, in spacings

using Moments = Eigen::Array<double, 10, 1>;  // 1; x y z; xx yy zz; xy yz zx

}  // namespace

double smoothed_solid(double s)
{
    if (s <= -support) return 1.0;
    if (s >= support) return 0.0;
    return 0.5 * (1.0 - s - std::numbers::pi / 6.0 * std::sin(std::numbers::pi * s));
}

MassProperties mass_properties(const DistanceGrid& grid)
{
    const std::size_t nx = std::size_t(grid.size.x()), ny = std::size_t(grid.size.y());
    const double scale = 1.0 / grid.spacing;
    // Moments in node units about the middle of the box, which keeps the differences below well conditioned.
    const Eigen::Vector3d middle = 0.5 * (grid.size.cast<double>().array() - 1.0).matrix();
    const Moments sum = parallel_sum(grid.node_count() / nx, 64, Moments(Moments::Zero()), [&](std::size_t begin, std::size_t end) {
        Moments part = Moments::Zero();
        for (std::size_t line = begin; line < end; ++line) {
            const float* d = grid.distance.data() + line * nx;
            double m0 = 0, m1 = 0, m2 = 0;
            for (std::size_t i = 0; i < nx; ++i) {
                const double s = d[i] * scale;
                if (s >= support) continue;
                const double w = s <= -support ? 1.0 : smoothed_solid(s), x = double(i) - middle.x();
                m0 += w;
                m1 += w * x;
                m2 += w * x * x;
            }
            const double y = double(line % ny) - middle.y(), z = double(line / ny) - middle.z();
            part[0] += m0, part[1] += m1, part[2] += m0 * y, part[3] += m0 * z;
            part[4] += m2, part[5] += m0 * y * y, part[6] += m0 * z * z;
            part[7] += m1 * y, part[8] += m0 * y * z, part[9] += m1 * z;
        }
        return part;
    });
    MassProperties body;
    if (sum[0] <= 0.0) return body;
    const double h = grid.spacing, h3 = h * h * h;
    const Eigen::Vector3d c(sum[1] / sum[0], sum[2] / sum[0], sum[3] / sum[0]);
    body.volume = sum[0] * h3;
    body.centroid = grid.origin + h * (middle + c);
    const double xx = sum[4] - sum[0] * c.x() * c.x(), yy = sum[5] - sum[0] * c.y() * c.y(), zz = sum[6] - sum[0] * c.z() * c.z();
    const double xy = sum[7] - sum[0] * c.x() * c.y(), yz = sum[8] - sum[0] * c.y() * c.z(), zx = sum[9] - sum[0] * c.z() * c.x();
    body.inertia << yy + zz, -xy, -zx, -xy, zz + xx, -yz, -zx, -yz, xx + yy;
    body.inertia *= h3 * h * h;
    return body;
}

double solid_volume(const DistanceGrid& grid, double shift)
{
    const double scale = 1.0 / grid.spacing;
    const double sum = parallel_sum(grid.node_count(), 1 << 16, 0.0, [&](std::size_t begin, std::size_t end) {
        double part = 0;
        for (std::size_t n = begin; n < end; ++n) {
            const double s = (grid.distance[n] + shift) * scale;
            if (s < support) part += s <= -support ? 1.0 : smoothed_solid(s);
        }
        return part;
    });
    return sum * grid.spacing * grid.spacing * grid.spacing;
}

}  // namespace coral::sdf
