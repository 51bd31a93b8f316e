#include "pack/sample.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/units.h"

namespace coral::pack {

std::string_view to_string(ShapeKind kind)
{
    switch (kind) {
        case ShapeKind::level_set: return "level-set";
        case ShapeKind::sh: return "sh";
        case ShapeKind::polyhedron: return "polyhedron";
        case ShapeKind::superellipsoid: return "superellipsoid";
        default: return "sphere";
    }
}

std::string_view to_string(Role role) { return role == Role::fine ? "fine" : "coarse"; }

double volume(const Sample& sample, const Particle& particle)
{
    return sample.shapes[std::size_t(particle.shape)].volume * std::pow(particle.scale, 3);
}

double mass(const Sample& sample, const Particle& particle)
{
    return sample.materials[std::size_t(particle.material)].density * volume(sample, particle);
}

double apparent_volume(const Sample& sample, const Particle& particle)
{
    return sample.shapes[std::size_t(particle.shape)].apparent_volume * std::pow(particle.scale, 3);
}

double equivalent_diameter(const Sample& sample, const Particle& particle)
{
    return sample.shapes[std::size_t(particle.shape)].equivalent_diameter * particle.scale;
}

const Wall* cylinder(const Sample& sample)
{
    const auto found = std::find_if(sample.walls.begin(), sample.walls.end(), [](const Wall& wall) { return wall.radius > 0; });
    return found == sample.walls.end() ? nullptr : &*found;
}

double enclosed_volume(const Sample& sample)
{
    const Wall* side = cylinder(sample);
    return side ? std::numbers::pi * side->radius * side->radius * sample.size.z() : sample.size.prod();
}

Eigen::Vector3d nearest_image(const Sample& sample, Eigen::Vector3d difference)
{
    for (int axis = 0; axis < 3; ++axis)
        if (const double length = sample.period[axis]; length > 0) difference[axis] -= length * std::nearbyint(difference[axis] / length);
    return difference;
}

std::string describe_enclosure(const Sample& sample)
{
    const auto length = [](double metres) { return format_quantity(metres, Dimension::length); };
    if (const Wall* side = cylinder(sample)) return "a cylinder of " + length(2 * side->radius) + ", " + length(sample.size.z()) + " high";
    const bool x = sample.period.x() > 0, y = sample.period.y() > 0;
    return length(sample.size.x()) + " x " + length(sample.size.y()) + " x " + length(sample.size.z()) +
           (x && y ? ", periodic along x and y" : x ? ", periodic along x" : y ? ", periodic along y" : "");
}

void refuse_cylinder(const Sample& sample, const std::string& who)
{
    if (cylinder(sample)) throw Error("sample", "lies in a cylinder, and " + who + " takes boxes only", "pack it with [box] in place of [cylinder]");
}

ShapeTemplate unit_sphere()
{
    ShapeTemplate sphere;
    sphere.name = "sphere";
    sphere.volume = sphere.apparent_volume = std::numbers::pi / 6;
    sphere.equivalent_diameter = 1;
    sphere.inertia = 0.1 * sphere.volume * Eigen::Matrix3d::Identity();  // m d^2 / 10
    return sphere;
}

}  // namespace coral::pack
