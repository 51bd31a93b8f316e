#include "sdf/closed_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"

namespace coral::sdf {
namespace {

/// One side of a triangle: its vertices in rising order, and whether the triangle walks it that way.
struct Side {
    int low, high;
    int triangle;
    bool forward;
};

std::vector<Side> sorted_sides(const TriangleMesh& mesh)
{
    std::vector<Side> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int n = 0; n < 3; ++n) {
            const int a = mesh.triangles[t][n], b = mesh.triangles[t][(n + 1) % 3];
            sides.push_back({std::min(a, b), std::max(a, b), int(t), a < b});
        }
    std::ranges::stable_sort(sides, [](const Side& a, const Side& b) { return std::pair(a.low, a.high) < std::pair(b.low, b.high); });
    return sides;
}

/// Position of a row (y, z) against the line a -> b in the y-z plane; never zero unless the line is a point. The row is moved by
/// (e, e^2) in thought, so that rows through vertices and edges are told apart alike by all triangles that meet there.
double side_of(const TriangleMesh& mesh, int a, int b, double y, double z)
{
    if (a > b) return -side_of(mesh, b, a, y, z);  // one way for both triangles of an edge: the same rounding
    const Eigen::Vector3d &p = mesh.vertices[std::size_t(a)], &q = mesh.vertices[std::size_t(b)];
    const double s = (q.y() - p.y()) * (z - p.z()) - (q.z() - p.z()) * (y - p.y());
    if (s != 0) return s;
    return q.z() != p.z() ? p.z() - q.z() : q.y() - p.y();
}

/// Winding that a triangle adds to points beyond it along +x on this row: +1 where the row enters, -1 where it leaves; 0 when missed.
int crossing(const TriangleMesh& mesh, const Eigen::Vector3i& t, double y, double z, double& x)
{
    const double s0 = side_of(mesh, t[0], t[1], y, z), s1 = side_of(mesh, t[1], t[2], y, z), s2 = side_of(mesh, t[2], t[0], y, z);
    const bool counter = s0 > 0 && s1 > 0 && s2 > 0, clock = s0 < 0 && s1 < 0 && s2 < 0;
    if (!counter && !clock) return 0;
    const Eigen::Vector3d &a = mesh.vertices[std::size_t(t[0])], &b = mesh.vertices[std::size_t(t[1])], &c = mesh.vertices[std::size_t(t[2])];
    const Eigen::Vector3d n = (b - a).cross(c - a);
    const double low = std::min({a.x(), b.x(), c.x()}), high = std::max({a.x(), b.x(), c.x()});
    x = n.x() != 0 ? std::clamp(a.x() - (n.y() * (y - a.y()) + n.z() * (z - a.z())) / n.x(), low, high) : 0.5 * (low + high);
    return counter ? -1 : 1;
}

/// A connected closed surface of the mesh.
struct Surface {
    std::vector<int> triangles;
    double volume = 0;  ///< enclosed, not negative [m^3]
    Eigen::AlignedBox3d box;
    int inside_of = -1;  ///< the smallest surface around it
    int depth = 0;       ///< surfaces around it
};

/// Orients the triangles that hang together alike. \return the surface of each triangle
std::vector<int> orient(TriangleMesh& mesh, const std::vector<Side>& sides, const std::string& name, int& surfaces)
{
    std::vector<std::array<std::pair<int, bool>, 3>> neighbours(mesh.triangles.size());  // triangle across a side, and whether it walks the side the same way
    std::vector<int> known(mesh.triangles.size(), 0), surface(mesh.triangles.size(), -1);
    for (std::size_t n = 0; n < sides.size();) {
        std::size_t end = n;
        while (end < sides.size() && sides[end].low == sides[n].low && sides[end].high == sides[n].high) ++end;
        // Where more than two triangles share a side, surfaces only touch: they stay apart.
        if (end - n == 2)
            for (int k = 0; k < 2; ++k) {
                const Side &here = sides[n + std::size_t(k)], &there = sides[n + std::size_t(1 - k)];
                neighbours[std::size_t(here.triangle)][std::size_t(known[std::size_t(here.triangle)]++)] = {there.triangle, here.forward == there.forward};
            }
        n = end;
    }
    std::vector<std::uint8_t> flip(mesh.triangles.size(), 0);
    std::vector<int> stack;
    surfaces = 0;
    for (std::size_t seed = 0; seed < surface.size(); ++seed) {
        if (surface[seed] >= 0) continue;
        surface[seed] = surfaces;
        stack.push_back(int(seed));
        while (!stack.empty()) {
            const auto t = std::size_t(stack.back());
            stack.pop_back();
            for (int k = 0; k < known[t]; ++k) {
                const auto [other, same_way] = neighbours[t][std::size_t(k)];
                const auto u = std::size_t(other);
                const std::uint8_t wanted = std::uint8_t(flip[t] ^ std::uint8_t(same_way));
                if (surface[u] >= 0) {
                    if (flip[u] != wanted) throw Error(name, "a surface of it has one side only: it cannot be oriented", "give the closed surface of a grain");
                    continue;
                }
                surface[u] = surfaces;
                flip[u] = wanted;
                stack.push_back(other);
            }
        }
        ++surfaces;
    }
    for (std::size_t t = 0; t < flip.size(); ++t)
        if (flip[t]) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    return surface;
}

/// Collects the surfaces and turns each outwards.
std::vector<Surface> collect(TriangleMesh& mesh, const std::vector<int>& surface_of, int count)
{
    std::vector<Surface> surfaces(static_cast<std::size_t>(count));
    for (std::size_t t = 0; t < surface_of.size(); ++t) {
        Surface& surface = surfaces[std::size_t(surface_of[t])];
        surface.triangles.push_back(int(t));
        for (int c = 0; c < 3; ++c) surface.box.extend(mesh.vertices[std::size_t(mesh.triangles[t][c])]);
    }
    for (Surface& surface : surfaces) {
        const Eigen::Vector3d o = surface.box.center();
        for (const int t : surface.triangles) {
            const Eigen::Vector3i& v = mesh.triangles[std::size_t(t)];
            surface.volume += (mesh.vertices[std::size_t(v[0])] - o).cross(mesh.vertices[std::size_t(v[1])] - o).dot(mesh.vertices[std::size_t(v[2])] - o) / 6.0;
        }
        if (surface.volume >= 0) continue;
        surface.volume = -surface.volume;
        for (const int t : surface.triangles) std::swap(mesh.triangles[std::size_t(t)][1], mesh.triangles[std::size_t(t)][2]);
    }
    return surfaces;
}

bool is_inside(const TriangleMesh& mesh, const Surface& surface, const Eigen::Vector3d& p)
{
    if (!surface.box.contains(p)) return false;
    int winding = 0;
    for (const int t : surface.triangles) {
        double x = 0;
        const int step = crossing(mesh, mesh.triangles[std::size_t(t)], p.y(), p.z(), x);
        if (step != 0 && x < p.x()) winding += step;
    }
    return winding > 0;
}

/// Which surfaces lie in which. Surfaces do not cross, so one vertex speaks for all.
void nest(const TriangleMesh& mesh, std::vector<Surface>& surfaces)
{
    for (Surface& inner : surfaces) {
        const Eigen::Vector3d p = mesh.vertices[std::size_t(mesh.triangles[std::size_t(inner.triangles[0])][0])];
        for (std::size_t n = 0; n < surfaces.size(); ++n) {
            const Surface& outer = surfaces[n];
            if (&outer == &inner || outer.volume <= inner.volume || !is_inside(mesh, outer, p)) continue;
            ++inner.depth;
            if (inner.inside_of < 0 || outer.volume < surfaces[std::size_t(inner.inside_of)].volume) inner.inside_of = int(n);
        }
    }
}

void require_closed(const std::vector<Side>& sides, const std::string& name)
{
    std::size_t open = 0;
    for (std::size_t n = 0; n < sides.size();) {
        std::size_t end = n;
        while (end < sides.size() && sides[end].low == sides[n].low && sides[end].high == sides[n].high) ++end;
        open += (end - n) % 2;
        n = end;
    }
    if (open > 0)
        throw Error(name, "the surface is not closed: " + std::to_string(open) + " open edges bound a single triangle",
                    "close its holes in a mesh editor (such as MeshLab or Blender) first");
}

}  // namespace

