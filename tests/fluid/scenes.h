#pragma once
/// Grids and motions that tests of resolved bodies share.
#include <numbers>
#include <span>

#include "fluid/immersed.h"

namespace coral::fluid::test {

constexpr double pi = std::numbers::pi;

/// n cells along each edge, all sides of one kind.
inline GridSpec cube(int n, double cell, BoundaryKind kind)
{
    GridSpec grid;
    grid.cells.setConstant(n);
    grid.cell = cell;
    for (Boundary& side : grid.boundary) side.kind = kind;
    return grid;
}

inline RigidMotion at(const Eigen::Vector3d& position, const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero())
{
    RigidMotion motion;
    motion.position = position;
    motion.velocity = velocity;
    return motion;
}

/// One step of a flow with bodies that keep their motions.
inline void coupled_step(Flow& flow, ImmersedBodies& bodies, std::span<const RigidMotion> motions, double dt)
{
    flow.predict(dt);
    bodies.measure(flow, dt, motions);
    bodies.apply(flow, motions);
    flow.project(dt);
}

}  // namespace coral::fluid::test
