#include "sh/tabulate.h"

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "sdf/detail/closest_point.h"
#include "sh/quadrature.h"

namespace coral::sh {
namespace {

using sdf::detail::FootPoint;
using sdf::detail::Lattice;

/// Surface points about one spacing apart, in units of the spacing: rings of equal latitude steps.
std::vector<FootPoint> surface_points(const Evaluator& evaluator, double largest_radius, double spacing)
{
    constexpr double density = 0.8;  // of a spacing between points on the largest sphere; less elsewhere
    const double pi = std::numbers::pi;
    const int rings = std::max(16, int(std::ceil(pi * largest_radius / (density * spacing))));
    std::vector<std::size_t> start{0};
    for (int i = 0; i < rings; ++i) start.push_back(start.back() + std::size_t(std::max(6.0, std::ceil(2 * rings * std::sin(pi * (i + 0.5) / rings)))));
    std::vector<FootPoint> feet(start.back());
    parallel_blocks(std::size_t(rings), 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t count = start[i + 1] - start[i];
            const double theta = pi * (double(i) + 0.5) / rings;
            for (std::size_t j = 0; j < count; ++j) {
                const double phi = 2 * pi * (double(j) + 0.5 * double(i % 2)) / double(count);
                const Eigen::Vector3d u(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
                Eigen::Vector3d normal;
                const Eigen::Vector3d p = evaluator.point(u, normal) / spacing;
                feet[start[i] + j] = {p.cast<float>(), normal.cast<float>()};
            }
        }
    });
    return feet;
}

/// Lattice through the frame's origin around the points, with room for the outside distance; in units of the spacing.
Lattice lattice_around(const std::vector<FootPoint>& feet, double reach)
{
    Eigen::Vector3f lower = feet.front().position, upper = lower;
    for (const FootPoint& foot : feet) lower = lower.cwiseMin(foot.position), upper = upper.cwiseMax(foot.position);
    Lattice lattice;
    lattice.origin = (lower.cast<double>().array() - reach - 1.0).floor();
    lattice.size = ((upper.cast<double>() - lattice.origin).array() + reach + 1.0).ceil().cast<int>() + 1;
    lattice.step = 1.0;
    return lattice;
}

}  // namespace

sdf::DistanceGrid tabulate(const Surface& surface, double spacing, double outside_distance, double inside_distance)
{
    if (!(spacing > 0)) throw Error("harmonic surface", "spacing must be positive");
    const BodyProperties body = body_properties(surface);
    if (!(body.smallest_radius > 0)) throw Error("harmonic surface", "its radius is not positive everywhere", "take another degree");
    const Evaluator evaluator(surface);
    const std::vector<FootPoint> feet = surface_points(evaluator, body.largest_radius, spacing);
    const Lattice lattice = lattice_around(feet, std::max(outside_distance / spacing, 2.0));

    sdf::DistanceGrid grid;
    grid.size = lattice.size;
    grid.origin = spacing * lattice.origin;
    grid.spacing = spacing;
    grid.distance.resize(grid.node_count());
    std::vector<std::uint8_t> solid(grid.node_count(), 0);
    const std::size_t nx = std::size_t(grid.size.x()), ny = std::size_t(grid.size.y());
    parallel_blocks(grid.node_count() / nx, 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t line = begin; line < end; ++line)
            for (std::size_t i = 0; i < nx; ++i) {
                const Eigen::Vector3d x = grid.node(int(i), int(line % ny), int(line / ny)), from_centre = x - surface.centre;
                const double r = from_centre.norm();
                if (r > 1.05 * body.largest_radius) continue;  // outside without asking the harmonics
                solid[line * nx + i] = r < 0.9 * body.smallest_radius || evaluator.radial_distance(x) < 0;
            }
    });
    const auto project = [&](Eigen::Vector3d& p, Eigen::Vector3d& normal) {
        const Eigen::Vector3d from_centre = p * spacing - surface.centre;
        if (from_centre.squaredNorm() == 0) return false;
        p = evaluator.point(from_centre.normalized(), normal) / spacing;
        return true;
    };
    const bool all = std::isinf(inside_distance);
    sdf::detail::fill_distances(lattice, feet, solid, {}, all ? 1e15 : inside_distance / spacing + 0.01, 1e15, 1.0, spacing, project, grid.distance);
    if (!all) {
        const float inside = float(inside_distance);
        for (float& d : grid.distance) d = std::max(d, -inside);
        grid.inside_limit = inside;
    }
    return grid;
}

}  // namespace coral::sh