TriangleMesh closed_body(const TriangleMesh& mesh, const std::string& name, BodyReport* report)
{
    const std::vector<Side> sides = sorted_sides(mesh);
    require_closed(sides, name);
    TriangleMesh oriented = mesh;
    int count = 0;
    const std::vector<int> surface_of = orient(oriented, sides, name, count);
    std::vector<Surface> surfaces = collect(oriented, surface_of, count);
    nest(oriented, surfaces);

    BodyReport found;
    int body = -1;
    double total = 0;
    for (std::size_t n = 0; n < surfaces.size(); ++n) {
        if (surfaces[n].depth % 2 != 0) continue;
        ++found.bodies;
        total += surfaces[n].volume;
        if (body < 0 || surfaces[n].volume > surfaces[std::size_t(body)].volume) body = int(n);
    }
    if (!(total > 0)) throw Error(name, "encloses no volume", "give the closed surface of a grain");
    found.dropped_volume = total - surfaces[std::size_t(body)].volume;

    TriangleMesh out;
    std::vector<int> place(mesh.vertices.size(), -1);
    for (std::size_t t = 0; t < surface_of.size(); ++t) {
        const bool cavity = surfaces[std::size_t(surface_of[t])].inside_of == body && surfaces[std::size_t(surface_of[t])].depth % 2 != 0;
        if (surface_of[t] != body && !cavity) continue;
        Eigen::Vector3i v = oriented.triangles[t];
        if (cavity) std::swap(v[1], v[2]);
        const Eigen::Vector3i& was = mesh.triangles[t];
        found.turned += !(v == was);
        for (int c = 0; c < 3; ++c) {
            int& number = place[std::size_t(v[c])];
            if (number < 0) {
                number = int(out.vertices.size());
                out.vertices.push_back(mesh.vertices[std::size_t(v[c])]);
            }
            v[c] = number;
        }
        out.triangles.push_back(v);
    }
    for (const Surface& surface : surfaces) found.cavities += surface.inside_of == body && surface.depth % 2 != 0;
    if (report) *report = found;
    return out;
}

