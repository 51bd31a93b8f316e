#include "dem/detail/facets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "sdf/mesh.h"

namespace coral::dem::detail {

namespace {

constexpr int cells_per_block = 4;

sdf::DistanceGrid cut_out(const sdf::DistanceGrid& grid, const Eigen::Vector3d& point, double distance)
{
    const auto cell = [&](const Eigen::Array3d& p) { return Eigen::Array3i(((p - grid.origin.array()) / grid.spacing).floor().cast<int>()); };
    const Eigen::Array3i last = grid.size.array() - 2;
    const Eigen::Vector3i low = cell(point.array() - distance).max(0).min(last), high = cell(point.array() + distance).max(0).min(last);
    sdf::DistanceGrid part;
    part.size = high - low + Eigen::Vector3i::Constant(2);
    part.origin = grid.node(low.x(), low.y(), low.z());
    part.spacing = grid.spacing;
    part.distance.reserve(part.node_count());
    for (int k = 0; k < part.size.z(); ++k)
        for (int j = 0; j < part.size.y(); ++j) {
            const auto row = grid.distance.begin() + std::ptrdiff_t(grid.index(low.x(), low.y() + j, low.z() + k));
            part.distance.insert(part.distance.end(), row, row + part.size.x());
        }
    return part;
}

/// Integrals over the part of a triangle that lies in the disc of squared radius a2 about the origin of its plane, gathered edge by edge
/// (Green): area, polar moment, and first moment. Angles of the arcs are multiplied up as complex numbers, so that one arc tangent serves.
struct DiscPart {
    double a2, area = 0.0, polar = 0.0, first_x = 0.0, first_y = 0.0;
    double turn_re = 1.0, turn_im = 0.0;
    bool arcs = false, inside = true;  ///< some arc may be in the triangle; the whole disc is

    void arc(double e, double from, double to)
    {
        const double re = e * e + from * to, im = e * (to - from), t = turn_re * re - turn_im * im;
        turn_im = turn_re * im + turn_im * re;
        turn_re = t;
        arcs = true;
    }

    /// From (px, py) to (qx, qy), the triangle on the left.
    void edge(double px, double py, double qx, double qy)
    {
        const double dx = qx - px, dy = qy - py, inverse = 1.0 / std::sqrt(dx * dx + dy * dy), ux = dx * inverse, uy = dy * inverse;
        const double e = px * uy - py * ux, t1 = px * ux + py * uy, t2 = qx * ux + qy * uy, half2 = a2 - e * e;
        if (half2 <= 0.0) {
            inside = inside && e > 0.0;
            arc(e, t1, t2);
            return;
        }
        inside = false;
        double low = t1, high = t2;
        if (t1 * t1 > half2 || t2 * t2 > half2) {
            const double half = std::sqrt(half2);
            low = std::clamp(-half, t1, t2);
            high = std::clamp(half, t1, t2);
            if (low > t1) arc(e, t1, low);
            if (high < t2) arc(e, high, t2);
        }
        const double length = high - low, cube = (high * high * high - low * low * low) * (1.0 / 3.0);
        const double push = 0.5 * (cube - half2 * length);
        area += 0.5 * e * length;
        polar += 0.25 * e * (e * e * length + cube);
        first_x += push * uy;
        first_y -= push * ux;
    }

