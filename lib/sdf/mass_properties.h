#pragma once
/// \file sdf/mass_properties.h
/// Volume, centroid and inertia of the solid of a distance grid.
#include <Eigen/Core>

#include "sdf/distance_grid.h"

namespace coral::sdf {

struct MassProperties {
    double volume = 0.0;                                 ///< [m^3]
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< [m]
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();   ///< about the centroid at unit density [m^5]
};

/// Sums over the nodes weighted by smoothed_solid(d/h) h^3.
/// \pre every node within one spacing of the surface holds its distance (any band of 2 nodes does)
MassProperties mass_properties(const DistanceGrid& grid);

/// Volume alone, of the surface d + shift = 0 [m^3].
double solid_volume(const DistanceGrid& grid, double shift = 0.0);

/// Smoothed Heaviside: share of solid at distance s (in spacings, negative in solid), 1 for s <= -1, 0 for s >= 1:
///     H(s) = (1 - s - (pi/6) sin(pi s))/2
/// The usual cosine Heaviside has 1/pi for pi/6 and errs by +0.4 (h/R)^2 on a sphere. With pi/6 the kernel's second moment
/// vanishes, so that curvature leaves no bias, and sums over the lattice stay exact for planes along it.
double smoothed_solid(double s);

}  // namespace coral::sdf
