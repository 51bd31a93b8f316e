#include "dem/detail/facets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "sdf/mesh.h"

namespace coral::dem::detail {

namespace {

constexpr int cells_per_block = 4;

/// Integrals over the part of a plane figure that lies in the disc of squared radius a2 about the origin, gathered edge by edge
/// (Green): area, polar moment, and first moment.
struct DiscPart {
    double a2, area = 0.0, polar = 0.0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();

    /// Sector of the disc between two points of a line at the distance e.
    void arc(double e, double from, double to)
    {
        const double angle = std::atan2(e * (to - from), e * e + from * to);
        area += 0.5 * a2 * angle;
        polar += 0.25 * a2 * a2 * angle;
    }

    /// Edge on the line at the distance e (positive: the origin lies on the inner side) along `outward`, from t1 to t2 > t1.
    void edge(double e, double t1, double t2, const Eigen::Vector3d& outward)
    {
        const double half2 = a2 - e * e;
        if (half2 <= 0.0) {
            arc(e, t1, t2);
            return;
        }
        double low = t1, high = t2;
        if (t1 * t1 > half2 || t2 * t2 > half2) {
            const double half = std::sqrt(half2);
            low = std::clamp(-half, t1, t2);
            high = std::clamp(half, t1, t2);
            if (low > t1) arc(e, t1, low);
            if (high < t2) arc(e, high, t2);
        }
        const double length = high - low, cube = (high * high * high - low * low * low) / 3.0;
        area += 0.5 * e * length;
        polar += 0.25 * e * (e * e * length + cube);
        first += (0.5 * (cube - half2 * length)) * outward;
    }
};

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

std::size_t Facets::memory() const
{
    return balls_.size() * (sizeof(Ball) + sizeof(Corners)) + start_.size() * sizeof(std::int32_t);
}

void Facets::gather(const Eigen::Vector3d& point, double distance, std::vector<std::int32_t>& list) const
{
    // A triangle belongs to the block of its centroid and reaches at most a cell's diagonal beyond it.
    const double wide = distance + 2.0 * edge_ / cells_per_block;
    const Eigen::Vector3i low = ((point - origin_).array() - wide).unaryExpr([&](double v) { return std::floor(v / edge_); }).cast<int>().max(0);
    const Eigen::Vector3i high =
        ((point - origin_).array() + wide).unaryExpr([&](double v) { return std::floor(v / edge_); }).cast<int>().min(blocks_.array() - 1);
    for (int k = low.z(); k <= high.z(); ++k)
        for (int j = low.y(); j <= high.y(); ++j) {
            if (low.x() > high.x()) return;
            const std::size_t row = std::size_t(blocks_.x()) * (std::size_t(j) + std::size_t(blocks_.y()) * std::size_t(k));
            for (std::int32_t t = start_[row + std::size_t(low.x())]; t < start_[row + std::size_t(high.x()) + 1]; ++t) {
                const Ball& b = balls_[std::size_t(t)];
                const double reach = distance + double(b.radius);
                if ((point - Eigen::Vector3d(b.x, b.y, b.z)).squaredNorm() < reach * reach) list.push_back(t);
            }
        }
}

bool Facets::press(std::int32_t triangle, const Eigen::Vector3d& centre, double radius, Press& press) const
{
    const Ball& ball = balls_[std::size_t(triangle)];
    const double cx = centre.x(), cy = centre.y(), cz = centre.z();
    const double bx = double(ball.x) - cx, by = double(ball.y) - cy, bz = double(ball.z) - cz;
    const double reach = radius + double(ball.radius), away2 = bx * bx + by * by + bz * bz;
    if (away2 >= reach * reach) return false;
    // In a close-fitting void most of the surface is near and little of it touches: rejected before any root is taken, in plain numbers
    // (short vectors go through memory here, six times slower).
    const float* at = corners_[std::size_t(triangle)].at;
    const double ux = double(at[3]) - at[0], uy = double(at[4]) - at[1], uz = double(at[5]) - at[2];
    const double vx = double(at[6]) - at[0], vy = double(at[7]) - at[1], vz = double(at[8]) - at[2];
    const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    const double px = at[0] - cx, py = at[1] - cy, pz = at[2] - cz;
    const double twice2 = nx * nx + ny * ny + nz * nz, lift = nx * px + ny * py + nz * pz;
    if (lift * lift >= radius * radius * twice2) return false;
    const double scale = 1.0 / std::sqrt(twice2), height = lift * scale;
    DiscPart part{radius * radius - height * height};
    const double disc = std::sqrt(part.a2) + double(ball.radius);
    if (away2 - height * height >= disc * disc) return false;
    const Eigen::Vector3d normal(scale * nx, scale * ny, scale * nz), u(ux, uy, uz), v(vx, vy, vz), p(px, py, pz);
    const Eigen::Vector3d corner[3] = {p, p + u, p + v}, side[3] = {u, v - u, -v};
    for (int c = 0; c < 3; ++c) {
        const double length = side[c].norm();
        const Eigen::Vector3d along = side[c] / length, outward = along.cross(normal);
        const double t1 = along.dot(corner[c]);
        part.edge(outward.dot(corner[c]), t1, t1 + length, outward);
    }
    press.force = (height * part.area * normal + part.first) / -radius;
    press.energy = 0.5 * (part.a2 * part.area - part.polar) / radius;
    return part.area > 0.0 && press.energy > 0.0;
}

}  // namespace coral::dem::detail
