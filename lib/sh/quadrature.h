#pragma once
/// \file sh/quadrature.h
/// Gauss-Legendre in z times uniform azimuth: exact for harmonics up to degree 2 n_polar - 1 when n_azimuth > that degree.
#include <Eigen/Core>
#include <span>
#include <vector>

namespace coral::sh {

/// Directions and weights; weights sum to 4 pi. Direction i*azimuth + j: polar node i (z falling), azimuth 2 pi (j + 1/2)/azimuth.
struct SphereQuadrature {
    int polar = 0, azimuth = 0;
    std::vector<Eigen::Vector3d> directions;
    std::vector<double> weights;
};
SphereQuadrature sphere_quadrature(int polar, int azimuth);
/// 4(degree+1) x 8(degree+1) directions: surfaces are not band-limited, so radii are over-sampled four times.
SphereQuadrature oversampled_quadrature(int degree);

/// Directions spread evenly over the sphere by the golden angle, in order of falling z.
std::vector<Eigen::Vector3d> spread_directions(int count);
/// As many as show every bump of a surface of the degree: 12 (degree+1)^2, at least 200.
int spread_count(int degree);

/// Nodes (rising) and weights of n-point Gauss-Legendre on [-1, 1], to machine accuracy.
void gauss_legendre(int n, std::vector<double>& nodes, std::vector<double>& weights);

/// c_k = sum_i w_i f_i Y_k(u_i) up to a degree. values[i] belongs to directions[i].
std::vector<double> analyse(const SphereQuadrature& quadrature, std::span<const double> values, int degree);

}  // namespace coral::sh
