#include "dem/detail/hull.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <algorithm>
#include <map>

namespace coral::dem::detail {

HullTriangles convex_hull(std::span<const Eigen::Vector3d> points)
{
    using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
    using Point = Kernel::Point_3;
    std::vector<Point> cloud;
    for (const Eigen::Vector3d& p : points) cloud.emplace_back(p.x(), p.y(), p.z());
    // CGAL cuts plane faces by the order of the points, and orders its output by memory address.
    std::sort(cloud.begin(), cloud.end());
    cloud.erase(std::unique(cloud.begin(), cloud.end()), cloud.end());
    CGAL::Surface_mesh<Point> hull;
    if (cloud.size() >= 4) CGAL::convex_hull_3(cloud.begin(), cloud.end(), hull);
    HullTriangles out;
    if (hull.number_of_faces() < 4) return out;

    std::map<Point, int> number;
    for (const auto v : hull.vertices()) number[hull.point(v)] = 0;
    for (auto& [point, n] : number) {
        n = static_cast<int>(out.vertices.size());
        out.vertices.emplace_back(point.x(), point.y(), point.z());
    }
    for (const auto f : hull.faces()) {
        std::vector<int> loop;
        for (const auto v : hull.vertices_around_face(hull.halfedge(f))) loop.push_back(number.at(hull.point(v)));
        for (std::size_t k = 2; k < loop.size(); ++k) {
            std::array<int, 3> t{loop[0], loop[k - 1], loop[k]};
            std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
            out.triangles.push_back(t);
        }
    }
    std::sort(out.triangles.begin(), out.triangles.end());
    return out;
}

}  // namespace coral::dem::detail
