#include "sh/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "sh/quadrature.h"

namespace coral::sh {
namespace {

constexpr Eigen::Index block = 64;       // samples scanned at once
constexpr std::size_t most_starts = 12;  // near the centre of a ball every sample is as near as the next
constexpr int most_steps = 40;

/// The directions lie in order of falling z: those within an angle of u are in a band.
template <class Take>
void each_within(const std::vector<Eigen::Vector3d>& directions, const Eigen::Vector3d& u, double angle, const Take& take)
{
    const int count = int(directions.size());
    const double polar = std::acos(std::clamp(u.z(), -1.0, 1.0));
    const auto row = [&](double theta) { return int(std::floor((1.0 - std::cos(std::clamp(theta, 0.0, std::numbers::pi))) * 0.5 * count)); };
    const int last = std::min(row(polar + angle) + 1, count - 1);
    const double nearest = std::cos(angle);
    for (int j = std::max(row(polar - angle) - 1, 0); j <= last; ++j)
        if (const double cosine = u.dot(directions[std::size_t(j)]); cosine >= nearest) take(j, cosine);
}

/// Two tangents that complete u to a basis.
Eigen::Matrix<double, 3, 2> tangents(const Eigen::Vector3d& u)
{
    Eigen::Matrix<double, 3, 2> E;
    E.col(0) = u.unitOrthogonal();
    E.col(1) = u.cross(E.col(0));
    return E;
}

/// Newton's step of a 2 x 2 system made positive definite: eigenvalues by their magnitude, none below a small part of the larger.
Eigen::Vector2d newton_step(const Eigen::Matrix2d& H, const Eigen::Vector2d& g)
{
    const double middle = 0.5 * (H(0, 0) + H(1, 1)), half = 0.5 * (H(0, 0) - H(1, 1)), root = std::hypot(half, H(0, 1));
    const double low = middle - root, high = middle + root, largest = std::max(std::abs(low), std::abs(high));
    if (largest == 0) return Eigen::Vector2d::Zero();
    const double floor = 1e-8 * largest;
    if (low > floor) {
        const double determinant = H(0, 0) * H(1, 1) - H(0, 1) * H(0, 1);
        return -Eigen::Vector2d(H(1, 1) * g[0] - H(0, 1) * g[1], H(0, 0) * g[1] - H(0, 1) * g[0]) / determinant;
    }
    // Eigenvector of `high`, from the row of H - low that is farther from zero.
    Eigen::Vector2d e = half >= 0 ? Eigen::Vector2d(half + root, H(0, 1)) : Eigen::Vector2d(H(0, 1), root - half);
    e = root > 0 ? e.normalized() : Eigen::Vector2d::UnitX();
    const Eigen::Vector2d n(-e[1], e[0]);
    return -e * (e.dot(g) / std::max(std::abs(high), floor)) - n * (n.dot(g) / std::max(std::abs(low), floor));
}

}  // namespace

SurfaceDistance::SurfaceDistance(const Surface& surface, int samples) : evaluator_(surface)
{
    const int degree = surface.degree, count = samples > 0 ? std::max(samples, 32) : spread_count(degree);
    directions_ = spread_directions(count);
    const Eigen::Index padded = (count + block - 1) / block * block;
    px_ = py_ = pz_ = Eigen::ArrayXf::Constant(padded, 1e18f);
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < count; ++i) {
        const Eigen::Vector3d& u = directions_[std::size_t(i)];
        const double r = evaluator_.radius(u);
        if (!(r > 0)) throw Error("harmonic surface", "its radius is not positive everywhere", "take another degree");
        points.push_back(r * u);
        px_[i] = float(points.back().x()), py_[i] = float(points.back().y()), pz_[i] = float(points.back().z());
    }
    // A sample stands for the surface within about half a spacing: as far as its neighbours are, and a little for what bulges between.
    const double spacing = std::sqrt(4.0 * std::numbers::pi / count);
    neighbours_.resize(std::size_t(count));
    reach_.resize(std::size_t(count));
    std::vector<std::pair<double, int>> around;
    for (int i = 0; i < count; ++i) {
        around.clear();
        each_within(directions_, directions_[std::size_t(i)], 2.2 * spacing, [&](int j, double cosine) {
            if (j != i) around.emplace_back(-cosine, j);
        });
        std::ranges::sort(around);
        double farthest = 0;
        for (int n = 0; n < neighbour_count; ++n) {
            const int j = n < int(around.size()) ? around[std::size_t(n)].second : i;
            neighbours_[std::size_t(i)][std::size_t(n)] = j;
            if (n < 6) farthest = std::max(farthest, (points[std::size_t(j)] - points[std::size_t(i)]).norm());
        }
        reach_[std::size_t(i)] = float(0.75 * farthest);
        largest_reach_ = std::max(largest_reach_, reach_[std::size_t(i)]);
    }
    step_limit_ = 2.0 * spacing;
}

