#pragma once
/// \file sdf/closed_mesh.h
/// Closed triangle meshes: one solid body out of what a scanner or a modeller wrote, and which lattice nodes lie in it.
#include <string>

#include "sdf/mesh.h"

namespace coral::sdf {

/// What closed_body found and did.
struct BodyReport {
    int bodies = 0;               ///< closed surfaces that are not in a cavity's place; one is kept
    int cavities = 0;             ///< closed surfaces inside the body kept
    double dropped_volume = 0;    ///< of the other bodies [m^3]
    std::size_t turned = 0;       ///< triangles whose orientation was changed
};

/// The largest closed body of a mesh with its cavities. A closed surface inside another is a cavity, inside a cavity again a body of
/// its own, whichever way its triangles turn; the result turns them counter-clockwise seen from outside the solid (from a cavity too).
/// \param name  of the mesh, for messages
/// \throws Error when edges bound one triangle only (says how many), or a surface cannot be oriented or encloses nothing
TriangleMesh closed_body(const TriangleMesh& mesh, const std::string& name, BodyReport* report = nullptr);

/// Whether the nodes origin + step*(i,j,k) are solid, x fastest: winding number along rows of x, exact where a row meets edges and
/// vertices too [symbolic perturbation of the row: Edelsbrunner & Muecke 1990].
/// \param mesh  closed, as closed_body leaves it
std::vector<std::uint8_t> solid_nodes(const TriangleMesh& mesh, const Eigen::Vector3d& origin, double step, const Eigen::Vector3i& size);

}  // namespace coral::sdf
