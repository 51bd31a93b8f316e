#pragma once
/// \file suffusion/shapes.h
/// The shapes that the bodies of a case name, read and made ready for contact; and their surfaces for viewing.
#include <filesystem>
#include <memory>
#include <string>

#include "dem/shape.h"
#include "suffusion/case_file.h"

namespace coral::suffusion {

/// Equal for bodies that ask for the same shape.
std::string shape_key(const BodySpec& body);

/// \param folder  of the case; relative files start there
/// \param reach   largest distance outside that contact asks: the radius of the largest sphere, in metres of the unscaled shape
/// \throws Error for damaged files; UsageError with the body's place when a file lacks the shape, or what it holds makes no body
std::shared_ptr<const dem::Shape> make_shape(const BodySpec& body, const std::filesystem::path& folder, double reach);

/// Polygons of a surface, vertices counter-clockwise seen from outside.
struct Surface {
    std::vector<Eigen::Vector3d> vertices;  ///< shape frame [m]
    std::vector<std::vector<int>> polygons;
};

/// The faces of a polyhedron; triangles of the lattice, thinned to about 24 cells across, of every other shape that is no sphere.
/// For pictures only. Empty for spheres.
Surface viewing_surface(const dem::Shape& shape);

}  // namespace coral::suffusion
