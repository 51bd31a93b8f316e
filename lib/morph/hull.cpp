#include "morph/hull.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace coral::morph {

HullProperties hull_properties(std::span<const Eigen::Vector3d> points)
{
    using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
    using Point = Kernel::Point_3;
    std::vector<Point> cloud;
    cloud.reserve(points.size());
    for (const Eigen::Vector3d& p : points) cloud.emplace_back(p.x(), p.y(), p.z());
    CGAL::Surface_mesh<Point> hull;
    if (cloud.size() >= 4) CGAL::convex_hull_3(cloud.begin(), cloud.end(), hull);
    const auto refuse = [] { throw Error("convex hull", "the points lie in one plane"); };
    if (hull.number_of_faces() < 4) refuse();

    // CGAL orders faces and vertices by memory address and may cut plane faces differently: vertices are sorted, and the sum,
    // in rising order, is kept to twelve digits, so that the result depends on the points alone.
    std::vector<Point> corners;
    for (const auto v : hull.vertices()) corners.push_back(hull.point(v));
    std::sort(corners.begin(), corners.end());
    double span = 0;
    for (const Point& p : corners) span = std::max(span, std::sqrt(CGAL::squared_distance(corners.front(), p)));
    std::vector<double> parts;
    for (const auto f : hull.faces()) {
        std::array<Point, 3> t;
        std::size_t n = 0;
        for (const auto v : hull.vertices_around_face(hull.halfedge(f)))
            if (n < 3) t[n++] = hull.point(v);
        parts.push_back(std::abs(CGAL::volume(corners.front(), t[0], t[1], t[2])));
    }
    std::sort(parts.begin(), parts.end());
    HullProperties out;
    for (const double part : parts) out.volume += part;
    if (out.volume <= 1e-9 * span * span * span) refuse();  // a flat set may come as a body of two sides
    const double digit = std::pow(10.0, std::floor(std::log10(out.volume)) - 12.0);
    out.volume = std::round(out.volume / digit) * digit;

    for (const Point& p : corners) out.corners.emplace_back(p.x(), p.y(), p.z());
    return out;
}

}  // namespace coral::morph
