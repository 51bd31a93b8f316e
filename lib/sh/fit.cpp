#include "sh/fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/text.h"
#include "sdf/mass_properties.h"
#include "sdf/mesh.h"
#include "sh/quadrature.h"
#include "sh/surface_distance.h"

namespace coral::sh {
namespace {

/// Distance from the centre to where the ray leaves the solid for good, and how often it leaves it.
struct Ray {
    double radius = 0.0;
    int exits = 0;
};

double bisect(const sdf::DistanceGrid& grid, const Eigen::Vector3d& centre, const Eigen::Vector3d& u, double solid, double open)
{
    for (int n = 0; n < 40 && open - solid > 1e-9 * grid.spacing; ++n) {
        const double middle = 0.5 * (solid + open);
        (grid.sample(centre + middle * u) < 0 ? solid : open) = middle;
    }
    return 0.5 * (solid + open);
}

Ray cast(const sdf::DistanceGrid& grid, const Eigen::Vector3d& centre, const Eigen::Vector3d& u)
{
    Ray ray;
    double r = 0.0, d = grid.sample(centre);
    while (grid.inside_box(centre + r * u)) {
        const double step = std::max(0.35 * grid.spacing, 0.8 * std::abs(d)), next = r + step;
        const double next_d = grid.sample(centre + next * u);
        if (d < 0 && next_d >= 0) {
            ray.radius = bisect(grid, centre, u, r, next);
            ++ray.exits;
        }
        r = next;
        d = next_d;
    }
    return ray;
}

/// Sum of squares, weight and largest of distances.
struct Spread {
    double squares = 0, weight = 0, largest = 0;
    void add(double distance, double w)
    {
        squares += w * distance * distance;
        weight += w;
        largest = std::max(largest, distance);
    }
};

}  // namespace

RadialSamples cast_rays(const sdf::DistanceGrid& grid, int max_degree)
{
    const sdf::MassProperties body = sdf::mass_properties(grid);
    if (!(body.volume > 0)) throw Error("radial fit", "the grid has no solid");
    RadialSamples samples;
    samples.centre = body.centroid;
    samples.max_degree = max_degree;
    samples.centre_inside = grid.sample(body.centroid) < 0;
    const SphereQuadrature quadrature = oversampled_quadrature(max_degree);
    double solid_angle = 0;
    for (std::size_t i = 0; i < quadrature.weights.size(); ++i) {
        const Ray ray = cast(grid, samples.centre, quadrature.directions[i]);
        samples.radii.push_back(ray.radius);
        samples.outer_volume += quadrature.weights[i] * ray.radius * ray.radius * ray.radius / 3.0;
        if (ray.exits != 1) solid_angle += quadrature.weights[i];
    }
    samples.non_star_fraction = solid_angle / (4.0 * std::numbers::pi);
    if (!(samples.outer_volume > 0)) throw Error("radial fit", "no ray from the centroid meets the surface");
    return samples;
}

Surface fit(const RadialSamples& samples, int degree, double volume)
{
    if (degree < 0 || degree > samples.max_degree)
        throw Error("radial fit", "degree " + std::to_string(degree) + " is beyond the rays cast", "cast rays for that degree");
    Surface surface;
    surface.degree = degree;
    surface.centre = samples.centre;
    surface.coefficients = analyse(oversampled_quadrature(samples.max_degree), samples.radii, degree);
    return volume > 0 ? scaled_to_volume(surface, volume) : surface;
}

struct FitReference::Impl {
    sdf::DistanceGrid grid;
    double diameter = 0, area = 0;
    sdf::MassProperties body;
    std::vector<Eigen::Vector3d> points;  // surface samples of the level set
    std::vector<double> shares;           // their areas
    Eigen::Matrix3Xf vertices;            // all of its mesh

