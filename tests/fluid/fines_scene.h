#pragma once
/// Fines in a flow, perhaps with grains: what tests of the exchange share.
#include <random>
#include <span>
#include <vector>

#include "fluid/fine_force.h"
#include "scenes.h"

namespace coral::fluid::test {

inline GridSpec box(Eigen::Vector3i cells, double cell, BoundaryKind kind)
{
    GridSpec grid;
    grid.cells = cells;
    grid.cell = cell;
    for (Boundary& side : grid.boundary) side.kind = kind;
    return grid;
}

struct Fines {
    std::vector<Eigen::Vector3d> positions, velocities, forces, lag;
    std::vector<double> diameters, volumes, coefficients;
    std::vector<FeltFlow> felt;

    void add(const Eigen::Vector3d& position, double diameter, const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero())
    {
        positions.push_back(position);
        velocities.push_back(velocity);
        diameters.push_back(diameter);
        volumes.push_back(pi / 6 * diameter * diameter * diameter);
    }
    std::size_t size() const { return positions.size(); }
    double solid_volume() const
    {
        double sum = 0.0;
        for (const double v : volumes) sum += v;
        return sum;
    }
    /// One flow step; velocities stay.
    void step(Flow& flow, FineCoupling& coupling, double dt, ImmersedBodies* bodies = nullptr,
              std::span<const RigidMotion> motions = {})
    {
        felt.resize(size()), forces.resize(size()), lag.resize(size()), coefficients.resize(size());
        coupling.place(positions, diameters, bodies ? &bodies->cell_solid_fraction() : nullptr);
        coupling.deposit_volume(flow, volumes, velocities);
        coupling.feel(flow, felt);
        const FlowOptions& o = flow.options();
        for (std::size_t i = 0; i < size(); ++i) {
            const FineForce f = fine_force(DragLaw::gidaspow, {velocities[i], diameters[i], volumes[i], {}}, felt[i],
                                           o.density, o.kinematic_viscosity);
            coefficients[i] = f.coefficient;
            forces[i] = f.force;
        }
        coupling.deposit_drag(flow, coefficients, forces);
        flow.predict(dt);
        coupling.drag_lag(flow, coefficients, lag);
        if (bodies) {
            bodies->measure(flow, dt, motions);
            bodies->apply(flow, motions);
        }
        flow.project(dt);
        for (std::size_t i = 0; i < size(); ++i) positions[i] += dt * velocities[i];
    }
};

inline Fines random_fines(const GridSpec& grid, int count, double low, double high, double speed, unsigned seed)
{
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const auto unit = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
    Fines fines;
    for (int i = 0; i < count; ++i)
        fines.add(grid.origin + unit().cwiseProduct(grid.size()), low + (high - low) * uniform(random),
                  speed * (2.0 * unit() - Eigen::Vector3d::Ones()));
    return fines;
}

}  // namespace coral::fluid::test
