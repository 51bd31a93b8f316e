#include "dem/polyhedron.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "core/error.h"
#include "dem/detail/hull.h"
#include "dem/detail/lanes.h"

namespace coral::dem {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using detail::load;

namespace {

constexpr std::size_t lanes = 8;
constexpr double never = 1e300;
constexpr double flat = 1e-6;  ///< of the size: what lies this near to a plane lies in it; meshes come in single precision

std::size_t padded(std::size_t n) { return (n + lanes - 1) / lanes * lanes; }

/// Least of values(i), those of i to i + 3, over i < count (a whole number of lanes), the first of equals within a lane.
template <class Values>
std::pair<double, int> least(std::size_t count, const Values& values)
{
    constexpr std::size_t groups = lanes / detail::lane_count;
    detail::Lanes best[groups], index[groups];
    for (std::size_t g = 0; g < groups; ++g) best[g] = detail::all(never), index[g] = detail::all(0.0);
    for (std::size_t i = 0; i < count; i += lanes)
        for (std::size_t g = 0; g < groups; ++g) {
            const detail::Lanes v = values(i + g * detail::lane_count);
            const auto better = v < best[g];
            best[g] = better ? v : best[g];
            index[g] = better ? detail::all(double(i)) : index[g];
        }
    std::size_t winner = 0;
    const auto of = [](const detail::Lanes* l, std::size_t k) { return l[k / detail::lane_count][k % detail::lane_count]; };
    for (std::size_t k = 1; k < lanes; ++k)
        if (of(best, k) < of(best, winner)) winner = k;
    return {of(best, winner), int(of(index, winner)) + int(winner)};
}

/// Group of each triangle: neighbours whose planes are one. A sliver has no plane of its own and goes with one neighbour, on the longest edge
/// it shares with a triangle that has; along an edge of the body it must not join the faces on both sides.
std::vector<int> plane_groups(const std::vector<Vector3d>& points, const std::vector<std::array<int, 3>>& triangles, double tolerance)
{
    const std::size_t n = triangles.size();
    std::vector<int> group(n);
    std::iota(group.begin(), group.end(), 0);
    const auto root = [&](int t) {
        while (group[std::size_t(t)] != t) t = group[std::size_t(t)];
        return t;
    };
    const auto join = [&](int s, int t) { group[std::size_t(std::max(root(s), root(t)))] = std::min(root(s), root(t)); };
    const auto corner = [&](std::size_t t, std::size_t k) -> const Vector3d& { return points[std::size_t(triangles[t][k % 3])]; };
    std::map<std::array<int, 2>, int> owner;  // directed edge -> triangle
    std::vector<char> settled(n, 0);          // no sliver, or joined
    std::vector<Vector3d> normal(n);
    for (std::size_t t = 0; t < n; ++t) {
        double longest = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
            owner[{triangles[t][k], triangles[t][(k + 1) % 3]}] = int(t);
            longest = std::max(longest, (corner(t, k + 1) - corner(t, k)).norm());
        }
        normal[t] = (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
        settled[t] = normal[t].norm() > 2.0 * tolerance * longest;
        normal[t].normalize();
    }
    const auto beyond = [&](std::size_t t, std::size_t k) { return std::size_t(owner.at({triangles[t][(k + 1) % 3], triangles[t][k]})); };
    for (std::size_t t = 0; t < n; ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t other = beyond(t, k);
            if (!settled[t] || !settled[other] || normal[t].dot(normal[other]) < 0.0) continue;
            double height = 0.0;
            for (std::size_t c = 0; c < 3; ++c) height = std::max(height, std::abs(normal[t].dot(corner(other, c) - corner(t, 0))));
            if (height <= tolerance) join(int(t), int(other));
        }
    for (std::size_t left = std::size_t(std::count(settled.begin(), settled.end(), 0)); left > 0; --left) {
        double longest = -1.0;
        std::size_t sliver = 0, partner = 0;
        for (std::size_t t = 0; t < n; ++t)
            for (std::size_t k = 0; k < 3 && !settled[t]; ++k) {
                const double length = (corner(t, k + 1) - corner(t, k)).norm();
                if (settled[beyond(t, k)] && length > longest) longest = length, sliver = t, partner = beyond(t, k);
            }
        if (longest < 0.0) break;
        join(int(sliver), int(partner));
        settled[sliver] = 1;
    }
    for (std::size_t t = 0; t < n; ++t) group[t] = root(int(t));
    return group;
}

}  // namespace

Polyhedron::Polyhedron(std::span<const Vector3d> points, const std::string& name)
{
    const auto refuse = [&](const std::string& what) { throw Error(name, what, "give at least four vertices that do not lie in one plane"); };
    if (points.size() < 4) refuse("has " + std::to_string(points.size()) + " vertices");
    Vector3d low = points[0], high = low;
    for (const Vector3d& p : points) {
        if (!p.allFinite()) refuse("has a vertex that is no number");
        low = low.cwiseMin(p), high = high.cwiseMax(p);
    }
    const double size = (high - low).norm();
    if (!(size > 0.0)) refuse("has no size: its vertices are one point");
    const detail::HullTriangles hull = detail::convex_hull(points);
    vertices_ = hull.vertices;
    if (hull.triangles.size() < 4) refuse("has no volume: its vertices lie in one plane");
    double six_volumes = 0.0;
    for (const auto& t : hull.triangles)
        six_volumes += (vertices_[std::size_t(t[1])] - vertices_[std::size_t(t[0])])
                           .cross(vertices_[std::size_t(t[2])] - vertices_[std::size_t(t[0])]).dot(vertices_[std::size_t(t[0])] - vertices_[0]);
    if (!(six_volumes > 1e-7 * size * size * size)) refuse("has no volume: its vertices lie in one plane");
    take_faces(hull.triangles, size, name);
    take_mass_properties();
    take_edges();
}

/// One face per plane: the edges around a group of triangles, in order.
void Polyhedron::take_faces(const std::vector<std::array<int, 3>>& triangles, double size, const std::string& name)
{
    const std::vector<int> group = plane_groups(vertices_, triangles, flat * size);
    std::map<int, std::map<int, int>> rim;  // group -> vertex -> next vertex
    std::map<std::array<int, 2>, int> owner;
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) owner[{triangles[t][k], triangles[t][(k + 1) % 3]}] = group[t];
    for (const auto& [edge, g] : owner)
        if (owner.at({edge[1], edge[0]}) != g) rim[g][edge[0]] = edge[1];
    std::vector<char> used(vertices_.size(), 0);
    for (const auto& [g, next] : rim) {
        std::vector<int> face{next.begin()->first};
        for (int v = next.begin()->second; v != face.front() && face.size() <= next.size(); v = next.at(v)) face.push_back(v);
        if (face.size() < 3 || face.size() != next.size()) throw Error(name, "has a face that is no polygon", "remove vertices that lie in its edges or faces");
        for (const int v : face) used[std::size_t(v)] = 1;
        faces_.push_back(std::move(face));
    }
    // Points inside a plane face are corners of no face.
    std::vector<int> number(vertices_.size(), 0);
    std::vector<Vector3d> kept;
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
        number[v] = int(kept.size());
        if (used[v]) kept.push_back(vertices_[v]);
    }
    vertices_ = std::move(kept);
    for (std::vector<int>& face : faces_)
        for (int& v : face) v = number[std::size_t(v)];
}

