#pragma once
/// \file phantom/outline.h
/// Random outside surface of a grain:   p(theta, phi) = S R(theta, phi) u(theta, phi),   R = sum_lm c_lm Y_lm,
/// u the unit direction, S = diag(1, 1, stretch) (1 for lumps; sticks are drawn out along z).
/// The surface is known in closed form, so volume and area come from quadrature and carry no voxel error.
#include <Eigen/Core>
#include <vector>

#include "phantom/random.h"

namespace coral::phantom {

struct OutlineSpec {
    double equivalent_diameter = 8e-3;  ///< of the enclosed volume [m]
    double sphericity = 0.88;           ///< (36 pi V^2)^(1/3) / A to reach, by the height of the bumps
    double stretch = 1.0;               ///< length along z relative to the lump it is drawn from
    int degree = 10;                    ///< of R; lump shapes of coral sand settle at 10 [Huang et al. 2023]
    double decay = 1.5;                 ///< standard deviation of c_lm falls as l^-decay
};

class Outline {
public:
    /// Draws bumps with a decaying spectrum and sets their height so that the sphericity is met within 1e-6.
    /// \throws Error when no surface with R > 0.35 mean(R) of that sphericity is found
    Outline(const OutlineSpec& spec, RandomSource& random);

    double volume() const { return volume_; }              ///< enclosed [m^3]; exact (Gauss-Legendre of enough nodes)
    double area() const { return area_; }                  ///< [m^2]; quadrature, converged to about 1e-6
    double sphericity() const;                             ///< Wadell: area of the equal-volume sphere / area
    double equivalent_diameter() const;                    ///< [m]
    double inner_radius() const { return inner_radius_; }  ///< ball around the origin inside the surface [m]
    double outer_radius() const { return outer_radius_; }  ///< ball around the origin that holds the surface [m]
    /// Coefficients c_lm at l(l+1)+m in the convention of sh/basis.h [m].
    const std::vector<double>& coefficients() const { return coefficients_; }
    double stretch() const { return stretch_; }

    /// Depth below the surface, to first order the distance to it; negative outside [m]. Interpolated from a table
    /// whose error is below 1e-4 of the diameter.
    double depth(const Eigen::Vector3d& point) const;
    bool contains(const Eigen::Vector3d& point) const { return depth(point) >= 0; }
    /// Points spread over the surface (nodes of a coarse lattice of angles) [m].
    std::vector<Eigen::Vector3d> surface_points() const;

private:
    void tabulate();

    std::vector<double> coefficients_;
    int degree_;
    double stretch_, volume_ = 0, area_ = 0, inner_radius_ = 0, outer_radius_ = 0;
    /// At theta = i pi/rows, phi = j 2 pi/columns: R and the cosine between ray and normal of the stretched surface.
    std::vector<Eigen::Vector2f> table_;
};

}  // namespace coral::phantom
