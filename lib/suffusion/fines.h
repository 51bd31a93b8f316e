#pragma once
/// \file suffusion/fines.h
/// Semi-resolved and unresolved bodies in the flow: drag and pressure-gradient force on them, the same momentum taken from the fluid.
#include <Eigen/Core>
#include <map>
#include <vector>

#include "fluid/fine_force.h"
#include "suffusion/scene.h"
#include "suffusion/shapes.h"

namespace coral::suffusion {

class Fines {
public:
    /// Takes the bodies whose scheme is semi-resolved or unresolved. Both use the kernel; below 3/2 of a cell its smallest support
    /// (3 cells) makes it the smoothed form of the cell average.
    Fines(const Scene& scene, const fluid::GridSpec& grid);

    bool empty() const { return total_ == 0; }
    /// Porosity, felt flow and drag of the step; call before Flow::predict. \param cell_solid of the grains, or null
    void deposit(fluid::Flow& flow, double dt, const Scene& scene, const fluid::Field* cell_solid);
    /// After Flow::predict: completes the drag and gives all fluid forces to the world.
    void give_forces(const fluid::Flow& flow, double dt, Scene& scene);
    /// After the contact steps: what besides drag accelerated each body.
    void learn(double dt, const Scene& scene);

    /// Fluid force on each body over the last step, hydrostatic buoyancy left out [N]; zero for others. Indexed by body of the world.
    const std::vector<Eigen::Vector3d>& forces() const { return forces_; }
    Eigen::Vector3d drag_impulse() const { return drag_impulse_; }          ///< on the bodies, last step [N s]
    Eigen::Vector3d pressure_impulse() const { return pressure_impulse_; }  ///< on the bodies, last step [N s]
    double mean_felt_void_fraction() const { return mean_felt_; }
    /// Flow step in which fines move no farther than the coupling stands [s].
    double longest_step(const Scene& scene, double cell) const;

    const std::vector<Eigen::Vector3d>& other_acceleration() const { return other_; }
    void restore(std::vector<Eigen::Vector3d> forces, std::vector<Eigen::Vector3d> other) { forces_ = std::move(forces), other_ = std::move(other); }

private:
    void collect(const Scene& scene);
    /// Shape of a body as its drag law sees it along the slip; that of a sphere where the law does not ask.
    fluid::DragShape drag_shape(const Scene& scene, int id, const Eigen::Vector3d& slip) const;

    double density_, viscosity_;
    fluid::DragLaw law_;
    fluid::FineCoupling kernel_;
    std::map<int, Outline> outlines_;  ///< by shape of the world; empty where the drag law knows spheres only
    std::size_t total_ = 0;
    std::vector<int> all_, ids_;  ///< bodies of this kind; those that are in
    std::vector<Eigen::Vector3d> positions_, velocities_, drag_, lag_;
    std::vector<double> diameters_, volumes_, coefficients_;
    std::vector<fluid::FeltFlow> felt_;
    std::vector<Eigen::Vector3d> forces_, other_;  ///< by body of the world
    Eigen::Vector3d drag_impulse_ = Eigen::Vector3d::Zero(), pressure_impulse_ = Eigen::Vector3d::Zero();
    double mean_felt_ = 1;
};

}  // namespace coral::suffusion
