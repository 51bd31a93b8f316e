#pragma once
/// \file dem/superellipsoid.h
/// Superellipsoids: mass properties in closed form, true distances on a lattice.
///     ((|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1)) = 1      [Barr 1981]
/// e1 shapes the outline along z, e2 that across; 1, 1 is an ellipsoid, towards 0 edges sharpen into a box or a cylinder, 2, 2 is an
/// octahedron. Up to 2 the body is convex.
#include <Eigen/Core>
#include <memory>
#include <string>

#include "dem/shape.h"
#include "sdf/distance_grid.h"

namespace coral::dem {

struct Superellipsoid {
    Eigen::Vector3d radii = Eigen::Vector3d::Ones();  ///< a, b, c [m]
    double e1 = 1, e2 = 1;
};

/// \param name  for messages
/// \throws Error  a radius or an exponent that is not positive, an exponent above 2
void check(const Superellipsoid& body, const std::string& name);

/// Homogeneous of degree 1, equal to 1 on the surface; below 1 inside. The gradient points along the normal.
double gauge(const Superellipsoid& body, const Eigen::Vector3d& point, Eigen::Vector3d& gradient);

/// V = 2 a b c e1 e2 B(e1/2 + 1, e1) B(e2/2, e2/2), B the beta function [Jaklic, Leonardis and Solina 2000] [m3]
double volume(const Superellipsoid& body);
/// About the centre at density 1 kg/m3, diagonal [ibid.]; for z: a b c e1 e2/2 (a^2 + b^2) B(3 e2/2, e2/2) B(e1/2, 2 e1 + 1) [m5]
Eigen::Matrix3d inertia(const Superellipsoid& body);

/// True distances on nodes `spacing` apart: nearest of a dense set of surface points, then steps along the surface, as harmonics.
/// \param outside  the box holds every point this near to the surface [m]
sdf::DistanceGrid tabulate(const Superellipsoid& body, double spacing, double outside);

/// Shape for contact: distances on a lattice of 1/60 of the equivalent diameter unless said, nodes on the surface itself.
/// \param reach  largest distance outside that is asked: the radius of the largest sphere [m]
/// \throws Error  as check()
std::shared_ptr<const Shape> superellipsoid_shape(const Superellipsoid& body, double reach, std::string name = "superellipsoid", int nodes = 2500,
                                                  double spacing = 0);

/// The same from a lattice and nodes that were made before.
std::shared_ptr<const Shape> superellipsoid_shape(const Superellipsoid& body, std::shared_ptr<const sdf::DistanceGrid> distance, SurfaceNodes nodes,
                                                  std::string name);

}  // namespace coral::dem
