#pragma once
/// \file sh/fit.h
/// Radial fit of spherical harmonics to a level set, and its errors.
#include <memory>
#include <vector>

#include "sdf/distance_grid.h"
#include "sh/surface.h"

namespace coral::sh {

/// Radii of a level set along the over-sampled quadrature from a centre: everything a fit of any degree needs.
struct RadialSamples {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [m]
    int max_degree = 0;
    std::vector<double> radii;         ///< outermost exit per direction of oversampled_quadrature(max_degree) [m]
    double non_star_fraction = 0.0;    ///< share of the solid angle whose ray does not leave the solid exactly once
    double outer_volume = 0.0;         ///< integral of radii^3/3 [m^3]
    bool centre_inside = true;         ///< whether the centre lies in the solid
};

/// Casts rays from the centroid of the grid's solid (trilinear level set, steps of max(0.35 h, 0.8 |d|), sign changes bisected).
/// \throws Error when the grid has no solid or a ray finds none
RadialSamples cast_rays(const sdf::DistanceGrid& grid, int max_degree);

/// c_k = integral r Y_k, then scaled to `volume` [m^3] (0 leaves the raw fit). degree <= samples.max_degree.
Surface fit(const RadialSamples& samples, int degree, double volume);

/// Errors of a surface against a level set; lengths relative to the level set's equivalent diameter, the others relative.
struct FitErrors {
    double rms_error = 0.0;         ///< two-way, area-weighted
    double max_error = 0.0;         ///< Hausdorff, two-way
    double volume_error = 0.0;      ///< of the raw fit, before volume scaling, signed
    double area_error = 0.0;        ///< signed
    double inertia_error = 0.0;     ///< |I - I_ls| / |I_ls| (Frobenius), each about its own centroid
    double centroid_shift = 0.0;    ///< relative to the equivalent diameter
    double non_star_fraction = 0.0;
};

/// What the errors of all degrees share: the level set, its mesh and its mass properties. Thread-safe when const.
class FitReference {
public:
    explicit FitReference(const sdf::DistanceGrid& grid);
    ~FitReference();
    double volume() const;               ///< [m^3]
    double equivalent_diameter() const;  ///< [m]
    FitErrors errors(const Surface& surface, const RadialSamples& samples) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Worst share of non-star directions before a warning, and before a refusal.
inline constexpr double non_star_warning = 0.01, non_star_refusal = 0.10;

}  // namespace coral::sh
