#include "sh/surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "sh/quadrature.h"

namespace coral::sh {

Surface sphere_surface(double radius)
{
    Surface surface;
    surface.coefficients = {radius * std::sqrt(4.0 * std::numbers::pi)};
    surface.method = "sphere";
    return surface;
}

Surface truncated(const Surface& surface, int degree)
{
    Surface result = surface;
    result.degree = std::min(degree, surface.degree);
    result.coefficients.resize(std::size_t(coefficient_count(result.degree)));
    return result;
}

Evaluator::Evaluator(const Surface& surface) : surface_(surface), basis_(surface.degree)
{
    if (int(surface.coefficients.size()) != coefficient_count(surface.degree))
        throw Error("harmonic surface", std::to_string(surface.coefficients.size()) + " coefficients do not fit degree " + std::to_string(surface.degree));
}

Eigen::Vector3d Evaluator::point(const Eigen::Vector3d& u, Eigen::Vector3d& normal) const
{
    Eigen::Vector3d gradient;
    const double r = radius(u, gradient);
    normal = (r * u - gradient).normalized();
    return surface_.centre + r * u;
}

double Evaluator::radial_distance(const Eigen::Vector3d& x) const
{
    const Eigen::Vector3d d = x - surface_.centre;
    const double length = d.norm();
    return length > 0 ? length - radius(d / length) : -radius(Eigen::Vector3d::UnitZ());
}

BodyProperties body_properties(const Surface& surface)
{
    const Evaluator evaluator(surface);
    const SphereQuadrature q = oversampled_quadrature(std::max(surface.degree, 4));
    BodyProperties body;
    body.smallest_radius = std::numeric_limits<double>::infinity();
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < q.weights.size(); ++i) {
        const Eigen::Vector3d& u = q.directions[i];
        Eigen::Vector3d gradient;
        const double r = evaluator.radius(u, gradient), w = q.weights[i], r3 = r * r * r;
        body.volume += w * r3 / 3.0;
        body.area += w * r * std::sqrt(r * r + gradient.squaredNorm());
        first += w * r3 * r / 4.0 * u;
        second += w * r3 * r * r / 5.0 * (u * u.transpose());
        body.smallest_radius = std::min(body.smallest_radius, r);
        body.largest_radius = std::max(body.largest_radius, r);
    }
    for (const Eigen::Vector3d& u : spread_directions(spread_count(surface.degree))) body.smallest_radius = std::min(body.smallest_radius, evaluator.radius(u));
    if (body.volume == 0) return body;
    const Eigen::Vector3d c = first / body.volume;  // from the centre
    second -= body.volume * c * c.transpose();
    body.centroid = surface.centre + c;
    body.inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
    return body;
}

Surface scaled(const Surface& surface, double factor)
{
    Surface result = surface;
    result.centre *= factor;
    for (double& c : result.coefficients) c *= factor;
    return result;
}

Surface scaled_to_volume(const Surface& surface, double volume)
{
    const double own = body_properties(surface).volume;
    if (!(own > 0)) throw Error("harmonic surface", "encloses no volume", "fit a higher degree");
    const double factor = std::cbrt(volume / own);
    Surface result = surface;
    for (double& c : result.coefficients) c *= factor;
    result.scale *= factor;
    return result;
}

Surface centred(const Surface& surface)
{
    Surface result = surface;
    result.centre -= body_properties(surface).centroid;
    return result;
}

}  // namespace coral::sh