/// Samples nearer than their neighbours whose cell may hold the nearest point: distance and number, nearest first.
void SurfaceDistance::gather_starts(const Eigen::Vector3f& x, std::vector<std::pair<float, int>>& starts) const
{
    thread_local Eigen::ArrayXf squares;
    thread_local std::vector<float> lowest;
    const Eigen::Index count = px_.size();
    squares.resize(count);
    lowest.resize(std::size_t(count / block));
    float least = std::numeric_limits<float>::max();
    for (Eigen::Index b = 0; b < count; b += block) {
        auto part = squares.segment<block>(b);
        part = (px_.segment<block>(b) - x.x()).square() + (py_.segment<block>(b) - x.y()).square() + (pz_.segment<block>(b) - x.z()).square();
        lowest[std::size_t(b / block)] = part.minCoeff();
        least = std::min(least, lowest[std::size_t(b / block)]);
    }
    const float nearest = std::sqrt(least), bound = nearest + largest_reach_;
    starts.clear();
    for (Eigen::Index b = 0; b < count; b += block) {
        if (lowest[std::size_t(b / block)] > bound * bound) continue;
        for (Eigen::Index i = b; i < b + block; ++i) {
            if (squares[i] > bound * bound) continue;
            const auto& around = neighbours_[std::size_t(i)];
            if (std::ranges::any_of(around, [&](int j) { return squares[j] < squares[i]; })) continue;
            if (const float d = std::sqrt(squares[i]); d <= nearest + reach_[std::size_t(i)]) starts.emplace_back(d, int(i));
        }
    }
    std::ranges::sort(starts);
    if (starts.size() > most_starts) starts.resize(most_starts);
}

/// Newton's method for f(u) = r^2/2 - r y.u, whose derivatives on the sphere are
///     grad = (r - y.u) grad r - r y_t,   hess = grad r grad r^T - grad r y_t^T - y_t grad r^T + (r - y.u) hess r + r (y.u) P,
/// y_t = P y. Moves u; returns the squared distance |y - r u|^2.
double SurfaceDistance::descend(const Eigen::Vector3d& y, Eigen::Vector3d& u) const
{
    Eigen::Vector3d slope, next_slope;
    Eigen::Matrix3d curve, next_curve;
    double r = evaluator_.radius(u, slope, curve), value = (y - r * u).squaredNorm();
    for (int n = 0; n < most_steps; ++n) {
        const double along = y.dot(u), gap = r - along;
        const Eigen::Matrix<double, 3, 2> E = tangents(u);
        const Eigen::Vector2d gr = E.transpose() * slope, yt = E.transpose() * y, g = gap * gr - r * yt;
        const Eigen::Matrix2d cross = gr * yt.transpose();
        Eigen::Matrix2d H = gr * gr.transpose() - cross - cross.transpose() + gap * (E.transpose() * curve * E);
        H.diagonal().array() += r * along;
        Eigen::Vector2d step = newton_step(H, g);
        double length = step.norm();
        if (length > step_limit_) step *= step_limit_ / length, length = step_limit_;
        bool nearer = false;
        for (int halving = 0; halving < 30 && length > 1e-13; ++halving, step *= 0.5, length *= 0.5) {
            const Eigen::Vector3d next = (u + E * step).normalized();
            const double next_r = evaluator_.radius(next, next_slope, next_curve), next_value = (y - next_r * next).squaredNorm();
            if (next_value > value + 1e-15 * (value + r * r)) continue;
            nearer = true;
            u = next, r = next_r, slope = next_slope, curve = next_curve, value = next_value;
            break;
        }
        if (!nearer || length < 1e-6) break;  // the next step would be its square
    }
    return value;
}

SurfaceDistance::Foot SurfaceDistance::finish(const Eigen::Vector3d& x, const Eigen::Vector3d& u) const
{
    Foot foot;
    foot.direction = u;
    foot.point = evaluator_.point(u, foot.normal);
    const double length = (x - foot.point).norm();
    foot.distance = evaluator_.radial_distance(x) < 0 ? -length : length;
    return foot;
}

SurfaceDistance::Foot SurfaceDistance::foot(const Eigen::Vector3d& x) const
{
    thread_local std::vector<std::pair<float, int>> starts;
    const Eigen::Vector3d y = x - evaluator_.surface().centre;
    gather_starts(y.cast<float>(), starts);
    double least = std::numeric_limits<double>::infinity();
    Eigen::Vector3d best = Eigen::Vector3d::UnitZ();
    for (const auto& [d, i] : starts) {
        const double bound = double(d) - double(reach_[std::size_t(i)]);
        if (bound > 0 && bound * bound > least) continue;
        Eigen::Vector3d u = directions_[std::size_t(i)];
        if (const double value = descend(y, u); value < least) least = value, best = u;
    }
    return finish(x, best);
}

SurfaceDistance::Foot SurfaceDistance::foot_near(const Eigen::Vector3d& x, const Eigen::Vector3d& guess) const
{
    Eigen::Vector3d u = guess.normalized();
    descend(x - evaluator_.surface().centre, u);
    return finish(x, u);
}

}  // namespace coral::sh