void Polyhedron::take_mass_properties()
{
    Vector3d middle = Vector3d::Zero();
    for (const Vector3d& v : vertices_) middle += v / double(vertices_.size());
    Vector3d first = Vector3d::Zero();
    Matrix3d second = Matrix3d::Zero();  // integral of x x^T about the middle
    for (const std::vector<int>& face : faces_)
        for (std::size_t k = 2; k < face.size(); ++k) {
            const Vector3d a = vertices_[std::size_t(face[0])] - middle, b = vertices_[std::size_t(face[k - 1])] - middle,
                           c = vertices_[std::size_t(face[k])] - middle, sum = a + b + c;
            const double v = a.dot(b.cross(c)) / 6.0;
            volume_ += v;
            surface_ += 0.5 * (b - a).cross(c - a).norm();
            first += 0.25 * v * sum;
            second += v / 20.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
        }
    const Vector3d centre = first / volume_;
    second -= volume_ * centre * centre.transpose();
    inertia_ = second.trace() * Matrix3d::Identity() - second;
    moved_ = middle + centre;
    for (Vector3d& v : vertices_) {
        v -= moved_;
        bounding_radius_ = std::max(bounding_radius_, v.norm());
    }
    const std::size_t n = padded(faces_.size());
    for (std::vector<double>* p : {&plane_x_, &plane_y_, &plane_z_}) p->assign(n, 0.0);
    plane_d_.assign(n, never);
    for (std::size_t f = 0; f < faces_.size(); ++f) {
        Vector3d normal = Vector3d::Zero();  // Newell: twice the area
        const std::vector<int>& face = faces_[f];
        const Vector3d& start = vertices_[std::size_t(face[0])];
        for (std::size_t k = 2; k < face.size(); ++k)
            normal += (vertices_[std::size_t(face[k - 1])] - start).cross(vertices_[std::size_t(face[k])] - start);
        normal.normalize();
        double offset = -never;
        for (const int v : face) offset = std::max(offset, normal.dot(vertices_[std::size_t(v)]));
        plane_x_[f] = normal.x(), plane_y_[f] = normal.y(), plane_z_[f] = normal.z(), plane_d_[f] = offset;
    }
}

