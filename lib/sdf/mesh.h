#pragma once
/// \file sdf/mesh.h
/// Triangle mesh of the surface d = 0, void walls included.
#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "sdf/distance_grid.h"

namespace coral::sdf {

/// Triangles turn counter-clockwise seen from outside the solid (from a void too).
struct TriangleMesh {
    std::vector<Eigen::Vector3d> vertices;   ///< [m]
    std::vector<Eigen::Vector3i> triangles;  ///< vertex numbers
};

/// Zero level of the trilinear interpolant: one vertex per lattice edge with a change of sign, cell polygons traced over the
/// faces, ambiguous faces resolved by the sign of the bilinear saddle [Nielson and Hamann 1991], so the mesh is closed.
/// Area and volume converge with spacing^2.
TriangleMesh extract_mesh(const DistanceGrid& grid);

double triangle_area(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);  ///< [m^2]
double surface_area(const TriangleMesh& mesh);     ///< [m^2]
double enclosed_volume(const TriangleMesh& mesh);  ///< by the divergence theorem, voids not counted [m^3]

/// Binary little-endian PLY (double coordinates) or STL (float), in millimetres when `unit` is 1e-3 m. Written whole or not at all.
void write_ply(const TriangleMesh& mesh, const std::filesystem::path& file, double unit = 1.0);
void write_stl(const TriangleMesh& mesh, const std::filesystem::path& file, double unit = 1.0);

}  // namespace coral::sdf
