#include "dem/detail/facets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sdf/extend.h"
#include "sdf/mesh.h"

namespace coral::dem::detail {

namespace {

constexpr int cells_per_block = 4;

sdf::DistanceGrid cut_out(const sdf::DistanceGrid& grid, const Eigen::Vector3d& point, double distance)
{
    const auto cell = [&](const Eigen::Array3d& p) { return Eigen::Array3i(((p - grid.origin.array()) / grid.spacing).floor().cast<int>()); };
    const Eigen::Array3i last = grid.size.array() - 2;
    const Eigen::Vector3i low = cell(point.array() - distance).max(0).min(last), high = cell(point.array() + distance).max(0).min(last);
    return sdf::part(grid, low, high + Eigen::Vector3i::Ones());
}

}  // namespace

Facets::Facets(const sdf::DistanceGrid& grid) : origin_(grid.origin), edge_(cells_per_block * grid.spacing)
{
    sdf::TriangleMesh mesh = sdf::extract_mesh(grid);
    // A corner of the lattice on the surface makes triangles without an area.
    std::erase_if(mesh.triangles, [&](const Eigen::Vector3i& t) {
        const Eigen::Vector3f a = mesh.vertices[std::size_t(t[0])].cast<float>(), b = mesh.vertices[std::size_t(t[1])].cast<float>(),
                              c = mesh.vertices[std::size_t(t[2])].cast<float>();
        return (b - a).cast<double>().cross((c - b).cast<double>()).norm() <= 1e-12 * grid.spacing * grid.spacing || a == c;
    });
    blocks_ = (grid.size.array() - 2) / cells_per_block + 1;
    const auto block_of = [&](const Eigen::Vector3d& p) {
        const Eigen::Vector3i b = ((p - origin_) / edge_).array().floor().cast<int>().max(0).min(blocks_.array() - 1);
        return std::size_t(b.x()) + std::size_t(blocks_.x()) * (std::size_t(b.y()) + std::size_t(blocks_.y()) * std::size_t(b.z()));
    };
    start_.assign(std::size_t(blocks_.prod()) + 1, 0);
    std::vector<std::size_t> block;
    for (const Eigen::Vector3i& t : mesh.triangles) {
        block.push_back(block_of((mesh.vertices[std::size_t(t[0])] + mesh.vertices[std::size_t(t[1])] + mesh.vertices[std::size_t(t[2])]) / 3.0));
        ++start_[block.back() + 1];
    }
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    balls_.resize(mesh.triangles.size());
    corners_.resize(mesh.triangles.size());
    std::vector<std::int32_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t n = 0; n < mesh.triangles.size(); ++n) {
        const std::size_t to = std::size_t(next[block[n]]++);
        Eigen::Vector3f centre = Eigen::Vector3f::Zero();
        for (int c = 0; c < 3; ++c) {
            const Eigen::Vector3f p = mesh.vertices[std::size_t(mesh.triangles[n][c])].cast<float>();
            for (int k = 0; k < 3; ++k) corners_[to].at[3 * c + k] = p[k];
            centre += p / 3.0f;
        }
        float radius = 0.0f;
        for (int c = 0; c < 3; ++c) radius = std::max(radius, (Eigen::Map<const Eigen::Vector3f>(corners_[to].at + 3 * c) - centre).norm());
        balls_[to] = {centre.x(), centre.y(), centre.z(), radius + 1e-4f * float(grid.spacing)};
    }
}

Facets::Facets(const sdf::DistanceGrid& grid, const Eigen::Vector3d& point, double distance) : Facets(cut_out(grid, point, distance)) {}

std::size_t Facets::memory() const
{
    return balls_.size() * (sizeof(Ball) + sizeof(Corners)) + start_.size() * sizeof(std::int32_t);
}

template <class Visit>
void Facets::for_each_near(const Eigen::Vector3d& point, double distance, const Visit& visit) const
{
    // A triangle belongs to the block of its centroid and reaches at most a cell's diagonal beyond it.
    const double wide = distance + 2.0 * edge_ / cells_per_block;
    const auto block = [&](const Eigen::Array3d& p) { return Eigen::Vector3i((p / edge_).floor().cast<int>()); };
    const Eigen::Vector3i low = block((point - origin_).array() - wide).cwiseMax(0), high = block((point - origin_).array() + wide).cwiseMin((blocks_.array() - 1).matrix());
    if (low.x() > high.x()) return;
    for (int k = low.z(); k <= high.z(); ++k)
        for (int j = low.y(); j <= high.y(); ++j) {
            const std::size_t row = std::size_t(blocks_.x()) * (std::size_t(j) + std::size_t(blocks_.y()) * std::size_t(k));
            for (std::int32_t t = start_[row + std::size_t(low.x())]; t < start_[row + std::size_t(high.x()) + 1]; ++t) {
                const Ball& ball = balls_[std::size_t(t)];
                const double reach = distance + double(ball.radius);
                if ((Eigen::Vector3d(ball.x, ball.y, ball.z) - point).squaredNorm() < reach * reach) visit(t);
            }
        }
}

void Facets::gather(const Eigen::Vector3d& point, double distance, std::vector<Near>& list) const
{
    const std::size_t begin = list.size();
    for_each_near(point, distance, [&](std::int32_t t) {
        if (const double d = clearance(t, point); d < distance) list.push_back({t, float(d)});
    });
    std::sort(list.begin() + std::ptrdiff_t(begin), list.end(),
              [](const Near& a, const Near& b) { return a.clearance < b.clearance || (a.clearance == b.clearance && a.triangle < b.triangle); });
}

double Facets::nearest(const Eigen::Vector3d& point, double distance) const
{
    double least = distance;
    for_each_near(point, distance, [&](std::int32_t t) { least = std::min(least, clearance(t, point)); });
    return least;
}

/// The distance, rounded down. A bound that is seldom below it pays: what it lets through is looked at in every step.
double Facets::clearance(std::int32_t triangle, const Eigen::Vector3d& point) const
{
    const float* at = corners_[std::size_t(triangle)].at;
    const Eigen::Vector3d corner[] = {Eigen::Vector3d(at[0], at[1], at[2]) - point, Eigen::Vector3d(at[3], at[4], at[5]) - point,
                                      Eigen::Vector3d(at[6], at[7], at[8]) - point};
    const Eigen::Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    bool above = true;
    double squared = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d side = corner[(k + 1) % 3] - corner[k];
        above = above && corner[k].dot(side.cross(normal)) >= 0.0;
        const double along = std::clamp(-corner[k].dot(side) / side.squaredNorm(), 0.0, 1.0);
        squared = std::min(squared, (corner[k] + along * side).squaredNorm());
    }
    return (1.0 - 1e-6) * (above ? std::abs(normal.dot(corner[0])) : std::sqrt(squared));
}

void Facets::lay_out(std::span<const Near> list, std::vector<FacetQuad>& quads) const
{
    quads.resize((list.size() + lane_count - 1) / lane_count);
    for (std::size_t n = 0; n < lane_count * quads.size(); ++n) {
        FacetQuad& quad = quads[n / lane_count];
        const int lane = int(n % lane_count);
        if (lane == 0) quad.clearance = double(list[n].clearance);
        if (n >= list.size()) {
            quad.clear(lane);
            continue;
        }
        const float* at = corners_[std::size_t(list[n].triangle)].at;
        quad.set(lane, {at[0], at[1], at[2]}, {at[3], at[4], at[5]}, {at[6], at[7], at[8]});
    }
}

}  // namespace coral::dem::detail
