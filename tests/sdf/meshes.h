#pragma once
/// Closed triangle meshes with known volumes.
#include <Eigen/Geometry>

#include "sdf/mesh.h"
#include "shapes.h"

namespace coral::sdf::test {

/// Sphere as a finely divided octahedron: every vertex on the sphere, volume low by 0.4 % at five divisions.
inline TriangleMesh ball_mesh(const Eigen::Vector3d& centre, double radius, int divisions = 5)
{
    const std::array<Eigen::Vector3d, 6> tips = {Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(),
                                                 -Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ()};
    std::vector<std::array<Eigen::Vector3d, 3>> faces;
    for (int a = 0; a < 2; ++a)
        for (int b = 2; b < 4; ++b)
            for (int c = 4; c < 6; ++c) {
                std::array<Eigen::Vector3d, 3> face{tips[std::size_t(a)], tips[std::size_t(b)], tips[std::size_t(c)]};
                if (face[0].cross(face[1]).dot(face[2]) < 0) std::swap(face[1], face[2]);
                faces.push_back(face);
            }
    for (int n = 0; n < divisions; ++n) {
        std::vector<std::array<Eigen::Vector3d, 3>> finer;
        for (const auto& [p, q, r] : faces) {
            const Eigen::Vector3d pq = (p + q).normalized(), qr = (q + r).normalized(), rp = (r + p).normalized();
            finer.insert(finer.end(), {{p, pq, rp}, {pq, q, qr}, {rp, qr, r}, {pq, qr, rp}});
        }
        faces = std::move(finer);
    }
    TriangleMesh mesh;
    std::map<std::array<double, 3>, int> known;  // neighbours compute the same midpoint to the last bit: p + q is q + p
    for (const auto& face : faces) {
        Eigen::Vector3i t;
        for (int k = 0; k < 3; ++k) {
            const Eigen::Vector3d p = face[std::size_t(k)];
            const auto [place, added] = known.emplace(std::array{p.x(), p.y(), p.z()}, int(mesh.vertices.size()));
            if (added) mesh.vertices.push_back(centre + radius * p);
            t[k] = place->second;
        }
        mesh.triangles.push_back(t);
    }
    return mesh;
}

/// Both in one mesh.
inline TriangleMesh together(TriangleMesh a, const TriangleMesh& b)
{
    const int first = int(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const Eigen::Vector3i& t : b.triangles) a.triangles.push_back(t.array() + first);
    return a;
}

inline TriangleMesh turned(TriangleMesh mesh)
{
    for (Eigen::Vector3i& t : mesh.triangles) std::swap(t[0], t[1]);
    return mesh;
}

/// Axis-parallel box: rows of a lattice run along its edges and through its vertices.
inline TriangleMesh box_mesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high)
{
    TriangleMesh mesh;
    for (int c = 0; c < 8; ++c) mesh.vertices.emplace_back(c & 1 ? high.x() : low.x(), c & 2 ? high.y() : low.y(), c & 4 ? high.z() : low.z());
    for (const auto& f : {std::array{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}) {
        mesh.triangles.emplace_back(f[0], f[1], f[2]);
        mesh.triangles.emplace_back(f[0], f[2], f[3]);
    }
    return mesh;
}

}  // namespace coral::sdf::test
