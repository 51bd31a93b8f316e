#pragma once
/// \file suffusion/shapes.h
/// The shapes that the bodies of a case name, read and made ready for contact; and their surfaces for viewing.
#include <filesystem>
#include <memory>
#include <string>

#include "core/record.h"
#include "dem/shape.h"
#include "fluid/drag.h"
#include "suffusion/case_file.h"

namespace coral::suffusion {

/// Equal for bodies that ask for the same shape.
std::string shape_key(const BodySpec& body);

/// \param folder  of the case; relative files start there
/// \param reach   largest distance outside that contact asks: the radius of the largest sphere, in metres of the unscaled shape
/// \throws Error for damaged files; UsageError with the body's place when a file lacks the shape, or what it holds makes no body
std::shared_ptr<const dem::Shape> make_shape(const BodySpec& body, const std::filesystem::path& folder, double reach);

/// History of the file that a body's shape comes from; empty where there is none, or one of other makers.
History shape_history(const BodySpec& body, const std::filesystem::path& folder);

/// Polygons of a surface, vertices counter-clockwise seen from outside.
struct Surface {
    std::vector<Eigen::Vector3d> vertices;  ///< shape frame [m]
    std::vector<std::vector<int>> polygons;
};

/// The faces of a polyhedron; triangles of the lattice, thinned to about 24 cells across, of every other shape that is no sphere.
/// For pictures only. Empty for spheres.
Surface viewing_surface(const dem::Shape& shape);

/// What drag laws ask of a shape. Sizes cancel: it serves bodies of any scale.
class Outline {
public:
    /// The surface is that of the outermost closed surface of a lattice, walls of closed voids left out, or of the polyhedron; the
    /// projection is that of the convex hull.
    explicit Outline(const dem::Shape& shape);

    double sphericity() const { return sphericity_; }  ///< surface of the sphere of the apparent volume over the surface, at most 1
    /// Section of that sphere over the area seen along a direction of the shape frame (any length but zero): sum |a_f . n|/2 over the
    /// faces of the hull.
    double crosswise_sphericity(const Eigen::Vector3d& direction) const;
    fluid::DragShape along(const Eigen::Vector3d& direction) const { return {sphericity_, crosswise_sphericity(direction)}; }

private:
    void add_face(const Eigen::Vector3d& area);

    double sphericity_ = 1, section_ = 0;        ///< section of the sphere [m2]; 0 for a sphere
    std::vector<Eigen::Vector3d> areas_;         ///< of the hull, faces that look alike or opposite taken together [m2]
};

}  // namespace coral::suffusion
