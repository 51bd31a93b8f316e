// Surface nodes of convex polyhedra: faces cut into strips along their edges, strips cut across.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "core/error.h"
#include "dem/polyhedron.h"

namespace coral::dem {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Polygon = std::vector<Vector2d>;  ///< convex, counter-clockwise

// Where the strips along the rim end, and how far a corner's part of an edge reaches. At an overlap d a corner has about 4.5 d^2 of surface in
// the other body and an edge 2.8 d a length: nodes on them must not stand for much more at the overlaps that occur, whatever the spacing.
constexpr double rim_width = 0.1, second_rim = 0.4;         ///< of the spacing
constexpr double widest_rim = 0.005, longest_corner = 0.01;  ///< of the diameter

/// The part of a convex polygon with n.p <= offset.
Polygon clipped(const Polygon& polygon, const Vector2d& n, double offset)
{
    Polygon kept;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Vector2d &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
        const double ha = n.dot(a) - offset, hb = n.dot(b) - offset;
        if (ha <= 0.0) kept.push_back(a);
        if ((ha < 0.0 && hb > 0.0) || (ha > 0.0 && hb < 0.0)) kept.push_back(a + ha / (ha - hb) * (b - a));
    }
    return kept;
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Area, and the centroid if there is any.
double area_and_centroid(const Polygon& polygon, Vector2d& centroid)
{
    double twice = 0.0;
    Vector2d moment = Vector2d::Zero();
    for (std::size_t k = 2; k < polygon.size(); ++k) {
        const Vector2d a = polygon[k - 1] - polygon[0], b = polygon[k] - polygon[0];
        const double c = cross(a, b);
        twice += c;
        moment += c / 3.0 * (a + b);
    }
    if (twice > 0.0) centroid = polygon[0] + moment / twice;
    return 0.5 * twice;
}

/// Where strips parallel to an edge end, out to the width of its part of the face.
std::vector<double> strip_ends(double width, double spacing, double diameter)
{
    std::vector<double> ends;
    for (const double rim : {std::min(rim_width * spacing, widest_rim * diameter), second_rim * spacing})
        if (rim < 0.8 * width) ends.push_back(rim);
    const double start = ends.empty() ? 0.0 : ends.back();
    const int count = std::max(1, int(std::lround((width - start) / spacing)));
    for (int k = 1; k <= count; ++k) ends.push_back(start + (width - start) * k / count);
    return ends;
}

/// Gathers the nodes of all faces; those on edges and vertices are shared.
class Cutter {
public:
    Cutter(const Polyhedron& body, double spacing)
        : body_(body), spacing_(spacing), diameter_(std::cbrt(6.0 * body.volume() / std::numbers::pi))
    {
    }

    SurfaceNodes cut()
    {
        for (std::size_t f = 0; f < body_.faces().size(); ++f) cut_face(int(f));
        for (const auto& [key, area] : rim_) {
            const auto [a, b, k, n] = key;
            const Vector3d &start = body_.vertices()[std::size_t(a)], along = body_.vertices()[std::size_t(b)] - start;
            const double corner = a == b ? 0.0 : corner_part(along.norm()) / along.norm();
            nodes_.positions.push_back(start + (corner + (1.0 - 2.0 * corner) * (k + 0.5) / n) * along);
            nodes_.areas.push_back(area);
        }
        return std::move(nodes_);
    }

private:
    void cut_face(int f)
    {
        const std::vector<int>& face = body_.faces()[std::size_t(f)];
        const Vector3d origin = body_.vertices()[std::size_t(face[0])], normal = body_.normal(f);
        const Vector3d u = (body_.vertices()[std::size_t(face[1])] - origin).normalized(), v = normal.cross(u);
        Polygon outline;
        for (const int k : face) {
            const Vector3d r = body_.vertices()[std::size_t(k)] - origin;
            outline.emplace_back(r.dot(u), r.dot(v));
        }
        const std::size_t n = outline.size();
        std::vector<Vector2d> inward(n);  // distance to edge i: inward[i].p - foot[i]
        std::vector<double> foot(n);
        for (std::size_t i = 0; i < n; ++i) {
            const Vector2d along = (outline[(i + 1) % n] - outline[i]).normalized();
            inward[i] = {-along.y(), along.x()};
            foot[i] = inward[i].dot(outline[i]);
        }
        for (std::size_t i = 0; i < n; ++i) {
            Polygon part = outline;  // nearer to edge i than to any other
            for (std::size_t j = 0; j < n && part.size() > 2; ++j)
                if (j != i) part = clipped(part, inward[i] - inward[j], foot[i] - foot[j]);
            if (part.size() < 3) continue;
            const auto to_space = [&](const Vector2d& p) -> Vector3d { return origin + p.x() * u + p.y() * v; };
            cut_part(part, outline[i], inward[i], face[i], face[(i + 1) % n], (outline[(i + 1) % n] - outline[i]).norm(), to_space);
        }
    }