std::vector<std::uint8_t> solid_nodes(const TriangleMesh& mesh, const Eigen::Vector3d& origin, double step, const Eigen::Vector3i& size)
{
    struct Hit {
        float node;  ///< place along the row, in steps
        int winding;
    };
    const std::size_t nx = std::size_t(size.x()), ny = std::size_t(size.y()), rows = ny * std::size_t(size.z());
    std::vector<std::vector<Hit>> hits(rows);
    for (const Eigen::Vector3i& t : mesh.triangles) {
        Eigen::AlignedBox3d box;
        for (int c = 0; c < 3; ++c) box.extend((mesh.vertices[std::size_t(t[c])] - origin) / step);
        const int j0 = std::max(0, int(std::floor(box.min().y()))), j1 = std::min(size.y() - 1, int(std::ceil(box.max().y())));
        const int k0 = std::max(0, int(std::floor(box.min().z()))), k1 = std::min(size.z() - 1, int(std::ceil(box.max().z())));
        for (int k = k0; k <= k1; ++k)
            for (int j = j0; j <= j1; ++j) {
                double x = 0;
                const int winding = crossing(mesh, t, origin.y() + step * j, origin.z() + step * k, x);
                if (winding != 0) hits[std::size_t(k) * ny + std::size_t(j)].push_back({float((x - origin.x()) / step), winding});
            }
    }
    std::vector<std::uint8_t> solid(nx * rows, 0);
    parallel_blocks(rows, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
            std::vector<Hit>& line = hits[row];
            std::ranges::stable_sort(line, {}, &Hit::node);
            std::size_t next = 0;
            int winding = 0;
            for (std::size_t i = 0; i < nx && (winding > 0 || next < line.size()); ++i) {
                while (next < line.size() && line[next].node < float(i)) winding += line[next++].winding;
                solid[row * nx + i] = winding > 0;
            }
        }
    });
    return solid;
}

}  // namespace coral::sdf
