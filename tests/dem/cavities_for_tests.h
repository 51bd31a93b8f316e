#pragma once
/// Cavities with walls known exactly, carved into a block: grooves, bores and voids for spheres to be in.
#include "dem/shapes_for_tests.h"

namespace coral::dem::testing {

/// A block with a cavity of the given distance, for a fixed body. It has no use in contact of nodes.
inline std::shared_ptr<const Shape> carved(const Distance& cavity, double half, double spacing)
{
    GridShapeData d;
    d.name = "block";
    d.distance = tabulate(cavity, Vec3::Constant(half), spacing);
    d.nodes = {Vec3(half, 0, 0), Vec3(0, half, 0), Vec3(0, 0, half)};
    d.node_areas = {1e-6, 1e-6, 1e-6};
    d.volume = 1e-6;
    d.inertia = 1e-12 * Eigen::Matrix3d::Identity();
    return Shape::grid(std::move(d));
}

/// World with the block as fixed body 0; shape 1 is a sphere of which a body's scale is the diameter.
inline World cavity_world(const std::shared_ptr<const Shape>& shape, SphereScheme scheme, const Vec3& gravity = Vec3::Zero(), double damping = 0, double friction = 0)
{
    WorldOptions o;
    o.gravity = gravity;
    o.sphere_scheme = scheme;
    o.skin = 0.25e-3;  // as in a sample of 2 mm grains
    World world(o);
    world.add_material({"default", 2780.0, 2e5, 1e5, friction, damping});
    BodySpec body;
    body.shape = world.add_shape(shape);
    body.motion = Motion::fixed;
    world.add_body(body);
    world.add_shape(Shape::sphere());
    return world;
}

inline double to_segment(const Vec3& p, const Vec3& a, const Vec3& b)
{
    const Vec3 ab = b - a;
    return (p - a - std::clamp(ab.dot(p - a) / ab.squaredNorm(), 0.0, 1.0) * ab).norm();
}

/// Between two half spaces that meet at 60 degrees in the y axis of a frame that is moved and turned; it opens towards the frame's z.
inline Distance groove(const Vec3& shift, const Quat& turn)
{
    const double half = std::numbers::pi / 6;
    const Vec3 left(std::cos(half), 0, std::sin(half)), right(-std::cos(half), 0, std::sin(half));
    return [=](const Vec3& p) {
        const Vec3 q = turn.conjugate() * (p - shift);
        return std::min(left.dot(q), right.dot(q));
    };
}

/// Three blind bores of 2.3 mm that meet.
inline double three_bores(const Vec3& p)
{
    double d = -1;
    for (const Vec3& end : {Vec3(2e-3, 0.4e-3, 0.3e-3), Vec3(-0.9e-3, 1.8e-3, 0.2e-3), Vec3(-0.7e-3, -0.9e-3, -1.6e-3)})
        d = std::max(d, 1.15e-3 - to_segment(p, Vec3(0.2e-3, -0.1e-3, 0.15e-3), end));
    return d;
}

/// Plate from -thickness/2 to thickness/2 about a centre, with a bore of radius rho; `axis` is the normal of the plate.
inline Distance bored_plate(const Vec3& centre, const Vec3& axis, double rho, double thickness)
{
    return [=](const Vec3& p) {
        const double along = axis.dot(p - centre), across = (p - centre - along * axis).norm();
        const double a = rho - across, b = std::abs(along) - 0.5 * thickness;
        return a <= 0 && b <= 0 ? std::max(a, b) : std::hypot(std::max(a, 0.0), std::max(b, 0.0));
    };
}

}  // namespace coral::dem::testing
