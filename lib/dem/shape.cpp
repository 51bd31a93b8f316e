#include "dem/shape.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "core/text.h"
#include "dem/detail/contact_law.h"

namespace coral::dem {

namespace {

constexpr int nodes_per_cluster = 12, clusters_per_group = 12;

/// Bits of a 10-bit number spread to every third place.
std::uint32_t spread(std::uint32_t v)
{
    v = (v | (v << 16)) & 0x030000FF;
    v = (v | (v << 8)) & 0x0300F00F;
    v = (v | (v << 4)) & 0x030C30C3;
    return (v | (v << 2)) & 0x09249249;
}

double equivalent_radius_of(double volume) { return std::cbrt(3.0 * volume / (4.0 * std::numbers::pi)); }

/// Smallest value on the faces of the lattice: every point outside the solid that is nearer lies inside the box.
double reach(const sdf::DistanceGrid& grid)
{
    double least = grid.outside_limit;
    const Eigen::Vector3i last = grid.size.array() - 1;
    for (int k = 0; k <= last.z(); ++k)
        for (int j = 0; j <= last.y(); ++j) {
            const bool face = k == 0 || j == 0 || k == last.z() || j == last.y();
            for (int i = 0; i <= last.x(); i += face ? 1 : last.x())
                least = std::min(least, double(grid.distance[grid.index(i, j, k)]));
        }
    return least;
}

}  // namespace

std::shared_ptr<const Shape> Shape::sphere(double radius)
{
    if (!(radius > 0.0) || !std::isfinite(radius))
        throw Error("sphere", "radius " + to_text(radius) + " m is not positive", "give a positive radius");
    std::shared_ptr<Shape> shape(new Shape);
    shape->kind_ = ShapeKind::sphere;
    shape->name_ = "sphere";
    shape->radius_ = shape->equivalent_radius_ = shape->bounding_radius_ = radius;
    shape->volume_ = shape->apparent_volume_ = 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
    shape->exterior_reach_ = std::numeric_limits<double>::infinity();
    const double moment = 0.4 * shape->volume_ * radius * radius;
    shape->inertia_ = moment * Eigen::Matrix3d::Identity();
    shape->principal_inertia_.setConstant(moment);
    return shape;
}

std::shared_ptr<const Shape> Shape::grid(GridShapeData data)
{
    const std::string where = data.name.empty() ? "grid shape" : data.name;
    if (!data.distance || data.distance->size.minCoeff() < 2 || data.distance->distance.size() != data.distance->node_count() ||
        !(data.distance->spacing > 0.0))
        throw Error(where, "the distance lattice is empty or its size does not fit its values", "build the shape again");
    if (!(data.volume > 0.0) || !std::isfinite(data.volume))
        throw Error(where, "volume " + to_text(data.volume) + " m3 is not positive", "build the shape again");
    std::shared_ptr<Shape> shape(new Shape);
    shape->kind_ = ShapeKind::grid;
    shape->name_ = where;
    shape->grid_ = std::move(data.distance);
    shape->volume_ = data.volume;
    shape->apparent_volume_ = data.apparent_volume > 0.0 ? data.apparent_volume : data.volume;
    shape->equivalent_radius_ = equivalent_radius_of(shape->apparent_volume_);
    shape->take_inertia(data.inertia);
    shape->take_nodes(std::move(data.nodes), std::move(data.node_areas));
    // Nodes lie on the surface, between them the surface may bulge; a tenth of the spacing is far above the sagitta.
    shape->bounding_radius_ += 0.1 * shape->grid_->spacing;
    shape->exterior_reach_ = reach(*shape->grid_);
    shape->sort_nodes();
    shape->measure_flatness(data.flat_sides);
    return shape;
}

std::shared_ptr<const Shape> Shape::polyhedron(std::string name, Polyhedron body, SurfaceNodes nodes)
{
    std::shared_ptr<Shape> shape(new Shape);
    shape->kind_ = ShapeKind::polyhedron;
    shape->name_ = name.empty() ? "polyhedron" : std::move(name);
    shape->volume_ = shape->apparent_volume_ = body.volume();
    shape->equivalent_radius_ = equivalent_radius_of(body.volume());
    shape->exterior_reach_ = std::numeric_limits<double>::infinity();
    shape->take_inertia(body.inertia());
    shape->take_nodes(std::move(nodes.positions), std::move(nodes.areas));
    shape->bounding_radius_ = std::max(shape->bounding_radius_, body.bounding_radius());
    shape->sort_nodes();
    std::vector<Eigen::Vector3d> sides;
    for (std::size_t f = 0; f < body.faces().size(); ++f) sides.push_back(body.normal(int(f)));
    shape->measure_flatness(sides);
    shape->polyhedron_ = std::make_shared<const Polyhedron>(std::move(body));
    return shape;
}

std::shared_ptr<const Shape> Shape::polyhedron(std::string name, Polyhedron body, int nodes)
{
    SurfaceNodes surface = polyhedron_nodes(body, nodes);
    return polyhedron(std::move(name), std::move(body), std::move(surface));
}

void Shape::take_nodes(std::vector<Eigen::Vector3d> nodes, std::vector<double> areas)
{
    if (nodes.empty() || nodes.size() != areas.size())
        throw Error(name_, std::to_string(nodes.size()) + " surface nodes and " + std::to_string(areas.size()) + " areas",
                    "a shape needs the same number of both, at least one");
    nodes_ = std::move(nodes);
    node_areas_ = std::move(areas);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
        if (!nodes_[i].allFinite() || !(node_areas_[i] >= 0.0))
            throw Error(name_, "surface node " + std::to_string(i) + " or its area is no number", "build the shape again");
        bounding_radius_ = std::max(bounding_radius_, nodes_[i].norm());
    }
}

