#pragma once
/// Grid shapes made from exact distances, so that contact is tested apart from voxels and files.
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <string>

#include "dem/shape.h"
#include "dem/world.h"

namespace coral::dem::testing {

using Vec3 = Eigen::Vector3d;
using Quat = Eigen::Quaterniond;
using Distance = std::function<double(const Vec3&)>;

inline std::shared_ptr<const sdf::DistanceGrid> tabulate(const Distance& distance, const Vec3& half, double spacing)
{
    auto grid = std::make_shared<sdf::DistanceGrid>();
    grid->spacing = spacing;
    // Off the lattice symmetry on purpose: real grids have no node at the centre of mass.
    const Eigen::Vector3i cells = (2.0 * half / spacing).array().ceil().cast<int>() + 1;
    grid->origin = -half - 0.37 * spacing * Vec3::Ones();
    grid->size = cells.array() + 1;
    grid->distance.resize(grid->node_count());
    for (int k = 0; k < grid->size.z(); ++k)
        for (int j = 0; j < grid->size.y(); ++j)
            for (int i = 0; i < grid->size.x(); ++i) grid->distance[grid->index(i, j, k)] = float(distance(grid->node(i, j, k)));
    return grid;
}

/// n directions spread evenly over the sphere (spiral); each stands for 4 pi/n.
inline std::vector<Vec3> directions(int n)
{
    std::vector<Vec3> list;
    for (int i = 0; i < n; ++i) {
        const double z = 1.0 - (2.0 * i + 1.0) / n, r = std::sqrt(1.0 - z * z), phi = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
        list.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
    }
    return list;
}

/// Ball as a grid shape.
inline std::shared_ptr<const Shape> grid_ball(double radius, double spacing, int nodes, double reach)
{
    GridShapeData d;
    d.name = "ball";
    d.distance = tabulate([&](const Vec3& p) { return p.norm() - radius; }, Vec3::Constant(radius + reach), spacing);
    for (const Vec3& u : directions(nodes)) {
        d.nodes.push_back(radius * u);
        d.node_areas.push_back(4.0 * std::numbers::pi * radius * radius / nodes);
    }
    d.volume = 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3);
    d.inertia = 0.4 * d.volume * radius * radius * Eigen::Matrix3d::Identity();
    return Shape::grid(std::move(d));
}

/// Shell with a closed void; nodes on both surfaces.
inline std::shared_ptr<const Shape> hollow_ball(double outer, double inner, double spacing, int nodes, double reach)
{
    GridShapeData d;
    d.name = "shell";
    d.distance = tabulate([&](const Vec3& p) { return std::max(p.norm() - outer, inner - p.norm()); }, Vec3::Constant(outer + reach), spacing);
    for (const double radius : {outer, inner}) {
        const int n = int(nodes * radius * radius / (outer * outer + inner * inner));
        for (const Vec3& u : directions(n)) {
            d.nodes.push_back(radius * u);
            d.node_areas.push_back(4.0 * std::numbers::pi * radius * radius / n);
        }
    }
    const double c = 4.0 / 3.0 * std::numbers::pi;
    d.volume = c * (std::pow(outer, 3) - std::pow(inner, 3));
    d.apparent_volume = c * std::pow(outer, 3);
    d.inertia = 0.4 * c * (std::pow(outer, 5) - std::pow(inner, 5)) * Eigen::Matrix3d::Identity();
    return Shape::grid(std::move(d));
}

/// Distance to an ellipsoid by the Lagrange multiplier of the closest point, found by bisection.
inline double ellipsoid_distance(const Vec3& p, const Vec3& a)
{
    const Vec3 q = p.cwiseAbs().cwiseMax(1e-12);
    const Vec3 a2 = a.cwiseProduct(a);
    double low = -a2.minCoeff(), high = q.norm() * a.maxCoeff();
    const auto excess = [&](double t) { return (a.cwiseProduct(q).array() / (a2.array() + t)).square().sum() - 1.0; };
    for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        (excess(middle) > 0.0 ? low : high) = middle;
    }
    const Vec3 foot = a2.array() * q.array() / (a2.array() + 0.5 * (low + high));
    const double inside = (q.array() / a.array()).square().sum();
    return (q - foot).norm() * (inside < 1.0 ? -1.0 : 1.0);
}

