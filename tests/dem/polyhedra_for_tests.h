#pragma once
/// Polyhedra that tests know: regular ones, and stones with a given number of faces.
#include <cmath>
#include <vector>

#include "dem/polyhedron.h"
#include "dem/shapes_for_tests.h"

namespace coral::dem::testing {

/// Box of the given edges.
inline Polyhedron box(const Vec3& edges)
{
    std::vector<Vec3> points;
    for (int k = 0; k < 8; ++k) points.push_back(0.5 * edges.cwiseProduct(Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
    return Polyhedron(points);
}
inline Polyhedron cube(double edge) { return box(Vec3::Constant(edge)); }

inline Polyhedron tetrahedron(double edge)
{
    const double s = edge / std::sqrt(8.0);
    return Polyhedron(std::vector<Vec3>{{s, s, s}, {s, -s, -s}, {-s, s, -s}, {-s, -s, s}});
}

inline Polyhedron octahedron(double edge)
{
    const double s = edge / std::sqrt(2.0);
    return Polyhedron(std::vector<Vec3>{{s, 0, 0}, {-s, 0, 0}, {0, s, 0}, {0, -s, 0}, {0, 0, s}, {0, 0, -s}});
}

/// Stone of about 2 mm with `faces` triangles: random points on an ellipsoid (a hull of n points in general position has 2n - 4 faces).
inline Polyhedron stone(int faces, unsigned seed)
{
    std::mt19937_64 random(seed);
    std::normal_distribution<double> n;
    std::vector<Vec3> points;
    for (int k = 0; k < faces / 2 + 2; ++k) {
        const double x = n(random), y = n(random), z = n(random);
        points.push_back(Vec3(x, y, z).normalized().cwiseProduct(Vec3(1.2e-3, 1e-3, 0.8e-3)));
    }
    return Polyhedron(points);
}

inline std::shared_ptr<const Shape> polyhedron_shape(Polyhedron body, int nodes = Shape::default_polyhedron_nodes)
{
    return Shape::polyhedron("stone", std::move(body), nodes);
}

}  // namespace coral::dem::testing
