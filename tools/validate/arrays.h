#pragma once
/// \file tools/validate/arrays.h
/// Stokes flow through spheres fixed in a periodic cube of unit edge, density and viscosity, driven along x at a mean velocity of about one.
#include <vector>

#include "fluid/immersed.h"

namespace coral::validate {

enum class Lattice { simple, body_centred, face_centred };

/// Diameter of the spheres, in edges of the cubic cell.
double array_diameter(Lattice lattice, double solid_fraction);

class ArrayFlow {
public:
    /// \param centres, diameter  in edges of the cube
    ArrayFlow(const std::vector<Eigen::Vector3d>& centres, double diameter, int cells, const fluid::ForcingOptions& forcing = {});

    /// Steps until the drag factor stands still; returns it.
    /// \param tolerance  relative change over a quarter of the slowest mode's time
    /// \param part_of_stable  of the stable time step
    double settle(double tolerance, double part_of_stable = 1);
    /// K = F/(6 pi mu a U), F the mean over the spheres, pressure gradient included.
    double drag_factor() const;
    fluid::Flow& flow() { return flow_; }
    const fluid::Flow& flow() const { return flow_; }

private:
    void step(double part_of_stable);

    fluid::Flow flow_;
    fluid::ImmersedBodies bodies_;
    std::vector<fluid::RigidMotion> motions_;
    double diameter_, force_ = 0;
};

}  // namespace coral::validate