void Shape::take_inertia(const Eigen::Matrix3d& inertia)
{
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
    if (!inertia.allFinite() || solver.info() != Eigen::Success || !(solver.eigenvalues().minCoeff() > 0.0))
        throw Error(name_, "the inertia tensor is not positive definite", "build the shape again");
    inertia_ = inertia;
    principal_inertia_ = solver.eigenvalues();
    Eigen::Matrix3d axes = solver.eigenvectors();
    if (axes.determinant() < 0.0) axes.col(2) = -axes.col(2);
    principal_rotation_ = Eigen::Quaterniond(axes).normalized();
}

void Shape::measure_flatness(std::span<const Eigen::Vector3d> directions)
{
    constexpr double c = detail::sigmoid;
    for (const Eigen::Vector3d& n : directions) {
        double height = -std::numeric_limits<double>::infinity(), area = 0.0;
        for (const Eigen::Vector3d& p : nodes_) height = std::max(height, n.dot(p));
        for (std::size_t i = 0; i < nodes_.size(); ++i)
            if (n.dot(nodes_[i]) > height - equivalent_radius_ / c) area += node_areas_[i];
        flatness_ = std::max(flatness_, c * area / (2.0 * std::numbers::pi * equivalent_radius_ * equivalent_radius_));
    }
}

void Shape::sort_nodes()
{
    const Eigen::Vector3d lower = Eigen::Vector3d::Constant(-bounding_radius_);
    const double to_cell = 1023.0 / (2.0 * bounding_radius_);
    std::vector<std::uint32_t> key(nodes_.size());
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
        const Eigen::Vector3d cell = (nodes_[i] - lower) * to_cell;
        key[i] = spread(std::uint32_t(cell.x())) | spread(std::uint32_t(cell.y())) << 1 | spread(std::uint32_t(cell.z())) << 2;
    }
    std::vector<std::size_t> order(nodes_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key[a] < key[b]; });
    std::vector<Eigen::Vector3d> nodes;
    std::vector<double> areas;
    nodes.reserve(order.size());
    areas.reserve(order.size());
    for (const std::size_t i : order) {
        nodes.push_back(nodes_[i]);
        areas.push_back(node_areas_[i]);
    }
    nodes_ = std::move(nodes);
    node_areas_ = std::move(areas);

    for (int begin = 0; begin < int(nodes_.size()); begin += nodes_per_cluster) {
        Cluster c{Eigen::Vector3d::Zero(), 0.0, begin, std::min(begin + nodes_per_cluster, int(nodes_.size()))};
        for (int i = c.begin; i < c.end; ++i) c.centre += nodes_[std::size_t(i)] / (c.end - c.begin);
        for (int i = c.begin; i < c.end; ++i) c.radius = std::max(c.radius, (nodes_[std::size_t(i)] - c.centre).norm());
        clusters_.push_back(c);
    }
    for (int begin = 0; begin < int(clusters_.size()); begin += clusters_per_group) {
        Cluster g{Eigen::Vector3d::Zero(), 0.0, begin, std::min(begin + clusters_per_group, int(clusters_.size()))};
        for (int i = g.begin; i < g.end; ++i) g.centre += clusters_[std::size_t(i)].centre / (g.end - g.begin);
        for (int i = g.begin; i < g.end; ++i)
            g.radius = std::max(g.radius, (clusters_[std::size_t(i)].centre - g.centre).norm() + clusters_[std::size_t(i)].radius);
        groups_.push_back(g);
    }
}

double Shape::distance(const Eigen::Vector3d& point) const
{
    if (kind_ == ShapeKind::polyhedron) return polyhedron_->distance(point);
    return kind_ == ShapeKind::sphere ? point.norm() - radius_ : grid_->sample(point);
}

double Shape::distance_and_gradient(const Eigen::Vector3d& point, Eigen::Vector3d& gradient) const
{
    if (kind_ == ShapeKind::grid) return grid_->sample_with_gradient(point, gradient);
    if (kind_ == ShapeKind::polyhedron) return polyhedron_->distance_and_gradient(point, gradient);
    const double length = point.norm();
    gradient = length > 0.0 ? Eigen::Vector3d(point / length) : Eigen::Vector3d::UnitZ();
    return length - radius_;
}

}  // namespace coral::dem