    /// Distance of a point to the surface of the level set, without sign. Beyond the band, where the grid is clamped, that to the
    /// nearest vertex: vertices lie within a node of each other, so at a band of 6 nodes it errs by a hundredth of a node.
    double distance(const Eigen::Vector3d& x) const
    {
        if (grid.inside_box(x)) {
            const double margin = std::numbers::sqrt3 * grid.spacing;  // no corner of the cell is clamped
            const double d = grid.sample(x);
            if (d < grid.outside_limit - margin && d > margin - grid.inside_limit) return std::abs(d);
        }
        return std::sqrt(double((vertices.colwise() - x.cast<float>()).colwise().squaredNorm().minCoeff()));
    }
};

FitReference::FitReference(const sdf::DistanceGrid& grid) : impl_(new Impl)
{
    impl_->body = sdf::mass_properties(grid);
    if (!(impl_->body.volume > 0)) throw Error("radial fit", "the grid has no solid");
    impl_->diameter = std::cbrt(6.0 * impl_->body.volume / std::numbers::pi);
    impl_->grid = grid;
    const sdf::TriangleMesh mesh = sdf::extract_mesh(grid);
    impl_->area = sdf::surface_area(mesh);
    impl_->vertices.resize(3, Eigen::Index(mesh.vertices.size()));
    for (std::size_t n = 0; n < mesh.vertices.size(); ++n) impl_->vertices.col(Eigen::Index(n)) = mesh.vertices[n].cast<float>();
    const std::size_t every = std::max<std::size_t>(1, mesh.triangles.size() / 8000);
    for (std::size_t t = 0; t < mesh.triangles.size(); t += every) {
        const Eigen::Vector3i& triangle = mesh.triangles[t];
        const Eigen::Vector3d &a = mesh.vertices[std::size_t(triangle[0])], &b = mesh.vertices[std::size_t(triangle[1])], &c = mesh.vertices[std::size_t(triangle[2])];
        impl_->points.push_back((a + b + c) / 3.0);
        impl_->shares.push_back(sdf::triangle_area(a, b, c));
    }
}
FitReference::~FitReference() = default;

double FitReference::volume() const { return impl_->body.volume; }
double FitReference::equivalent_diameter() const { return impl_->diameter; }

FitErrors FitReference::errors(const Surface& surface, const RadialSamples& samples) const
{
    const BodyProperties body = body_properties(surface);
    if (!(body.smallest_radius > 0))
        throw Error("radial fit", "degree " + std::to_string(surface.degree) + " gives a radius that is not positive", "take another degree");
    const Evaluator evaluator(surface);

    // Harmonic surface -> level set.
    Spread forth;
    const SphereQuadrature quadrature = oversampled_quadrature(std::max(surface.degree, 10));
    for (std::size_t i = 0; i < quadrature.weights.size(); ++i) {
        Eigen::Vector3d gradient;
        const Eigen::Vector3d& u = quadrature.directions[i];
        const double r = evaluator.radius(u, gradient);
        forth.add(impl_->distance(surface.centre + r * u), quadrature.weights[i] * r * std::sqrt(r * r + gradient.squaredNorm()));
    }
    // Level set -> harmonic surface: the nearest point of the whole surface, since that in the same direction is not the nearest
    // where the grain bends back.
    const SurfaceDistance harmonic(surface);
    Spread back;
    for (std::size_t n = 0; n < impl_->points.size(); ++n) back.add(std::abs(harmonic.distance(impl_->points[n])), impl_->shares[n]);

    FitErrors e;
    e.rms_error = std::sqrt(0.5 * (forth.squares / forth.weight + back.squares / back.weight)) / impl_->diameter;
    e.max_error = std::max(forth.largest, back.largest) / impl_->diameter;
    e.volume_error = body.volume / std::pow(surface.scale, 3) / impl_->body.volume - 1.0;
    e.area_error = body.area / impl_->area - 1.0;
    e.inertia_error = (body.inertia - impl_->body.inertia).norm() / impl_->body.inertia.norm();
    e.centroid_shift = (body.centroid - impl_->body.centroid).norm() / impl_->diameter;
    e.non_star_fraction = samples.non_star_fraction;
    return e;
}

}  // namespace coral::sh
