#pragma once
/// Bodies for the harmonic tests.
#include <numbers>
#include <random>

#include "sdf/distance_grid.h"
#include "sh/quadrature.h"
#include "sh/surface.h"

namespace coral::sh::test {

/// Lumpy surface of mean radius 1: random coefficients falling with the degree.
inline Surface lump(int degree, double roughness, unsigned seed)
{
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    Surface surface;
    surface.degree = degree;
    surface.coefficients.assign(std::size_t(coefficient_count(degree)), 0.0);
    surface.coefficients[0] = std::sqrt(4 * std::numbers::pi);
    for (int l = 2; l <= degree; ++l)
        for (int m = -l; m <= l; ++m) surface.coefficients[std::size_t(coefficient_index(l, m))] = roughness * normal(random) / std::pow(l, 1.5);
    return surface;
}

/// Ellipsoid with semi-axes 1.3, 1, 0.8, analysed to a degree that holds its radii to 1e-8.
inline Surface ellipsoid()
{
    const int degree = 30;
    const SphereQuadrature q = oversampled_quadrature(degree);
    std::vector<double> radii;
    for (const auto& u : q.directions) radii.push_back(1 / std::sqrt(std::pow(u.x() / 1.3, 2) + std::pow(u.y(), 2) + std::pow(u.z() / 0.8, 2)));
    Surface surface;
    surface.degree = degree;
    surface.coefficients = analyse(q, radii, degree);
    return surface;
}

/// Distance to the line of points p(s), minus a radius: a tube.
template <class Line>
sdf::DistanceGrid tube(const Line& line, double radius, double half, double h)
{
    const int n = 2 * int(std::ceil(half / h)) + 1;
    sdf::DistanceGrid grid;
    grid.size = Eigen::Vector3i::Constant(n);
    grid.origin = Eigen::Vector3d::Constant(-0.5 * (n - 1) * h);
    grid.spacing = h;
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                double nearest = 1e9;
                for (int s = 0; s <= 100; ++s) nearest = std::min(nearest, (grid.node(i, j, k) - line(s / 100.0)).squaredNorm());
                grid.distance.push_back(float(std::sqrt(nearest) - radius));
            }
    return grid;
}

}  // namespace coral::sh::test