void Polyhedron::take_edges()
{
    for (const std::vector<int>& face : faces_)
        for (std::size_t k = 0; k < face.size(); ++k) {
            const int a = face[k], b = face[(k + 1) % face.size()];
            if (a < b) edges_.push_back({a, b});
        }
    std::sort(edges_.begin(), edges_.end());
    const std::size_t n = padded(edges_.size());
    for (int axis = 0; axis < 3; ++axis) {
        edge_start_[axis].assign(n, 1e100);  // far away
        edge_unit_[axis].assign(n, 0.0);
    }
    edge_length_.assign(n, 0.0);
    for (std::size_t e = 0; e < edges_.size(); ++e) {
        const Vector3d a = vertices_[std::size_t(edges_[e][0])], along = vertices_[std::size_t(edges_[e][1])] - a;
        edge_length_[e] = along.norm();
        for (int axis = 0; axis < 3; ++axis) {
            edge_start_[axis][e] = a[axis];
            edge_unit_[axis][e] = along[axis] / edge_length_[e];
        }
    }
}

Polyhedron::Extreme Polyhedron::highest_plane(const Vector3d& p) const
{
    const detail::Lanes x = detail::all(p.x()), y = detail::all(p.y()), z = detail::all(p.z());
    const double *nx = plane_x_.data(), *ny = plane_y_.data(), *nz = plane_z_.data(), *d = plane_d_.data();
    const auto [below, index] = least(plane_d_.size(), [=](std::size_t i) { return load(d + i) - (load(nx + i) * x + load(ny + i) * y + load(nz + i) * z); });
    return {-below, index};
}

Polyhedron::Extreme Polyhedron::nearest_edge(const Vector3d& p) const
{
    const detail::Lanes x = detail::all(p.x()), y = detail::all(p.y()), z = detail::all(p.z()), zero = detail::all(0.0);
    const double *ax = edge_start_[0].data(), *ay = edge_start_[1].data(), *az = edge_start_[2].data(), *ux = edge_unit_[0].data(),
                 *uy = edge_unit_[1].data(), *uz = edge_unit_[2].data(), *length = edge_length_.data();
    const auto [squared, index] = least(edge_length_.size(), [=](std::size_t i) {
        const detail::Lanes rx = x - load(ax + i), ry = y - load(ay + i), rz = z - load(az + i), vx = load(ux + i), vy = load(uy + i), vz = load(uz + i);
        const detail::Lanes t = detail::min(detail::max(rx * vx + ry * vy + rz * vz, zero), load(length + i));
        const detail::Lanes sx = rx - t * vx, sy = ry - t * vy, sz = rz - t * vz;
        return sx * sx + sy * sy + sz * sz;
    });
    return {squared, index};
}

double Polyhedron::depth_and_normal(const Vector3d& p, Vector3d& out) const
{
    const Extreme plane = highest_plane(p);
    out = normal(plane.index);
    return plane.value;
}

double Polyhedron::distance_and_gradient(const Vector3d& p, Vector3d& gradient) const
{
    const Extreme plane = highest_plane(p);
    gradient = normal(plane.index);
    if (plane.value <= 0.0) return plane.value;
    // Where the foot on the highest plane lies in the solid it is the closest point: every plane's height is a lower bound.
    if (highest_plane(p - plane.value * gradient).value <= 1e-14 * bounding_radius_) return plane.value;
    const Extreme edge = nearest_edge(p);
    const std::size_t e = std::size_t(edge.index);
    const Vector3d start(edge_start_[0][e], edge_start_[1][e], edge_start_[2][e]), unit(edge_unit_[0][e], edge_unit_[1][e], edge_unit_[2][e]);
    const double t = std::clamp((p - start).dot(unit), 0.0, edge_length_[e]);
    const Vector3d away = p - start - t * unit;
    const double distance = away.norm();
    if (distance > 1e-12 * bounding_radius_) gradient = away / distance;
    return distance;
}

double Polyhedron::distance(const Vector3d& p) const
{
    Vector3d gradient;
    return distance_and_gradient(p, gradient);
}

}  // namespace coral::dem
