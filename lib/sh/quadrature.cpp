#include "sh/quadrature.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "sh/basis.h"

namespace coral::sh {

void gauss_legendre(int n, std::vector<double>& nodes, std::vector<double>& weights)
{
    nodes.assign(std::size_t(n), 0.0);
    weights.assign(std::size_t(n), 0.0);
    for (int i = 0; i < (n + 1) / 2; ++i) {
        double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1.0;  // Tricomi's guess of the i-th root
        for (int step = 0; step < 100; ++step) {
            double p = 1.0, before = 0.0;
            for (int l = 1; l <= n; ++l) {
                const double next = ((2.0 * l - 1.0) * x * p - (l - 1.0) * before) / l;
                before = p;
                p = next;
            }
            slope = n * (x * p - before) / (x * x - 1.0);
            const double move = p / slope;
            x -= move;
            if (std::abs(move) < 1e-16) break;
        }
        nodes[std::size_t(n - 1 - i)] = x;
        nodes[std::size_t(i)] = -x;
        weights[std::size_t(i)] = weights[std::size_t(n - 1 - i)] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
}

SphereQuadrature sphere_quadrature(int polar, int azimuth)
{
    SphereQuadrature q{polar, azimuth, {}, {}};
    std::vector<double> z, w;
    gauss_legendre(polar, z, w);
    for (int i = polar - 1; i >= 0; --i) {
        const double s = std::sqrt(1.0 - z[std::size_t(i)] * z[std::size_t(i)]);
        for (int j = 0; j < azimuth; ++j) {
            const double phi = 2.0 * std::numbers::pi * (j + 0.5) / azimuth;
            q.directions.emplace_back(s * std::cos(phi), s * std::sin(phi), z[std::size_t(i)]);
            q.weights.push_back(w[std::size_t(i)] * 2.0 * std::numbers::pi / azimuth);
        }
    }
    return q;
}

SphereQuadrature oversampled_quadrature(int degree) { return sphere_quadrature(4 * (degree + 1), 8 * (degree + 1)); }

std::vector<double> analyse(const SphereQuadrature& quadrature, std::span<const double> values, int degree)
{
    assert(values.size() == quadrature.directions.size());
    const Basis basis(degree);
    const std::size_t count = std::size_t(coefficient_count(degree));
    std::vector<double> y(count), coefficients(count, 0.0);
    for (std::size_t i = 0; i < values.size(); ++i) {
        basis.evaluate(quadrature.directions[i], y);
        const double weighted = quadrature.weights[i] * values[i];
        for (std::size_t k = 0; k < count; ++k) coefficients[k] += weighted * y[k];
    }
    return coefficients;
}

std::vector<Eigen::Vector3d> spread_directions(int count)
{
    std::vector<Eigen::Vector3d> directions;
    for (int i = 0; i < count; ++i) {
        const double z = 1.0 - (2.0 * i + 1.0) / count, phi = i * std::numbers::pi * (3.0 - std::sqrt(5.0)), s = std::sqrt(1.0 - z * z);
        directions.emplace_back(s * std::cos(phi), s * std::sin(phi), z);
    }
    return directions;
}

int spread_count(int degree) { return std::max(12 * (degree + 1) * (degree + 1), 200); }

}  // namespace coral::sh
