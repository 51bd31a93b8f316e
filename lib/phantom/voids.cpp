#include "phantom/voids.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"

namespace coral::phantom {

namespace {
constexpr int wave_count = 128;
constexpr int placing_tries = 400;

/// Distance from a point to the half-line of a channel [m].
double distance_to_axis(const Channel& channel, const Eigen::Vector3d& point)
{
    const Eigen::Vector3d from_start = point - channel.centre;
    const double along = std::max(from_start.dot(channel.direction), 0.0);
    return (from_start - along * channel.direction).norm();
}

Eigen::Vector3d random_point_inside(const Outline& outline, RandomSource& random)
{
    for (;;) {
        const double r = outline.outer_radius();
        const Eigen::Vector3d p(random.uniform(-r, r), random.uniform(-r, r), random.uniform(-r, r));
        if (outline.contains(p)) return p;
    }
}
}  // namespace

Voids::Voids(const VoidSpec& spec, const Outline& outline, RandomSource& random)
    : outline_(outline),
      field_(spec.wavelength * outline.equivalent_diameter(), wave_count, random),
      wall_(spec.wall * outline.equivalent_diameter()),
      surface_(outline.surface_points())
{
    level_ = std::numeric_limits<float>::infinity();
    if (spec.porosity <= 0) return;
    place_compartments(spec, random);
    place_channels(spec, random);
    place_chambers(spec, random);
    if (spec.sponge) choose_level(spec.porosity);
}

/// Seeds by farthest-of-eight draws, so that compartments are of like size; every k-th is open, none twice.
void Voids::place_compartments(const VoidSpec& spec, RandomSource& random)
{
    for (int n = 0; n < spec.compartments; ++n) {
        Eigen::Vector3d best = random_point_inside(outline_, random);
        double best_distance = -1;
        for (int attempt = 0; attempt < 8; ++attempt) {
            const Eigen::Vector3d p = random_point_inside(outline_, random);
            double nearest = std::numeric_limits<double>::infinity();
            for (const auto& seed : seeds_) nearest = std::min(nearest, (p - seed).norm());
            if (nearest > best_distance) {
                best = p;
                best_distance = nearest;
            }
        }
        seeds_.push_back(best);
        // Spreads the open ones evenly: n-th is open where the running count of open_share * n steps up.
        open_.push_back(std::floor((n + 1) * spec.open_share + 1e-9) > std::floor(n * spec.open_share + 1e-9));
    }
}

/// A ball with a wall around it fits below the surface and beside the chambers and channels placed so far.
bool Voids::has_room(const Eigen::Vector3d& centre, double radius) const
{
    if (!outline_.contains(centre)) return false;
    const double reach = radius + wall_;
    for (const auto& p : surface_) {
        if ((p - centre).squaredNorm() < reach * reach) return false;
    }
    for (const auto& c : chambers_) {
        if ((c.centre - centre).norm() < c.radius + reach) return false;
    }
    for (const auto& c : channels_) {
        if ((c.centre - centre).norm() < c.ball_radius + reach) return false;
        if (distance_to_axis(c, centre) < c.throat_radius + reach) return false;
    }
    return true;
}

void Voids::place_channels(const VoidSpec& spec, RandomSource& random)
{
    const double d = outline_.equivalent_diameter();
    for (int n = 0; n < spec.channels; ++n) {
        double throat = d * random.uniform(spec.channel_radius[0], spec.channel_radius[1]);
        for (int attempt = 0;; ++attempt) {
            if (attempt == placing_tries)
                throw UsageError("--channels", fmt::format("no room for {} channels", spec.channels),
                                 "ask for fewer or smaller ones");
            if (attempt > 0 && attempt % 50 == 0) throat *= 0.9;  // a stick has room for thinner channels only
            const double ball = throat * random.uniform(1.3, 1.8);
            const Eigen::Vector3d centre = random_point_inside(outline_, random);
            if (!has_room(centre, ball)) continue;
            const Channel channel{centre, (centre.normalized() + 0.4 * random.direction()).normalized(), throat, ball};
            const bool meets_other = std::any_of(channels_.begin(), channels_.end(), [&](const Channel& other) {
                // Along the part inside the grain, sampled at half a wall: two mouths must not merge.
                for (double s = 0; s < 2 * outline_.outer_radius(); s += wall_ / 2) {
                    const Eigen::Vector3d p = channel.centre + s * channel.direction;
                    if (distance_to_axis(other, p) < throat + other.throat_radius + wall_) return true;
                    if ((p - other.centre).norm() < throat + other.ball_radius + wall_) return true;
                }
                return false;
            });
            if (meets_other) continue;
            channels_.push_back(channel);
            break;
        }
    }
}

void Voids::place_chambers(const VoidSpec& spec, RandomSource& random)
{
    const double d = outline_.equivalent_diameter();
    for (int n = 0; n < spec.chambers; ++n) {
        double radius = d * random.uniform(spec.chamber_radius[0], spec.chamber_radius[1]);
        for (int attempt = 0;; ++attempt) {
            if (attempt == placing_tries)
                throw UsageError("--chambers", fmt::format("no room for {} chambers", spec.chambers),
                                 "ask for fewer or smaller ones");
            if (attempt > 0 && attempt % 50 == 0) radius *= 0.9;
            const Eigen::Vector3d centre = random_point_inside(outline_, random);
            if (!has_room(centre, radius)) continue;
            chambers_.push_back({centre, radius});
            break;
        }
    }
}

Voids::Kind Voids::classify(const Eigen::Vector3d& point, double depth) const
{
    bool in_wall = false;
    for (const auto& c : chambers_) {
        const double distance = (point - c.centre).norm();
        if (distance < c.radius) return Kind::empty;
        in_wall |= distance < c.radius + wall_;
    }
    for (const auto& c : channels_) {
        const double to_axis = distance_to_axis(c, point), to_ball = (point - c.centre).norm();
        if (to_axis < c.throat_radius || to_ball < c.ball_radius) return Kind::empty;
        in_wall |= to_axis < c.throat_radius + wall_ || to_ball < c.ball_radius + wall_;
    }
    if (in_wall || seeds_.empty()) return Kind::solid;

    std::size_t own = 0;
    for (std::size_t n = 1; n < seeds_.size(); ++n) {
        if ((point - seeds_[n]).squaredNorm() < (point - seeds_[own]).squaredNorm()) own = n;
    }
    if (!open_[own] && depth < wall_) return Kind::solid;
    for (std::size_t n = 0; n < seeds_.size(); ++n) {  // distance to the plane half way between two seeds
        if (n == own) continue;
        const double squares = (point - seeds_[n]).squaredNorm() - (point - seeds_[own]).squaredNorm();
        if (squares < wall_ * (seeds_[n] - seeds_[own]).norm()) return Kind::solid;
    }
    return Kind::sponge;
}

/// Level of the cut from the values at a fixed lattice of grain axes: the geometry does not depend on the voxels of the
/// image.
void Voids::choose_level(double porosity)
{
    constexpr int points = 72;
    Lattice lattice;
    const double r = outline_.outer_radius();
    lattice.origin.setConstant(-r);
    lattice.step.setConstant(2 * r / (points - 1));
    lattice.size.setConstant(points);
    const WaveField::OnLattice waves(field_, lattice);
    std::vector<float> row(points), sponge;
    std::size_t inside = 0, empty = 0;
    for (int k = 0; k < points; ++k) {
        for (int j = 0; j < points; ++j) {
            waves.row(j, k, row);
            for (int i = 0; i < points; ++i) {
                const Eigen::Vector3d p = lattice.point(i, j, k);
                const double depth = outline_.depth(p);
                if (depth < 0) continue;
                ++inside;
                const Kind kind = classify(p, depth);
                if (kind == Kind::empty) ++empty;
                if (kind == Kind::sponge) sponge.push_back(row[i]);
            }
        }
    }
    const double wanted = porosity * static_cast<double>(inside) - static_cast<double>(empty);
    if (wanted < 0) {
        throw UsageError("--porosity", fmt::format("chambers and channels alone take {:.2f}", double(empty) / inside),
                         "raise it, or ask for fewer or smaller ones");
    }
    if (wanted > 0.8 * static_cast<double>(sponge.size())) {
        throw UsageError("--porosity",
                         fmt::format("walls leave room for {:.2f} only", (0.8 * sponge.size() + empty) / inside),
                         "lower it, or ask for thinner walls or fewer compartments");
    }
    const auto nth = sponge.begin() + static_cast<std::ptrdiff_t>(wanted);
    std::nth_element(sponge.begin(), nth, sponge.end(), std::greater<>{});
    level_ = nth == sponge.end() ? std::numeric_limits<float>::infinity() : *nth;
}

}  // namespace coral::phantom
