#include "dem/superellipsoid.h"

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"
#include "sdf/detail/closest_point.h"
#include "sdf/surface_nodes.h"

namespace coral::dem {

using Eigen::Vector3d;
using sdf::detail::FootPoint;

namespace {

double beta(double x, double y) { return std::exp(std::lgamma(x) + std::lgamma(y) - std::lgamma(x + y)); }

/// (|u|^p + |v|^p)^(1/p) and its derivatives, without overflow for large p.
double norm_of_two(double u, double v, double p, double& by_u, double& by_v)
{
    const double large = std::max(std::abs(u), std::abs(v));
    by_u = by_v = 0.0;
    if (large == 0.0) return 0.0;
    const double norm = large * std::pow(1.0 + std::pow(std::min(std::abs(u), std::abs(v)) / large, p), 1.0 / p);
    if (u != 0.0) by_u = std::copysign(std::pow(std::abs(u) / norm, p - 1.0), u);
    if (v != 0.0) by_v = std::copysign(std::pow(std::abs(v) / norm, p - 1.0), v);
    return norm;
}

/// Surface points less than a spacing apart, in units of the spacing: rings of a sphere, stretched to the radii, then along the ray.
std::vector<FootPoint> surface_points(const Superellipsoid& body, double spacing)
{
    constexpr double density = 0.6;  // of a spacing between points of the stretched sphere
    const double pi = std::numbers::pi;
    const int rings = std::max(16, int(std::ceil(pi * body.radii.maxCoeff() / (density * spacing))));
    std::vector<FootPoint> feet;
    for (int i = 0; i < rings; ++i) {
        const double theta = pi * (i + 0.5) / rings;
        const int count = std::max(6, int(std::ceil(2 * rings * std::sin(theta))));
        for (int j = 0; j < count; ++j) {
            const double phi = 2 * pi * (j + 0.5 * (i % 2)) / count;
            const Vector3d p = body.radii.cwiseProduct(Vector3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
            Vector3d normal;
            const double g = gauge(body, p, normal);
            feet.push_back({(p / (g * spacing)).cast<float>(), normal.normalized().cast<float>()});
        }
    }
    return feet;
}

}  // namespace

void check(const Superellipsoid& body, const std::string& name)
{
    for (int axis = 0; axis < 3; ++axis)
        if (!(body.radii[axis] > 0.0) || !std::isfinite(body.radii[axis]))
            throw Error(name, "radius " + to_text(body.radii[axis]) + " m is not positive", "give three positive radii");
    for (const double e : {body.e1, body.e2})
        if (!(e > 0.0) || e > 2.0)
            throw Error(name, "exponent " + to_text(e) + " is not in (0, 2]", "0.1 is nearly a box, 1 an ellipsoid, 2 an octahedron; above 2 the body is hollowed");
}

double gauge(const Superellipsoid& body, const Vector3d& p, Vector3d& gradient)
{
    const Vector3d q = p.cwiseQuotient(body.radii);
    double by_x, by_y, by_flat, by_z;
    const double flat = norm_of_two(q.x(), q.y(), 2.0 / body.e2, by_x, by_y);
    const double value = norm_of_two(flat, q.z(), 2.0 / body.e1, by_flat, by_z);
    gradient = Vector3d(by_flat * by_x, by_flat * by_y, by_z).cwiseQuotient(body.radii);
    return value;
}

double volume(const Superellipsoid& body)
{
    return 2.0 * body.radii.prod() * body.e1 * body.e2 * beta(0.5 * body.e1 + 1.0, body.e1) * beta(0.5 * body.e2, 0.5 * body.e2);
}

Eigen::Matrix3d inertia(const Superellipsoid& body)
{
    const double half = 0.5 * body.radii.prod() * body.e1 * body.e2;
    // Second moments along the axes: (x, y) share one factor, z has its own.
    const double across = half * beta(1.5 * body.e2, 0.5 * body.e2) * beta(0.5 * body.e1, 2.0 * body.e1 + 1.0);
    const double along = 4.0 * half * beta(0.5 * body.e2, 0.5 * body.e2 + 1.0) * beta(1.5 * body.e1, body.e1 + 1.0);
    const Vector3d s = body.radii.cwiseAbs2().cwiseProduct(Vector3d(across, across, along));
    return Vector3d(s.y() + s.z(), s.x() + s.z(), s.x() + s.y()).asDiagonal().toDenseMatrix();
}

sdf::DistanceGrid tabulate(const Superellipsoid& body, double spacing, double outside)
{
    sdf::DistanceGrid grid;
    const Vector3d half = body.radii.array() + outside + 2.0 * spacing;
    grid.spacing = spacing;
    grid.size = (2.0 * half / spacing).array().ceil().cast<int>() + 1;
    grid.origin = -0.5 * spacing * (grid.size.array() - 1).cast<double>().matrix();
    grid.distance.resize(grid.node_count());
    std::vector<std::uint8_t> solid(grid.node_count(), 0);
    for (int k = 0; k < grid.size.z(); ++k)
        for (int j = 0; j < grid.size.y(); ++j)
            for (int i = 0; i < grid.size.x(); ++i) {
                Vector3d ignored;
                solid[grid.index(i, j, k)] = gauge(body, grid.node(i, j, k), ignored) < 1.0;
            }
    const auto project = [&](Vector3d& p, Vector3d& normal) {
        const double g = gauge(body, p, normal) * spacing;
        if (!(g > 0.0)) return false;
        p /= g;
        normal.normalize();
        return true;
    };
    const sdf::detail::Lattice lattice{grid.size, grid.origin / spacing, 1.0};
    sdf::detail::fill_distances(lattice, surface_points(body, spacing), solid, {}, 1e15, 1e15, 1.0, spacing, project, grid.distance);
    return grid;
}

std::shared_ptr<const Shape> superellipsoid_shape(const Superellipsoid& body, double reach, std::string name, int nodes, double spacing)
{
    check(body, name);
    const double diameter = std::cbrt(6.0 * volume(body) / std::numbers::pi);
    if (!(spacing > 0.0)) spacing = diameter / 60.0;
    auto distance = std::make_shared<const sdf::DistanceGrid>(tabulate(body, spacing, reach + 2.0 * spacing));
    sdf::SurfaceNodes surface = sdf::surface_nodes(*distance, nodes);
    Vector3d normal;
    for (Vector3d& p : surface.positions) p /= gauge(body, p, normal);
    return superellipsoid_shape(body, std::move(distance), {std::move(surface.positions), std::move(surface.areas)}, std::move(name));
}

std::shared_ptr<const Shape> superellipsoid_shape(const Superellipsoid& body, std::shared_ptr<const sdf::DistanceGrid> distance, SurfaceNodes nodes,
                                                  std::string name)
{
    check(body, name);
    GridShapeData data;
    data.name = std::move(name);
    data.distance = std::move(distance);
    data.nodes = std::move(nodes.positions);
    data.node_areas = std::move(nodes.areas);
    data.volume = volume(body);
    data.inertia = inertia(body);
    for (int k = 0; k < 27; ++k)
        if (k != 13) data.flat_sides.push_back(Vector3d(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1).cwiseQuotient(body.radii).normalized());
    return Shape::grid(std::move(data));
}

}  // namespace coral::dem