/// Ellipsoid with semi-axes a as a grid shape.
inline std::shared_ptr<const Shape> grid_ellipsoid(const Vec3& a, double spacing, int nodes, double reach)
{
    GridShapeData d;
    d.name = "ellipsoid";
    d.distance = tabulate([&](const Vec3& p) { return ellipsoid_distance(p, a); }, a.array() + reach, spacing);
    for (const Vec3& u : directions(nodes)) {
        d.nodes.push_back(a.cwiseProduct(u));
        d.node_areas.push_back(4.0 * std::numbers::pi / nodes * a.prod() * u.cwiseQuotient(a).norm());
    }
    d.volume = 4.0 / 3.0 * std::numbers::pi * a.prod();
    const Vec3 s = a.cwiseProduct(a);
    d.inertia = d.volume / 5.0 * Vec3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y()).asDiagonal().toDenseMatrix();
    return Shape::grid(std::move(d));
}

/// Box with half edges a; nodes on a lattice of about `step` on its faces.
inline std::shared_ptr<const Shape> grid_block(const Vec3& a, double step)
{
    GridShapeData d;
    d.name = "block";
    d.distance = tabulate(
        [&](const Vec3& p) {
            const Vec3 q = p.cwiseAbs() - a;
            return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
        },
        a.array() + 0.5e-3, step);
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3, nu = int(std::round(2 * a[u] / step)), nv = int(std::round(2 * a[v] / step));
        for (const double side : {-1.0, 1.0})
            for (int i = 0; i < nu; ++i)
                for (int j = 0; j < nv; ++j) {
                    Vec3 p;
                    p[axis] = side * a[axis];
                    p[u] = a[u] * ((2 * i + 1.0) / nu - 1.0);
                    p[v] = a[v] * ((2 * j + 1.0) / nv - 1.0);
                    d.nodes.push_back(p);
                    d.node_areas.push_back(4.0 * a[u] * a[v] / (nu * nv));
                }
    }
    d.volume = 8.0 * a.prod();
    const Vec3 s = a.cwiseProduct(a);
    d.inertia = d.volume / 3.0 * Vec3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y()).asDiagonal().toDenseMatrix();
    return Shape::grid(std::move(d));
}

/// World without gravity, with the material of Table 2 and given damping and friction.
inline World quiet_world(double damping, double friction, const Vec3& gravity = Vec3::Zero())
{
    WorldOptions o;
    o.gravity = gravity;
    World world(o);
    world.add_material({"default", 2780.0, 2e5, 1e5, friction, damping});
    return world;
}

inline int add_sphere(World& world, int shape, double diameter, const Vec3& position, const Vec3& velocity = Vec3::Zero(),
                      Motion motion = Motion::free)
{
    BodySpec b;
    b.shape = shape;
    b.scale = diameter;
    b.position = position;
    b.velocity = velocity;
    b.motion = motion;
    return world.add_body(b);
}

inline Vec3 momentum(const World& world)
{
    Vec3 p = Vec3::Zero();
    for (int i = 0; i < world.body_count(); ++i) p += world.mass(i) * world.velocity(i);
    return p;
}

inline Vec3 angular_momentum(const World& world)
{
    Vec3 l = Vec3::Zero();
    for (int i = 0; i < world.body_count(); ++i)
        l += world.mass(i) * world.position(i).cross(world.velocity(i)) + world.inertia(i) * world.angular_velocity(i);
    return l;
}

}  // namespace coral::dem::testing
