#pragma once
/// \file report/surface_mesh.h
/// Triangle meshes of grains for viewing, from the distance lattices of sample.h5. For pictures only: nothing is measured on them.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace coral::report {

/// Signed distance at the nodes of a cubic lattice, x fastest [m]; negative in solid.
struct Lattice {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< of node (0, 0, 0) [m]
    double spacing = 0;                                ///< [m]
    std::vector<float> distance;

    float at(int i, int j, int k) const
    {
        return distance[(static_cast<std::size_t>(k) * static_cast<std::size_t>(size.y()) + static_cast<std::size_t>(j)) * static_cast<std::size_t>(size.x()) +
                        static_cast<std::size_t>(i)];
    }
};

struct Mesh {
    std::vector<Eigen::Vector3d> vertices;                 ///< [m]
    std::vector<std::array<std::uint32_t, 3>> triangles;   ///< counter-clockwise seen from outside
};

/// The same field at a coarser spacing, trilinear, over the nodes that matter: those around the solid and one layer more.
/// Voids and walls thinner than the new spacing may close or open.
Lattice coarsened(const Lattice& lattice, double spacing);

/// Zero level by naive surface nets [Gibson 1998]: one vertex per cell that the surface crosses, at the mean of the crossings on
/// its edges. What lies outside the lattice counts as outside the grain, so the mesh is closed.
Mesh surface_mesh(const Lattice& lattice);

}  // namespace coral::report
