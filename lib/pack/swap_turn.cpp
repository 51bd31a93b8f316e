// Orientations of angular grains in the places of spheres: those in which they touch the same neighbours as deep as before, and no others.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "core/progress.h"
#include "dem/shape.h"
#include "pack/detail/swap.h"
#include "pack/sample_world.h"

namespace coral::pack::detail {
namespace {

using Vec3 = Eigen::Vector3d;
using Quat = Eigen::Quaterniond;

constexpr int sweeps = 4, random_trials = 200, trials_per_angle = 30;
constexpr double weight_of_gaps = 0.3;  ///< a gap takes force away, an overlap pushes grains apart
constexpr double widest = 0.5, narrowest = 0.015;  ///< turns of the local search [rad]
constexpr std::size_t most_points = 400;
constexpr double in_reach = 0.1;  ///< of the bounding radius: neighbours and points farther apart cannot touch in any orientation

/// Points that stand for the surface of a template.
std::vector<Vec3> outline(const dem::Shape& shape, std::size_t most)
{
    std::vector<Vec3> points;
    if (shape.kind() == dem::ShapeKind::polyhedron) points.assign(shape.polyhedron().vertices().begin(), shape.polyhedron().vertices().end());
    const std::size_t stride = std::max<std::size_t>(1, shape.nodes().size() / most);
    for (std::size_t i = 0; i < shape.nodes().size(); i += stride) points.push_back(shape.nodes()[i]);
    return points;
}

/// What stays the same about a neighbour while a grain turns in its place. All in the frame of the world, from the grain's centre.
struct Neighbour {
    const dem::Shape* shape = nullptr;  ///< none: a wall
    Vec3 position = Vec3::Zero(), normal = Vec3::Zero();  ///< of its centre, or of the wall
    double radius = 0;                  ///< of a wall that is a cylinder
    Quat turned_back = Quat::Identity();
    double scale = 1;
    double target = std::numeric_limits<double>::infinity();  ///< signed clearance to keep; infinite: any that is not negative
    std::vector<Vec3> points;           ///< of its surface, where the grain can be
};

class Fitter {
public:
    explicit Fitter(const Sample& sample) : sample_(sample), partners_(sample.particles.size())
    {
        for (const ShapeTemplate& shape : sample.shapes) {
            shapes_.push_back(make_shape(shape));
            outline_.push_back(outline(*shapes_.back(), most_points));
        }
        for (const Contact& c : sample.contacts) {
            partners_[std::size_t(c.first)].push_back({c.second, c.overlap});
            if (c.second >= 0) partners_[std::size_t(c.second)].push_back({c.first, c.overlap});
        }
    }

    std::vector<Neighbour> neighbours(std::size_t i) const
    {
        const Particle& p = sample_.particles[i];
        std::vector<Neighbour> near;
        for (std::size_t j = 0; j < sample_.particles.size(); ++j) {
            const Particle& q = sample_.particles[j];
            if (j == i || nearest_image(sample_, p.position - q.position).norm() > bounding(p) + bounding(q)) continue;
            Neighbour n;
            n.shape = shapes_[std::size_t(q.shape)].get();
            n.position = nearest_image(sample_, q.position - p.position);
            n.turned_back = q.orientation.conjugate();
            n.scale = q.scale;
            n.target = target(i, int(j));
            if (n.shape->kind() != dem::ShapeKind::sphere && n.shape->kind() != dem::ShapeKind::polyhedron)
                for (const Vec3& node : n.shape->nodes())
                    if (const Vec3 x = q.orientation * (q.scale * node) + n.position; x.norm() < bounding(p)) n.points.push_back(x);
            near.push_back(std::move(n));
        }
        for (std::size_t w = 0; w < sample_.walls.size(); ++w) {
            const Wall& wall = sample_.walls[w];
            Neighbour n;
            n.position = wall.point - p.position;
            n.normal = wall.normal;
            n.radius = wall.radius;
            n.target = target(i, -1 - int(w));
            if (to_wall(n, Vec3::Zero()) < (1 + in_reach) * bounding(p)) near.push_back(std::move(n));
        }
        return near;
    }

    /// Sum of squared differences between the clearances and those to keep [m2]; more than `limit` ends the sum.
    double misfit(const Particle& p, const Quat& turn, const std::vector<Neighbour>& near, double limit) const
    {
        double sum = 0;
        for (const Neighbour& n : near) {
            const double gap = clearance(p, turn, n), error = std::isfinite(n.target) ? gap - n.target : std::min(gap, 0.0);
            sum += (error > 0 ? weight_of_gaps : 1.0) * error * error;
            if (sum >= limit) break;
        }
        return sum;
    }

private:
    double bounding(const Particle& p) const { return p.scale * shapes_[std::size_t(p.shape)]->bounding_radius(); }

