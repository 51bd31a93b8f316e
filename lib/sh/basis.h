#pragma once
/// \file sh/basis.h
/// Real orthonormal spherical harmonics without Condon-Shortley phase, evaluated free of poles.
///     Y_l0 = N_l0 P_l(z),  Y_lm = sqrt(2) N_lm P_lm(z) cos(m phi),  Y_l,-m = sqrt(2) N_lm P_lm(z) sin(m phi)  for m > 0,
/// P_lm = (1-z^2)^(m/2) d^m P_l/dz^m (no (-1)^m), N_lm^2 = (2l+1)/(4 pi) (l-m)!/(l+m)!, integral of Y_k Y_k' over the sphere
/// = delta_kk'. Index k = l(l+1)+m: (degree+1)^2 values. z = cos(theta), theta from +z; phi from +x to +y.
/// P_lm/sin^m(theta) is a polynomial in z and sin^m e^(i m phi) = (x+iy)^m: no angles, no division at the poles.
#include <Eigen/Core>
#include <span>
#include <vector>

namespace coral::sh {

inline int coefficient_count(int degree) { return (degree + 1) * (degree + 1); }
inline int coefficient_index(int l, int m) { return l * (l + 1) + m; }

/// Evaluates all harmonics up to a degree. Const functions are thread-safe.
class Basis {
public:
    explicit Basis(int degree);  ///< 0..200
    int degree() const { return degree_; }

    /// Y_k(u) for a unit vector u; values.size() == coefficient_count(degree).
    void evaluate(const Eigen::Vector3d& u, std::span<double> values) const;
    /// The same, and the gradients on the unit sphere (tangential, Cartesian components).
    void evaluate(const Eigen::Vector3d& u, std::span<double> values, std::span<Eigen::Vector3d> gradients) const;

    /// sum_k c_k Y_k(u); coefficients.size() may be that of any lower degree.
    double sum(std::span<const double> coefficients, const Eigen::Vector3d& u) const;
    /// The same, and its gradient on the unit sphere (tangential).
    double sum(std::span<const double> coefficients, const Eigen::Vector3d& u, Eigen::Vector3d& gradient) const;
    /// The same, and its second covariant derivative on the unit sphere: symmetric, tangential in both directions.
    double sum(std::span<const double> coefficients, const Eigen::Vector3d& u, Eigen::Vector3d& gradient, Eigen::Matrix3d& hessian) const;

private:
    template <bool with_gradient, class Visit>
    void visit(int degree, const Eigen::Vector3d& u, const Visit& take) const;
    template <int order>
    double polynomial(std::span<const double> coefficients, const Eigen::Vector3d& u, Eigen::Vector3d& gradient, Eigen::Matrix3d& hessian) const;

    int degree_;
    std::vector<double> diagonal_, first_, second_;  // factors of the three-term recurrence in l
};

}  // namespace coral::sh
