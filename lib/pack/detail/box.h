#pragma once
/// \file pack/detail/box.h
/// What encloses the grains of a packing: planes, a cylinder about z, or nothing where the sample repeats itself.
#include <array>
#include <vector>

#include "dem/world.h"
#include "pack/sample_world.h"
#include "pack/spec.h"

namespace coral::pack::detail {

/// Enclosure of the sample in a world. Planes are numbered x-, x+, y-, y+, z-, z+.
struct Box {
    std::array<int, 6> plane{-1, -1, -1, -1, -1, -1};  ///< walls of the world; -1 where there is none
    int side = -1;                                     ///< wall of the cylinder; -1: none
    double radius = 0;                                 ///< of it [m]
    Eigen::Vector3d low, high;                         ///< corners where there are no planes [m]; may be infinite

    /// \param walls  of the world, by wall of the sample (SampleIds::walls)
    Box(const Sample& sample, const std::vector<int>& walls);

    bool has_planes(int axis) const { return plane[2 * std::size_t(axis)] >= 0 && plane[2 * std::size_t(axis) + 1] >= 0; }
    Eigen::Vector3d lower(const dem::World& world) const;
    Eigen::Vector3d upper(const dem::World& world) const;
    /// Section across an axis [m2], and the space inside [m3].
    double area(const dem::World& world, int axis) const;
    double volume(const dem::World& world) const;
    /// Mean normal pressure of the bodies on plane i (0..5), or on the cylinder, over its height [Pa].
    double pressure(const dem::World& world, int i) const;
    double side_pressure(const dem::World& world) const;
    /// Touching grains per plane.
    std::array<int, 6> contacts(const dem::World& world) const;
    /// \throws Error  when the centre of a body is outside: which grain, where and when
    void check_inside(const dem::World& world, int body, int grain, const char* phase, const char* help) const;
};

/// Smooth walls of a specification from the origin up to `height`, which may be infinite: there is no lid then.
std::vector<Wall> walls_around(const Spec& spec, double height);

}  // namespace coral::pack::detail
