#pragma once
/// \file suffusion/grains.h
/// Resolved grains and the filter plate in the flow: poses and velocities from the contact world, forces back to it.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "fluid/immersed.h"
#include "suffusion/scene.h"

namespace coral::suffusion {

class Grains {
public:
    /// Takes the bodies of the scene whose scheme is resolved, and the plate when there is one.
    Grains(const Scene& scene, const fluid::GridSpec& grid);

    /// Finds the cut faces at the bodies' poses now.
    void place(const Scene& scene);
    /// Hydrodynamic forces from the provisional velocity, given to the world with buoyancy and the inertia of the forced fluid.
    void measure(fluid::Flow& flow, double dt, Scene& scene);
    /// Forces the provisional velocity to the new motion; returns the impulse that bodies and plate gave the fluid [N s], counted on their
    /// side:  sum_b M_w dU - dt F_h and what is in transit      [docs/numerics.md, eq. 7 and 10]
    Eigen::Vector3d apply(fluid::Flow& flow, double dt, const Scene& scene);

    /// Force on each resolved body over the last step, hydrostatic buoyancy left out [N]; zero for others. Indexed by body of the world.
    const std::vector<Eigen::Vector3d>& forces() const { return forces_; }
    const std::vector<Eigen::Vector3d>& torques() const { return torques_; }
    const fluid::ImmersedBodies& immersed() const { return immersed_; }
    fluid::ImmersedBodies& immersed() { return immersed_; }
    std::size_t size() const { return bodies_.size(); }
    bool empty() const { return immersed_.size() == 0; }
    /// Greatest speed of a point of a resolved body [m/s].
    double max_speed(const Scene& scene) const;

    /// For a checkpoint: changes of velocity, impulses in transit, forces, torques.
    std::array<std::vector<Eigen::Vector3d>, 4> state() const { return {change_, carried_, forces_, torques_}; }
    void restore(std::array<std::vector<Eigen::Vector3d>, 4> state);

private:
    static fluid::RigidMotion motion_of(const Scene& scene, int body);
    void collect_motions(const Scene& scene);

    double density_;
    fluid::ImmersedBodies immersed_;
    std::vector<int> bodies_;  ///< world ids; the plate follows them in immersed_
    std::vector<fluid::RigidMotion> motions_;
    fluid::RigidMotion plate_;
    std::vector<fluid::FluidAction> actions_;
    std::vector<double> virtual_mass_;     ///< c_v m_f of light grains [kg]
    std::vector<Eigen::Vector3d> before_;  ///< velocities at the start of the step
    std::vector<Eigen::Vector3d> change_;  ///< of the velocity over the last step
    std::vector<Eigen::Vector3d> carried_; ///< impulse that the fluid gave up and the body gets in the next step [N s]
    std::vector<Eigen::Vector3d> forces_, torques_;
};

}  // namespace coral::suffusion
