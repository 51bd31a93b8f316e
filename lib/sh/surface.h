#pragma once
/// \file sh/surface.h
/// Star-shaped surface r(u) = sum_k c_k Y_k(u) about a centre, and the body inside it.
#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "sh/basis.h"

namespace coral::sh {

/// Plain data; coefficients are in metres and ready to use (volume scaling included).
struct Surface {
    int degree = 0;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< origin of r in the grain's frame [m]
    std::vector<double> coefficients;                  ///< (degree+1)^2, index l(l+1)+m [m]
    double scale = 1.0;                                ///< factor (V/V_fit)^(1/3) that the coefficients already hold
    std::string method = "radial";                     ///< how it was fitted
};

/// Sphere of a radius [m].
Surface sphere_surface(double radius);
/// The surface cut to a lower degree; coefficients are kept as they are.
Surface truncated(const Surface& surface, int degree);

/// Evaluates one surface many times. Thread-safe; holds a copy.
class Evaluator {
public:
    explicit Evaluator(const Surface& surface);
    const Surface& surface() const { return surface_; }
    double radius(const Eigen::Vector3d& u) const { return basis_.sum(surface_.coefficients, u); }
    /// Radius and its gradient on the unit sphere.
    double radius(const Eigen::Vector3d& u, Eigen::Vector3d& gradient) const { return basis_.sum(surface_.coefficients, u, gradient); }
    /// Radius, its gradient and its second covariant derivative on the unit sphere.
    double radius(const Eigen::Vector3d& u, Eigen::Vector3d& gradient, Eigen::Matrix3d& hessian) const { return basis_.sum(surface_.coefficients, u, gradient, hessian); }
    /// Surface point in direction u, in the grain's frame [m].
    Eigen::Vector3d point(const Eigen::Vector3d& u) const { return surface_.centre + radius(u) * u; }
    /// The same with the outward unit normal, (r u - grad r) normalised.
    Eigen::Vector3d point(const Eigen::Vector3d& u, Eigen::Vector3d& normal) const;
    /// |x - centre| - r(u): sign is exact (negative inside), the value is a distance only on a sphere [m]; sh/surface_distance.h has that.
    double radial_distance(const Eigen::Vector3d& x) const;

private:
    Surface surface_;
    Basis basis_;
};

/// Body of unit density inside a surface, by quadrature 4(L+1) x 8(L+1).
struct BodyProperties {
    double volume = 0.0;                                 ///< integral r^3/3 [m^3]
    double area = 0.0;                                   ///< integral r sqrt(r^2 + |grad r|^2) [m^2]
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< in the grain's frame [m]
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();   ///< about the centroid [m^5]
    double smallest_radius = 0.0, largest_radius = 0.0;  ///< over the quadrature, the smallest also over spread_directions [m]; <= 0: not a surface
};
BodyProperties body_properties(const Surface& surface);

/// All lengths (centre included) times a factor.
Surface scaled(const Surface& surface, double factor);
/// Coefficients scaled about the centre so that the body has this volume [m^3]; `scale` is multiplied by the factor.
Surface scaled_to_volume(const Surface& surface, double volume);
/// Moved so that the body's centroid is the origin (the frame that contact and flow want).
Surface centred(const Surface& surface);

}  // namespace coral::sh
