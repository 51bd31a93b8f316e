#pragma once
/// \file dem/polyhedron.h
/// Convex polyhedron: faces of the hull of points, exact signed distance, exact mass properties, surface nodes.
/// Metres; distance is negative inside.
#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <vector>

namespace coral::dem {

class Polyhedron {
public:
    /// Hull of the points; its frame is moved so that the centre of mass lies at the origin. Triangles of the hull that lie in one plane
    /// (to 1e-6 of the size) are one face. The result does not depend on the order of the points.
    /// \param name  for messages
    /// \throws Error  fewer than four points, a coordinate that is no number, points in one point, line or plane
    explicit Polyhedron(std::span<const Eigen::Vector3d> points, const std::string& name = "polyhedron");

    std::span<const Eigen::Vector3d> vertices() const { return vertices_; }      ///< from the centre of mass [m]
    std::span<const std::vector<int>> faces() const { return faces_; }           ///< vertex numbers, counter-clockwise seen from outside
    std::span<const std::array<int, 2>> edges() const { return edges_; }         ///< vertex numbers, the smaller first
    Eigen::Vector3d normal(int face) const { return {plane_x_[face], plane_y_[face], plane_z_[face]}; }  ///< unit, outwards
    double offset(int face) const { return plane_d_[face]; }                     ///< of the plane n.x = offset [m]
    double volume() const { return volume_; }                                    ///< [m3]
    double surface() const { return surface_; }                                  ///< [m2]
    double bounding_radius() const { return bounding_radius_; }                  ///< about the centre of mass [m]
    const Eigen::Matrix3d& inertia() const { return inertia_; }                  ///< about the centre of mass at density 1 kg/m3 [m5]
    const Eigen::Vector3d& moved() const { return moved_; }                      ///< centre of mass of the points' own frame [m]

    /// Exact distance: inside max over faces of n.x - d, outside to the closest point of a face, an edge or a vertex. The gradient is
    /// that of the value; on ridges, where two faces are equally near, that of the first.
    double distance_and_gradient(const Eigen::Vector3d& point, Eigen::Vector3d& gradient) const;
    double distance(const Eigen::Vector3d& point) const;
    /// max over faces of n.x - d and the normal of that face: the distance inside, a lower bound of it outside. What nodes ask.
    double depth_and_normal(const Eigen::Vector3d& point, Eigen::Vector3d& normal) const;

private:
    void take_faces(const std::vector<std::array<int, 3>>& triangles, double size, const std::string& name);
    void take_edges();
    void take_mass_properties();
    struct Extreme {
        double value;
        int index;
    };
    Extreme highest_plane(const Eigen::Vector3d& point) const;
    Extreme nearest_edge(const Eigen::Vector3d& point) const;  ///< squared distance

    std::vector<Eigen::Vector3d> vertices_;
    std::vector<std::vector<int>> faces_;
    std::vector<std::array<int, 2>> edges_;
    // Structure of arrays, filled up to whole lanes with entries that never win.
    std::vector<double> plane_x_, plane_y_, plane_z_, plane_d_;
    std::vector<double> edge_start_[3], edge_unit_[3], edge_length_;
    double volume_ = 0, surface_ = 0, bounding_radius_ = 0;
    Eigen::Matrix3d inertia_ = Eigen::Matrix3d::Zero();
    Eigen::Vector3d moved_ = Eigen::Vector3d::Zero();
};

struct SurfaceNodes {
    std::vector<Eigen::Vector3d> positions;  ///< on the surface, from the centre of mass [m]
    std::vector<double> areas;               ///< they sum to the surface [m2]
};

/// About `count` nodes with the areas around them. Every face is cut into strips along its edges, every strip across; the strips along
/// the rim are narrow (a tenth of the spacing, at most 0.005 of the diameter) and have their nodes on the edges and vertices, so that a
/// corner that comes first is felt as what it is and a face that lies flat is not felt wider.
/// \throws Error  count below 4
SurfaceNodes polyhedron_nodes(const Polyhedron& polyhedron, int count);

}  // namespace coral::dem
