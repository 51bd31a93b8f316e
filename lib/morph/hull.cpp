#include "morph/hull.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Random.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>
#include <CGAL/optimal_bounding_box.h>

#include <algorithm>
#include <array>
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

    HullProperties out;
    const Point reference = *hull.points().begin();
    std::vector<Point> corners;
    for (const auto f : hull.faces()) {
        std::array<Point, 3> t;
        std::size_t n = 0;
        for (const auto v : hull.vertices_around_face(hull.halfedge(f)))
            if (n < 3) t[n++] = hull.point(v);
        out.volume += CGAL::to_double(CGAL::volume(reference, t[0], t[1], t[2]));
    }
    out.volume = std::abs(out.volume);
    double span = 0;
    for (const auto v : hull.vertices()) {
        corners.push_back(hull.point(v));
        span = std::max(span, std::sqrt(CGAL::squared_distance(reference, corners.back())));
    }
    if (out.volume <= 1e-9 * span * span * span) refuse();  // a flat set may come as a body of two sides

    // The search for the box is random inside; a fixed seed makes it the same for every grain order and thread.
    CGAL::get_default_random() = CGAL::Random(0);
    std::array<Point, 8> box;
    CGAL::oriented_bounding_box(corners, box, CGAL::parameters::use_convex_hull(false));
    const std::array<double, 3> edges{std::sqrt(CGAL::squared_distance(box[0], box[1])), std::sqrt(CGAL::squared_distance(box[0], box[3])),
                                      std::sqrt(CGAL::squared_distance(box[0], box[5]))};
    out.box = {edges[0], edges[1], edges[2]};
    std::sort(out.box.data(), out.box.data() + 3, std::greater<>());
    return out;
}

}  // namespace coral::morph
