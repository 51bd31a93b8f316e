#include "pack/detail/box.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/text.h"
#include "core/units.h"

namespace coral::pack::detail {
namespace {

constexpr std::array names{"x-", "x+", "y-", "y+", "z-", "z+"};

}  // namespace

Box::Box(const Sample& sample, const std::vector<int>& walls) : low(Eigen::Vector3d::Zero()), high(sample.size)
{
    high.z() = std::numeric_limits<double>::infinity();
    for (std::size_t w = 0; w < sample.walls.size(); ++w) {
        if (sample.walls[w].radius > 0) side = walls[w], radius = sample.walls[w].radius;
        for (std::size_t i = 0; i < names.size(); ++i)
            if (sample.walls[w].name == names[i]) plane[i] = walls[w];
    }
}

Eigen::Vector3d Box::lower(const dem::World& world) const
{
    Eigen::Vector3d corner = low;
    for (int axis = 0; axis < 3; ++axis)
        if (const int wall = plane[2 * std::size_t(axis)]; wall >= 0) corner[axis] = world.wall_point(wall)[axis];
    return corner;
}

Eigen::Vector3d Box::upper(const dem::World& world) const
{
    Eigen::Vector3d corner = high;
    for (int axis = 0; axis < 3; ++axis)
        if (const int wall = plane[2 * std::size_t(axis) + 1]; wall >= 0) corner[axis] = world.wall_point(wall)[axis];
    return corner;
}

double Box::area(const dem::World& world, int axis) const { return volume(world) / (upper(world) - lower(world))[axis]; }

double Box::volume(const dem::World& world) const
{
    const Eigen::Vector3d size = upper(world) - lower(world);
    return side >= 0 ? std::numbers::pi * radius * radius * size.z() : size.prod();
}

double Box::pressure(const dem::World& world, int i) const
{
    const int wall = plane[std::size_t(i)];
    const Eigen::Vector3d size = upper(world) - lower(world);
    return -world.wall_force(wall).dot(world.wall_normal(wall)) * size[i / 2] / volume(world);
}

// All around, forces on the wall add up to nothing: their sizes count.
double Box::side_pressure(const dem::World& world) const
{
    double force = 0;
    for (const dem::Contact& c : world.contacts())
        if (c.second == -1 - side) force += c.normal_force.norm();
    return force / (2 * std::numbers::pi * radius * (upper(world) - lower(world)).z());
}

std::array<int, 6> Box::contacts(const dem::World& world) const
{
    std::array<int, 6> count{};
    for (const dem::Contact& c : world.contacts())
        for (std::size_t i = 0; c.second < 0 && i < plane.size(); ++i) count[i] += plane[i] == -1 - c.second;
    return count;
}

void Box::check_inside(const dem::World& world, int body, int grain, const char* phase, const char* help) const
{
    const Eigen::Vector3d x = world.position(body), lowest = lower(world), highest = upper(world);
    const auto refuse = [&](const std::string& wall) {
        const auto mm = [](double value) { return format_quantity(value, Dimension::length); };
        throw Error(phase, "grain " + std::to_string(grain) + " (" + world.role(body) + ", " + mm(2 * world.equivalent_radius(body)) + ") left the box through the wall " + wall +
                               " at " + to_text(std::round(1e6 * world.time()) / 1e6) + " s: its centre is at (" + mm(x.x()) + ", " + mm(x.y()) + ", " + mm(x.z()) + ")",
                    help);
    };
    for (std::size_t i = 0; i < plane.size(); ++i) {
        const int axis = int(i) / 2;
        if (plane[i] >= 0 && !(i % 2 == 0 ? x[axis] >= lowest[axis] : x[axis] <= highest[axis])) refuse(names[i]);
    }
    if (side >= 0 && !((x - world.wall_point(side)).head<2>().norm() <= radius)) refuse("side");
}

std::vector<Wall> walls_around(const Spec& spec, double height)
{
    std::vector<Wall> walls;
    for (int axis = 0; axis < 2; ++axis) {
        if (spec.cylinder || spec.period[axis] > 0) continue;
        const Eigen::Vector3d inward = Eigen::Vector3d::Unit(axis);
        walls.push_back({names[2 * std::size_t(axis)], Eigen::Vector3d::Zero(), inward});
        walls.push_back({names[2 * std::size_t(axis) + 1], spec.size, -inward});
        walls.back().point.z() = std::isfinite(height) ? height : 0;
    }
    const double radius = 0.5 * spec.size.x();
    if (spec.cylinder) walls.push_back({"side", {radius, radius, 0}, Eigen::Vector3d::UnitZ(), 0, 0, radius});
    walls.push_back({"z-", Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ()});
    if (std::isfinite(height)) walls.push_back({"z+", {spec.size.x(), spec.size.y(), height}, -Eigen::Vector3d::UnitZ()});
    return walls;
}

}  // namespace coral::pack::detail
