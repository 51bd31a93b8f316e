#include "pack/sample.h"

#include <cmath>
#include <numbers>

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
