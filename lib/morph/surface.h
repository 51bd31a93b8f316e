#pragma once
/// \file morph/surface.h
/// Surface of a binary grain at voxel resolution, for areas, hulls and curvature. Independent of any level-set spacing.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "morph/voxel_stack.h"

namespace coral::morph {

/// Closed triangle mesh, counter-clockwise seen from outside the solid.
struct SurfaceMesh {
    std::vector<Eigen::Vector3d> vertices;                 ///< [m], frame of the mask: first voxel centre at voxel_size / 2
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

double surface_area(const SurfaceMesh& mesh);     ///< [m^2]
double enclosed_volume(const SurfaceMesh& mesh);  ///< by the divergence theorem [m^3]

/// Occupancy smoothed by a Gaussian; every axis has its own sigma.
/// \param values  [nz, ny, nx], replaced by the result; outside counts as zero
/// \param sigma   [voxels]; truncated at 4 sigma, weights sum to one
void smooth(std::vector<float>& values, const Eigen::Vector3i& size, const Eigen::Vector3d& sigma);

/// Surface where the occupancy, smoothed by `sigma` voxels, is one half. Marching over six tetrahedra per cell; crossings are
/// interpolated in -sigma * probit(occupancy), which is the signed distance at a plane, so the area of smooth bodies is
/// within 1 % (plain voxel faces: 50 % too large; marching cubes of the binary: 9 %).
SurfaceMesh extract_surface(const Mask& mask, double sigma = 0.7);

/// Vertex of a surface with its share of area and largest principal curvature.
struct CurvatureSample {
    double area = 0;               ///< [m^2]
    double largest_curvature = 0;  ///< positive on convex parts [1/m]
};

/// Curvature of the surface at the scale `scale` [m]: the occupancy is averaged to cells of at most scale / 1.5, smoothed by
/// a Gaussian of that sigma, and the curvature of its level surface taken from central differences [Goldman 2005].
/// \param scale  at least 1.5 voxels, else that is used
std::vector<CurvatureSample> surface_curvature(const Mask& mask, double scale);

/// Inverse of the standard normal distribution [Acklam's rational approximation, relative error 1.2e-9], 0 < p < 1.
double probit(double p);

}  // namespace coral::morph
