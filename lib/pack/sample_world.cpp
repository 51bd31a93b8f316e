#include "pack/sample_world.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "dem/superellipsoid.h"

namespace coral::pack {

std::shared_ptr<const dem::Shape> make_shape(const ShapeTemplate& shape)
{
    if (shape.kind == ShapeKind::sphere) return dem::Shape::sphere(0.5 * shape.equivalent_diameter);
    if (shape.kind == ShapeKind::polyhedron)
        return dem::Shape::polyhedron(shape.name, dem::Polyhedron(shape.vertices, shape.name), {shape.nodes, shape.node_areas});
    if (shape.kind == ShapeKind::superellipsoid)
        return dem::superellipsoid_shape({shape.radii, shape.exponents[0], shape.exponents[1]}, shape.grid, {shape.nodes, shape.node_areas}, shape.name);
    return dem::Shape::grid({shape.name, shape.grid, shape.nodes, shape.node_areas, shape.volume, shape.apparent_volume, shape.inertia, {}});
}

dem::WorldOptions world_options(const Sample& sample)
{
    dem::WorldOptions options;
    options.gravity = sample.gravity;
    options.period = sample.period;
    return options;
}

int add_wall(dem::World& world, const Wall& wall, int material)
{
    return wall.radius > 0 ? world.add_cylinder(wall.point.head<2>(), wall.radius, material) : world.add_plane(wall.point, wall.normal, material);
}

namespace {

/// Only the nearest image of a partner is looked at, so a grain must not touch another, or itself, on two sides.
void check_fits(const Sample& sample, double bounding_radius)
{
    for (const double length : sample.period)
        if (length > 0 && 4 * bounding_radius > length * (1 + 1e-9))
            throw Error("sample", "repeats itself after " + to_text(length) + " m, and a grain of bounding diameter " + to_text(2 * bounding_radius) + " m needs twice that size",
                        "take a wider sample or smaller shapes");
}

}  // namespace

SampleIds add_sample(dem::World& world, const Sample& sample, const std::vector<std::string>& with_walls)
{
    for (int axis = 0; axis < 3; ++axis)
        if (const double length = sample.period[axis], given = world.period()[axis]; length > 0 && std::abs(given - length) > 1e-9 * length)
            throw Error("sample", std::string("repeats itself along ") + "xyz"[axis] + " after " + to_text(length) + " m, and what it is put into " +
                                      (given > 0 ? "after " + to_text(given) + " m" : std::string("does not")),
                        "make that side periodic, and as wide as the sample");
    SampleIds ids;
    for (const ShapeTemplate& shape : sample.shapes) ids.shapes.push_back(world.add_shape(make_shape(shape)));
    for (const Material& material : sample.materials) ids.materials.push_back(world.add_material(material));
    for (const Particle& p : sample.particles) {
        dem::BodySpec body;
        body.shape = ids.shapes[std::size_t(p.shape)];
        body.material = ids.materials[std::size_t(p.material)];
        body.role = to_string(p.role);
        body.scale = p.scale;
        body.position = p.position;
        body.orientation = p.orientation;
        body.velocity = p.velocity;
        body.angular_velocity = p.angular_velocity;
        ids.bodies.push_back(world.add_body(body));
        check_fits(sample, world.bounding_radius(ids.bodies.back()));
    }
    for (const Wall& wall : sample.walls) {
        if (std::find(with_walls.begin(), with_walls.end(), wall.name) == with_walls.end()) {
            ids.walls.push_back(-1);
            continue;
        }
        Material material = sample.materials.front();
        material.name = "wall " + wall.name;
        material.friction = wall.friction;
        ids.walls.push_back(add_wall(world, wall, world.add_material(material)));
    }
    return ids;
}

void restore_springs(dem::World& world, const Sample& sample, const SampleIds& ids)
{
    std::vector<ContactSpring> springs;
    for (ContactSpring s : sample.springs) {
        const int wall = s.second < 0 ? ids.walls[std::size_t(-1 - s.second)] : 0;
        if (wall < 0) continue;
        s.first = ids.bodies[std::size_t(s.first)];
        s.second = s.second < 0 ? -1 - wall : ids.bodies[std::size_t(s.second)];
        springs.push_back(s);
    }
    world.set_contact_springs(springs);
}

}  // namespace coral::pack