    void close()
    {
        if (!arcs) return;
        double angle = std::atan2(turn_im, turn_re);
        // Between 0 and 2 pi; rounding must not make one of the other.
        if (inside) angle = 2.0 * std::numbers::pi;
        else if (angle < -1e-6) angle += 2.0 * std::numbers::pi;
        area += 0.5 * a2 * angle;
        polar += 0.25 * a2 * a2 * angle;
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

Facets::Facets(const sdf::DistanceGrid& grid, const Eigen::Vector3d& point, double distance) : Facets(cut_out(grid, point, distance)) {}

std::size_t Facets::memory() const
{
    return balls_.size() * (sizeof(Ball) + sizeof(Corners)) + start_.size() * sizeof(std::int32_t);
}

void Facets::gather(const Eigen::Vector3d& point, double distance, std::vector<Near>& list) const
{
    // A triangle belongs to the block of its centroid and reaches at most a cell's diagonal beyond it.
    const double wide = distance + 2.0 * edge_ / cells_per_block;
    const auto block = [&](const Eigen::Array3d& p) { return Eigen::Vector3i((p / edge_).floor().cast<int>()); };
    const Eigen::Vector3i low = block((point - origin_).array() - wide).cwiseMax(0), high = block((point - origin_).array() + wide).cwiseMin((blocks_.array() - 1).matrix());
    if (low.x() > high.x()) return;
    const std::size_t begin = list.size();
    for (int k = low.z(); k <= high.z(); ++k)
        for (int j = low.y(); j <= high.y(); ++j) {
            const std::size_t row = std::size_t(blocks_.x()) * (std::size_t(j) + std::size_t(blocks_.y()) * std::size_t(k));
            for (std::int32_t t = start_[row + std::size_t(low.x())]; t < start_[row + std::size_t(high.x()) + 1]; ++t)
                if (const double d = clearance(t, point); d < distance) list.push_back({t, float(d)});
        }
    std::sort(list.begin() + std::ptrdiff_t(begin), list.end(),
              [](const Near& a, const Near& b) { return a.clearance < b.clearance || (a.clearance == b.clearance && a.triangle < b.triangle); });
}

/// Lower bound of the distance: to the part of the plane within the ball around the triangle.
double Facets::clearance(std::int32_t triangle, const Eigen::Vector3d& point) const
{
    const Ball& ball = balls_[std::size_t(triangle)];
    const float* at = corners_[std::size_t(triangle)].at;
    const Eigen::Vector3d a(at[0], at[1], at[2]), b(at[3], at[4], at[5]), c(at[6], at[7], at[8]);
    const double height = (b - a).cross(c - a).normalized().dot(a - point), away2 = (Eigen::Vector3d(ball.x, ball.y, ball.z) - point).squaredNorm();
    const double beside = std::sqrt(std::max(away2 - height * height, 0.0)) - double(ball.radius);
    return (1.0 - 1e-6) * std::hypot(height, std::max(beside, 0.0));  // rounding stays on the safe side
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
    const double qx = px + ux, qy = py + uy, qz = pz + uz, sx = px + vx, sy = py + vy, sz = pz + vz, r2 = radius * radius;
    const double pp = px * px + py * py + pz * pz, qq = qx * qx + qy * qy + qz * qz, ss = sx * sx + sy * sy + sz * sz;
    if (std::max({pp, qq, ss}) <= r2) {
        // All of the triangle: int x dA = A sum v/3, int |x|^2 dA = A (sum |v|^2 + sum v.v')/6 over its corners.
        const double area = 0.5 * std::sqrt(twice2), share = -area / (3.0 * radius);
        const double mixed = px * qx + py * qy + pz * qz + qx * sx + qy * sy + qz * sz + sx * px + sy * py + sz * pz;
        press.force = {share * (px + qx + sx), share * (py + qy + sy), share * (pz + qz + sz)};
        press.energy = 0.5 * area / radius * (r2 - (pp + qq + ss + mixed) / 6.0);
        return area > 0.0 && press.energy > 0.0;
    }
    const double scale = 1.0 / std::sqrt(twice2), height = lift * scale;
    DiscPart part{radius * radius - height * height};
    const double disc = std::sqrt(part.a2) + double(ball.radius);
    if (away2 - height * height >= disc * disc) return false;
    // In the plane: x along the first side, from the foot of the centre.
    const double along = 1.0 / std::sqrt(ux * ux + uy * uy + uz * uz), ex = ux * along, ey = uy * along, ez = uz * along;
    const double mx = scale * nx, my = scale * ny, mz = scale * nz;
    const double fx = my * ez - mz * ey, fy = mz * ex - mx * ez, fz = mx * ey - my * ex;
    const double ax = px * ex + py * ey + pz * ez, ay = px * fx + py * fy + pz * fz, bx2 = ax + 1.0 / along;
    const double cx2 = ax + vx * ex + vy * ey + vz * ez, cy2 = ay + vx * fx + vy * fy + vz * fz;
    part.edge(ax, ay, bx2, ay);
    part.edge(bx2, ay, cx2, cy2);
    part.edge(cx2, cy2, ax, ay);
    part.close();
    const double up = height * part.area, share = -1.0 / radius;
    press.force = {share * (up * mx + part.first_x * ex + part.first_y * fx), share * (up * my + part.first_x * ey + part.first_y * fy),
                   share * (up * mz + part.first_x * ez + part.first_y * fz)};
    press.energy = 0.5 * (part.a2 * part.area - part.polar) / radius;
    return part.area > 0.0 && press.energy > 0.0;
}

}  // namespace coral::dem::detail
