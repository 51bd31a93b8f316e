#include "morph/detail/throat.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "morph/surface.h"

namespace coral::morph::detail {
namespace {

/// The box around the constriction, void beyond the box of the grain; `corner` is its lowest voxel.
Mask cut(const Mask& box, const Eigen::Vector3i& corner, const Eigen::Vector3i& size)
{
    Mask out = make_mask(size, box.voxel_size);
    for (int k = 0; k < size.z(); ++k)
        for (int j = 0; j < size.y(); ++j)
            for (int i = 0; i < size.x(); ++i) {
                const Eigen::Vector3i v = corner + Eigen::Vector3i(i, j, k);
                if ((v.array() < 0).any() || (v.array() >= box.size.array()).any()) continue;
                out.voxels[out.index(i, j, k)] = box.voxels[box.index(v.x(), v.y(), v.z())];
            }
    return out;
}

/// Surface points near a constriction and the room that a ball has among them.
class Room {
public:
    /// \param reach  of the points kept, from `middle`
    /// \param passes  of averaging, each over some 0.8 voxel
    Room(const SurfaceMesh& walls, const Eigen::Vector3d& middle, double reach, int passes) : points_(walls.vertices), passes_(passes)
    {
        std::vector<std::uint8_t> near(points_.size());
        for (std::size_t p = 0; p < points_.size(); ++p) near[p] = (points_[p] - middle).norm() < reach;
        for (const auto& t : walls.triangles)
            for (std::size_t n = 0; n < 3; ++n) {  // closed surface: each edge once in either direction
                const std::uint32_t a = t[n], b = t[(n + 1) % 3];
                if (near[a] && near[b]) links_.push_back({a, b});
            }
        std::sort(links_.begin(), links_.end());
        distance_.resize(points_.size());
        for (std::size_t p = 0; p < points_.size(); ++p)
            if (near[p]) near_.push_back(std::uint32_t(p));
    }
    bool empty() const { return near_.empty(); }
    /// Distance to the nearest of the walls, each averaged over its surroundings: a ball stopped by the steps of voxels alone would be
    /// too small by twice their height.
    double radius(const Eigen::Vector3d& centre) const
    {
        for (const std::uint32_t p : near_) distance_[p] = (points_[p] - centre).norm();
        for (int n = 0; n < passes_; ++n) average();
        double least = std::numeric_limits<double>::infinity();
        for (const std::uint32_t p : near_) least = std::min(least, distance_[p]);
        return least;
    }
    /// Direction in which the surface within `margin` of touching faces the ball least.
    Eigen::Vector3d along(const Eigen::Vector3d& centre, double radius, double margin) const
    {
        const double most = radius + margin;
        Eigen::Matrix3d facing = Eigen::Matrix3d::Zero();
        for (const std::uint32_t p : near_)
            if (const Eigen::Vector3d r = points_[p] - centre; r.squaredNorm() < most * most) facing += r * r.transpose() / r.squaredNorm();
        return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(facing).eigenvectors().col(0);
    }

private:
    /// Replaces each distance by the mean of its own and those of the vertices linked to it.
    void average() const
    {
        averaged_ = distance_;
        std::size_t l = 0;
        for (const std::uint32_t p : near_) {
            int count = 1;
            for (; l < links_.size() && links_[l][0] == p; ++l, ++count) averaged_[p] += distance_[links_[l][1]];
            averaged_[p] /= count;
        }
        distance_.swap(averaged_);
    }

    const std::vector<Eigen::Vector3d>& points_;
    int passes_;
    std::vector<std::uint32_t> near_;
    std::vector<std::array<std::uint32_t, 2>> links_;  ///< sorted
    mutable std::vector<double> distance_, averaged_;
};

/// A ball that was moved across a throat to where it has the most room.
struct Fitted {
    Eigen::Vector3d centre;
    double radius;
    Eigen::Vector3d axis;  ///< of the throat
};

/// \param farthest  from the start
Fitted fit_across(const Room& room, const Eigen::Vector3d& start, double c, double farthest)
{
    constexpr double d = std::numbers::sqrt2 / 2;
    constexpr std::array<std::array<double, 2>, 8> around{{{1, 0}, {d, d}, {0, 1}, {-d, d}, {-1, 0}, {-d, -d}, {0, -1}, {d, -d}}};
    Fitted ball{start, room.radius(start), Eigen::Vector3d::UnitX()};
    for (double step = 0.4 * c; step > 0.01 * c; step *= 0.5) {
        ball.axis = room.along(ball.centre, ball.radius, c);
        const Eigen::Vector3d u = ball.axis.unitOrthogonal(), v = ball.axis.cross(u);
        for (bool wider = true; wider;) {
            wider = false;
            for (const auto& [along_u, along_v] : around) {
                const Eigen::Vector3d trial = ball.centre + step * (along_u * u + along_v * v);
                if ((trial - start).norm() > farthest) continue;
                if (const double r = room.radius(trial); r > ball.radius) {
                    ball.radius = r;
                    ball.centre = trial;
                    wider = true;
                }
            }
        }
    }
    return ball;
}

}  // namespace

double throat_diameter(const Closing& closing, std::size_t saddle, float radius)
{
    const Mask& box = closing.box;
    const double c = mean_edge(box);
    const std::size_t nx = std::size_t(box.size.x()), ny = std::size_t(box.size.y());
    const Eigen::Vector3i voxel(int(saddle % nx), int(saddle / nx % ny), int(saddle / (nx * ny)));
    const Eigen::Vector3i half = ((double(radius) + 3.0) * c * box.voxel_size.cwiseInverse()).array().ceil().cast<int>();
    const SurfaceMesh walls = extract_surface(cut(box, voxel - half, 2 * half + Eigen::Vector3i::Ones()));
    const Eigen::Vector3d start = (half.cast<double>().array() + 0.5).matrix().cwiseProduct(box.voxel_size);
    // Steps of voxels on the wall of a wide throat are long: the wider it is, the more of them are averaged.
    const Room room(walls, start, (double(radius) + 3.0) * c, std::clamp(int(radius / 2.0F), 1, 6));
    if (room.empty()) return 2.0 * c * double(radius);
    const double farthest = box.voxel_size.maxCoeff();
    const Fitted ball = fit_across(room, start, c, farthest);
    // The narrowest place lies within a voxel of where the lattice sees it; at the rim of a throat the ball could slip out otherwise.
    double narrowest = ball.radius;
    for (const double shift : {-1.0, -0.5, 0.5, 1.0})
        narrowest = std::min(narrowest, fit_across(room, ball.centre + shift * c * ball.axis, c, farthest).radius);
    // A ball gains at most half the diagonal of a voxel by leaving the lattice, and loses what lies between the centres of solid voxels and
    // their surface; more means that it found a way out of a short throat.
    constexpr double most_gained = 0.55;
    return 2.0 * std::min(narrowest, (double(radius) + most_gained) * c);
}

}  // namespace coral::morph::detail