    template <class ToSpace>
    void cut_part(const Polygon& part, const Vector2d& start, const Vector2d& inward, int a, int b, double length, const ToSpace& to_space)
    {
        const Vector2d along(inward.y(), -inward.x());
        double width = 0.0;
        for (const Vector2d& p : part) width = std::max(width, inward.dot(p - start));
        double from = 0.0;
        for (const double to : strip_ends(width, spacing_, diameter_)) {
            const Polygon strip = clipped(clipped(part, -inward, -(inward.dot(start) + from)), inward, inward.dot(start) + to);
            const bool rim = from == 0.0;
            from = to;
            if (strip.size() < 3) continue;
            double low = 1e300, high = -1e300;
            for (const Vector2d& p : strip) low = std::min(low, along.dot(p - start)), high = std::max(high, along.dot(p - start));
            // On the rim nodes lie at both ends of the edge and evenly between, for the face beyond it too; further in at the centroids.
            const double corner = rim ? corner_part(length) : 0.0;
            if (rim) low = corner, high = length - corner;
            const int n = std::max(1, int(std::lround((high - low) / spacing_)));
            const auto piece = [&](double left, double right) { return clipped(clipped(strip, -along, -(along.dot(start) + left)), along, along.dot(start) + right); };
            Vector2d centroid;
            for (int k = 0; k < n; ++k) {
                const double area = area_and_centroid(piece(low + (high - low) * k / n, low + (high - low) * (k + 1) / n), centroid);
                if (!(area > 0.0)) continue;
                if (rim) {
                    rim_[a < b ? std::array{a, b, k, n} : std::array{b, a, n - 1 - k, n}] += area;
                } else {
                    nodes_.positions.push_back(to_space(centroid));
                    nodes_.areas.push_back(area);
                }
            }
            if (!rim) continue;
            rim_[{a, a, 0, 1}] += area_and_centroid(piece(-length, corner), centroid);
            rim_[{b, b, 0, 1}] += area_and_centroid(piece(length - corner, 2.0 * length), centroid);
        }
    }

    /// Length of an edge that belongs to the corner at its end [m].
    double corner_part(double length) const { return std::min({0.25 * length, 0.5 * spacing_, longest_corner * diameter_}); }

    const Polyhedron& body_;
    double spacing_, diameter_;
    SurfaceNodes nodes_;
    std::map<std::array<int, 4>, double> rim_;  ///< edge (or vertex twice), place k of n on it
};

}  // namespace

SurfaceNodes polyhedron_nodes(const Polyhedron& polyhedron, int count)
{
    if (count < 4) throw Error("surface nodes", "a count of " + std::to_string(count), "take 4 or more");
    double spacing = std::sqrt(polyhedron.surface() / count);
    SurfaceNodes nodes;
    for (int pass = 0; pass < 6; ++pass) {
        nodes = Cutter(polyhedron, spacing).cut();
        const double ratio = double(nodes.positions.size()) / count;
        if (std::abs(ratio - 1.0) < 0.03) break;
        spacing *= std::sqrt(std::clamp(ratio, 0.25, 4.0));
    }
    return nodes;
}

}  // namespace coral::dem
