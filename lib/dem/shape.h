#pragma once
/// \file dem/shape.h
/// Shapes that bodies share. A shape is immutable; a body is an instance of it: pose and scale (lengths multiply by the scale).
/// Three kinds: spheres (closed forms), grids (a level set, or spherical harmonics and superellipsoids tabulated on the same lattice) and
/// convex polyhedra (exact distances).
/// Shape frame: centre of mass at the origin. Distance is negative in the solid, positive outside and in voids [m].
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dem/polyhedron.h"
#include "sdf/distance_grid.h"

namespace coral::dem {

enum class ShapeKind { sphere, grid, polyhedron };

/// What a grid shape is made of; lengths at scale 1.
struct GridShapeData {
    std::string name;  ///< for messages, such as "grains.vdb grain_3"
    /// True distance on a dense lattice. Outside it must be exact out to the largest radius that is queried.
    std::shared_ptr<const sdf::DistanceGrid> distance;
    std::vector<Eigen::Vector3d> nodes;  ///< surface nodes, void walls included [m]
    std::vector<double> node_areas;      ///< tributary areas; they sum to the surface [m2]
    double volume = 0;                   ///< of the solid, voids left out [m3]
    double apparent_volume = 0;          ///< voids filled [m3]; 0 means equal to `volume`
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about the centre of mass at density 1 kg/m3 [m5]
    /// Directions of flat sides, along which Shape::flatness is measured; none for grains without.
    std::vector<Eigen::Vector3d> flat_sides;
};

class Shape {
public:
    /// Sphere of the given radius [m]. The template of packings has radius 0.5 m, so that a body's scale is its diameter.
    static std::shared_ptr<const Shape> sphere(double radius = 0.5);
    /// \throws Error  no lattice, no nodes, nodes and areas of different number, volume or inertia not positive
    static std::shared_ptr<const Shape> grid(GridShapeData data);
    /// Convex polyhedron with its surface nodes (dem/polyhedron.h).
    /// \throws Error  no nodes, nodes and areas of different number
    static std::shared_ptr<const Shape> polyhedron(std::string name, Polyhedron body, SurfaceNodes nodes);
    /// The same with nodes made here.
    static std::shared_ptr<const Shape> polyhedron(std::string name, Polyhedron body, int nodes = default_polyhedron_nodes);
    static constexpr int default_polyhedron_nodes = 2500;

    ShapeKind kind() const { return kind_; }
    const std::string& name() const { return name_; }
    double radius() const { return radius_; }                        ///< of a sphere [m]; 0 for others
    double equivalent_radius() const { return equivalent_radius_; }  ///< of the sphere of the apparent volume [m]
    double bounding_radius() const { return bounding_radius_; }      ///< about the centre of mass [m]
    double volume() const { return volume_; }                        ///< solid [m3]
    double apparent_volume() const { return apparent_volume_; }      ///< [m3]
    const Eigen::Matrix3d& inertia() const { return inertia_; }      ///< at density 1 kg/m3 [m5]
    const Eigen::Vector3d& principal_inertia() const { return principal_inertia_; }           ///< at density 1 kg/m3 [m5]
    const Eigen::Quaterniond& principal_rotation() const { return principal_rotation_; }      ///< principal frame to shape frame

    /// Signed distance [m] at a point of the shape frame.
    double distance(const Eigen::Vector3d& point) const;
    /// Distance and the un-normalised gradient of the very interpolant that gave it.
    double distance_and_gradient(const Eigen::Vector3d& point, Eigen::Vector3d& gradient) const;
    /// Largest distance outside the solid that the lattice answers everywhere [m]; infinite for spheres and polyhedra. Beyond it a
    /// value is a lower bound only.
    double exterior_reach() const { return exterior_reach_; }
    /// Stiffness of the contact of its flattest side with a plane, in units of kn; 1 for a sphere and for lattices that are not asked:
    ///     1/(2 pi R) 2c/D A(R/c), A(h) the area within the depth h of a supporting plane, c = 100, D = 2R    [slope of the node law]
    double flatness() const { return flatness_; }

    const sdf::DistanceGrid& distance_grid() const { return *grid_; }  ///< \pre kind() == ShapeKind::grid
    const Polyhedron& polyhedron() const { return *polyhedron_; }      ///< \pre kind() == ShapeKind::polyhedron
    /// Nodes and areas in the order of contact (neighbours in space are neighbours in memory), not the order they came in.
    std::span<const Eigen::Vector3d> nodes() const { return nodes_; }
    std::span<const double> node_areas() const { return node_areas_; }

    /// Run of consecutive nodes within a ball.
    struct Cluster {
        Eigen::Vector3d centre;
        double radius;
        int begin, end;
    };
    std::span<const Cluster> clusters() const { return clusters_; }
    /// Runs of clusters within a ball; begin and end count clusters.
    std::span<const Cluster> groups() const { return groups_; }

private:
    Shape() = default;
    void take_nodes(std::vector<Eigen::Vector3d> nodes, std::vector<double> areas);
    void take_inertia(const Eigen::Matrix3d& inertia);
    void sort_nodes();
    void measure_flatness(std::span<const Eigen::Vector3d> directions);
    ShapeKind kind_ = ShapeKind::sphere;
    std::string name_;
    double radius_ = 0, equivalent_radius_ = 0, bounding_radius_ = 0, volume_ = 0, apparent_volume_ = 0, exterior_reach_ = 0, flatness_ = 1;
    Eigen::Matrix3d inertia_ = Eigen::Matrix3d::Zero();
    Eigen::Vector3d principal_inertia_ = Eigen::Vector3d::Zero();
    Eigen::Quaterniond principal_rotation_ = Eigen::Quaterniond::Identity();
    std::shared_ptr<const sdf::DistanceGrid> grid_;
    std::shared_ptr<const Polyhedron> polyhedron_;
    std::vector<Eigen::Vector3d> nodes_;
    std::vector<double> node_areas_;
    std::vector<Cluster> clusters_, groups_;
};

}  // namespace coral::dem
