#pragma once
/// \file fluid/fine_force.h
/// Force of the flow on one particle smaller than a few cells, from what its kernel feels. Drag laws are measured with
/// the flow as it would be without the particle; the kernel feels the flow with it. The particle's own part is taken
/// out here, by the steady linear response of the fluid to what a particle spreads over its kernels, times S, the part
/// that neighbours do not make up for (isolation() in fluid/porous.h):
///  - its wake. A force F spread with the wide kernel moves the fluid of that kernel by F G(Re_R)/(rho nu R), R the
///    support radius, Re_R = slip R/nu, from the Oseen equations in wave numbers k:
///        G = R/(4 pi^2) int |w(k)|^2 2 ((1 + a^-2) atan(a)/a - a^-2) dk,  a = slip/(nu k)
///    [Evrard, Denner and van Wachem 2020, J. Comput. Phys. X 8:100078, in Stokes flow; Balachandar, Liu and Lakhote
///    2019, J. Comput. Phys. 376:160, at finite Re]. For the four-point kernel G = 0.08911/(1 + Re_R (0.258 - 0.03/
///    (1 + Re_R/8))) within 0.6 %.
///  - the flow back around the volume it pushes: a third of its own solid fraction, against its motion.
///  - the pressure it makes itself. The volume kernel sits on the particle and feels all of it (20 % of the weight of
///    a 2 mm grain sinking in water); the force therefore uses the mean over the wide kernel, less a third of the force
///    per volume that it spreads there, F int w^2 dV/(3 rho).
#include "fluid/drag.h"
#include "fluid/porous.h"

namespace coral::fluid {

/// One particle as the flow sees it.
struct FineParticle {
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
    double diameter = 0.0;                               ///< of the sphere of equal volume [m]
    double volume = 0.0;                                 ///< [m3]
    DragShape shape;
};

/// Force beyond -rho V felt.pressure_gradient, and its change with the felt velocity.
struct FineForce {
    double coefficient = 0.0;                         ///< dF/du [kg/s]
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< on the particle [N]
};

/// \param density [kg/m3], kinematic_viscosity [m2/s] of the fluid
/// \note Steady: a particle that has just begun to move is taken to have its wake already, and its drag is too large by
///       1/(1 - own part) until it has (about R^2/nu).
FineForce fine_force(DragLaw law, const FineParticle& particle, const FeltFlow& felt, double density,
                     double kinematic_viscosity);

/// G of the four-point kernel. \param reynolds of the support radius
double self_velocity_factor(double reynolds);

}  // namespace coral::fluid
