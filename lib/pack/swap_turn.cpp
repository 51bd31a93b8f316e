// Orientations of angular grains in the places of spheres: of many at random, those that meet their neighbours least.
#include <algorithm>
#include <memory>

#include "dem/shape.h"
#include "pack/detail/swap.h"
#include "pack/sample_world.h"

namespace coral::pack::detail {
namespace {

using Vec3 = Eigen::Vector3d;

constexpr int sweeps = 2, candidates = 60;
constexpr std::size_t most_points = 60;

/// Points that stand for the surface of a template: its corners, or some of its nodes.
std::vector<Vec3> outline(const ShapeTemplate& shape)
{
    if (shape.kind == ShapeKind::polyhedron) return shape.vertices;
    std::vector<Vec3> points;
    const std::size_t stride = std::max<std::size_t>(1, shape.nodes.size() / most_points);
    for (std::size_t i = 0; i < shape.nodes.size(); i += stride) points.push_back(shape.nodes[i]);
    return points;
}

class Fitter {
public:
    explicit Fitter(const Sample& sample) : sample_(sample)
    {
        for (const ShapeTemplate& shape : sample.shapes) {
            shapes_.push_back(make_shape(shape));
            points_.push_back(outline(shape));
        }
    }

    std::vector<std::size_t> neighbours(std::size_t i) const
    {
        const Particle& p = sample_.particles[i];
        std::vector<std::size_t> near;
        for (std::size_t j = 0; j < sample_.particles.size(); ++j) {
            const Particle& q = sample_.particles[j];
            if (j != i && (p.position - q.position).norm() < bounding(p) + bounding(q)) near.push_back(j);
        }
        return near;
    }

    /// Sum of squared depths of the outline in the neighbours, of theirs in the grain, and behind walls [m2].
    double overlap(const Particle& p, const std::vector<std::size_t>& near) const
    {
        double sum = 0;
        for (const std::size_t j : near) sum += outline_in(p, sample_.particles[j]) + outline_in(sample_.particles[j], p);
        for (const Wall& wall : sample_.walls)
            for (const Vec3& x : points_[std::size_t(p.shape)])
                sum += squared_depth(wall.normal.dot(p.position + p.orientation * (p.scale * x) - wall.point));
        return sum;
    }

private:
    static double squared_depth(double distance) { return distance < 0 ? distance * distance : 0; }
    double bounding(const Particle& p) const { return p.scale * shapes_[std::size_t(p.shape)]->bounding_radius(); }

    double outline_in(const Particle& p, const Particle& body) const
    {
        const dem::Shape& shape = *shapes_[std::size_t(body.shape)];
        const auto distance = [&](const Vec3& x) { return body.scale * shape.distance(body.orientation.conjugate() * (x - body.position) / body.scale); };
        if (sample_.shapes[std::size_t(p.shape)].kind == ShapeKind::sphere) return squared_depth(distance(p.position) - 0.5 * equivalent_diameter(sample_, p));
        double sum = 0;
        for (const Vec3& x : points_[std::size_t(p.shape)]) sum += squared_depth(distance(p.position + p.orientation * (p.scale * x)));
        return sum;
    }

    const Sample& sample_;
    std::vector<std::shared_ptr<const dem::Shape>> shapes_;
    std::vector<std::vector<Vec3>> points_;
};

}  // namespace

void turn_to_fit(Sample& sample, const std::vector<std::size_t>& grains, const std::function<Eigen::Quaterniond()>& random_turn)
{
    const Fitter fitter(sample);
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (const std::size_t i : grains) {
            const std::vector<std::size_t> near = fitter.neighbours(i);
            Particle trial = sample.particles[i];
            double least = fitter.overlap(trial, near);
            for (int k = 0; k < candidates && least > 0; ++k) {
                trial.orientation = random_turn();
                const double overlap = fitter.overlap(trial, near);
                if (overlap < least) sample.particles[i].orientation = trial.orientation, least = overlap;
            }
        }
}

}  // namespace coral::pack::detail