    double target(std::size_t i, int partner) const
    {
        for (const auto& [other, overlap] : partners_[i])
            if (other == partner) return -overlap;
        return std::numeric_limits<double>::infinity();
    }

    /// Largest over the faces of `a` of the least distance of the corners of `b` from the plane: what separates them along a face normal.
    static double separation(const dem::Polyhedron& a, double scale, const std::vector<Vec3>& corners_of_b)
    {
        double most = -std::numeric_limits<double>::infinity();
        for (int f = 0; f < int(a.faces().size()); ++f) {
            const Vec3 n = a.normal(f);
            double least = std::numeric_limits<double>::infinity();
            for (const Vec3& x : corners_of_b) least = std::min(least, n.dot(x));
            most = std::max(most, least - scale * a.offset(f));
        }
        return most;
    }

    static double between(const dem::Polyhedron& a, double scale_a, const Quat& turn_a, const Neighbour& n)
    {
        const dem::Polyhedron& b = n.shape->polyhedron();
        const Quat to_a = turn_a.conjugate() * n.turned_back.conjugate(), to_b = n.turned_back * turn_a;
        std::vector<Vec3> corners;
        for (const Vec3& x : b.vertices()) corners.push_back(to_a * (n.scale * x) + turn_a.conjugate() * n.position);
        const double first = separation(a, scale_a, corners);
        corners.clear();
        for (const Vec3& x : a.vertices()) corners.push_back(to_b * (scale_a * x) - n.turned_back * n.position);
        return std::max(first, separation(b, n.scale, corners));
    }

    static double to_wall(const Neighbour& n, const Vec3& x)
    {
        return n.radius > 0 ? n.radius - (x - n.position).head<2>().norm() : n.normal.dot(x - n.position);
    }

    /// Least distance between the surfaces, negative where they overlap.
    double clearance(const Particle& p, const Quat& turn, const Neighbour& n) const
    {
        const dem::Shape& shape = *shapes_[std::size_t(p.shape)];
        const std::vector<Vec3>& points = outline_[std::size_t(p.shape)];
        double least = std::numeric_limits<double>::infinity();
        if (!n.shape) {
            for (const Vec3& x : points) least = std::min(least, to_wall(n, turn * (p.scale * x)));
            return least;
        }
        const Quat back = turn.conjugate();
        if (n.shape->kind() == dem::ShapeKind::sphere) return p.scale * shape.distance(back * n.position / p.scale) - n.scale * n.shape->radius();
        if (n.shape->kind() == dem::ShapeKind::polyhedron && shape.kind() == dem::ShapeKind::polyhedron) return between(shape.polyhedron(), p.scale, turn, n);
        for (const Vec3& x : points) least = std::min(least, n.scale * n.shape->distance(n.turned_back * (turn * (p.scale * x) - n.position) / n.scale));
        for (const Vec3& x : n.points) least = std::min(least, p.scale * shape.distance(back * x / p.scale));
        return least;
    }

    struct Partner {
        int other;
        double overlap;
    };
    const Sample& sample_;
    std::vector<std::shared_ptr<const dem::Shape>> shapes_;
    std::vector<std::vector<Vec3>> outline_;
    std::vector<std::vector<Partner>> partners_;
};

}  // namespace

void turn_to_fit(Sample& sample, const std::vector<std::size_t>& grains, Random& random)
{
    if (grains.empty()) return;
    const Fitter fitter(sample);
    Progress progress("turning", double(sweeps) * double(grains.size()));
    std::size_t done = 0;
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (const std::size_t i : grains) {
            progress.update(double(done++));
            Particle& p = sample.particles[i];
            const std::vector<Neighbour> near = fitter.neighbours(i);
            const double enough = 1e-6 * p.scale * p.scale;  // a thousandth of the size
            double least = fitter.misfit(p, p.orientation, near, std::numeric_limits<double>::infinity());
            const auto attempt = [&](const Quat& turn) {
                const double misfit = fitter.misfit(p, turn, near, least);
                if (misfit < least) p.orientation = turn, least = misfit;
            };
            for (int k = 0; sweep < 2 && k < random_trials && least > enough; ++k) attempt(random_rotation(random));
            for (double angle = widest; angle > narrowest && least > enough; angle /= 2)
                for (int k = 0; k < trials_per_angle && least > enough; ++k)
                    attempt((Quat(Eigen::AngleAxisd(angle, (random_rotation(random) * Vec3::UnitZ()).eval())) * p.orientation).normalized());
        }
    progress.finish();
}

}  // namespace coral::pack::detail
