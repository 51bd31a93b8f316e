#include "sh/basis.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace coral::sh {

// With Q_lm = N_lm P_lm / sin^m (a polynomial in z; N includes sqrt(2) for m > 0):
//     Q_mm     = sqrt((2m+1)/(2m)) Q_{m-1,m-1}
//     Q_{l,m}  = a (z Q_{l-1,m} - b Q_{l-2,m}),  a = sqrt((4l^2-1)/(l^2-m^2)),  b = sqrt(((l-1)^2-m^2)/(4(l-1)^2-1)).
Basis::Basis(int degree) : degree_(degree)
{
    assert(degree >= 0 && degree <= 200);
    const std::size_t count = std::size_t(degree + 1);
    diagonal_.resize(count);
    first_.assign(count * count, 0.0);
    second_.assign(count * count, 0.0);
    diagonal_[0] = std::sqrt(0.25 * std::numbers::inv_pi);
    for (int m = 1; m <= degree; ++m)
        diagonal_[std::size_t(m)] = diagonal_[std::size_t(m - 1)] * std::sqrt((2.0 * m + 1.0) / (2.0 * m)) * (m == 1 ? std::numbers::sqrt2 : 1.0);
    for (int m = 0; m <= degree; ++m)
        for (int l = m + 1; l <= degree; ++l) {
            const std::size_t n = std::size_t(m) * count + std::size_t(l);
            first_[n] = std::sqrt((4.0 * l * l - 1.0) / (double(l) * l - double(m) * m));
            second_[n] = l == m + 1 ? 0.0 : std::sqrt((double(l - 1) * (l - 1) - double(m) * m) / (4.0 * (l - 1) * (l - 1) - 1.0));
        }
}

/// Calls take(k, value, Cartesian gradient of the polynomial) for every harmonic up to `degree`.
template <bool with_gradient, class Visit>
void Basis::visit(int degree, const Eigen::Vector3d& u, const Visit& take) const
{
    const std::size_t stride = std::size_t(degree_ + 1);
    const double x = u.x(), y = u.y(), z = u.z();
    double re = 1, im = 0, re_below = 0, im_below = 0;  // (x+iy)^m and (x+iy)^(m-1)
    for (int m = 0; m <= degree; ++m) {
        double q = diagonal_[std::size_t(m)], q_before = 0, s = 0, s_before = 0;  // Q and dQ/dz at l and l-1
        for (int l = m; l <= degree; ++l) {
            if (l > m) {
                const double a = first_[std::size_t(m) * stride + std::size_t(l)], b = second_[std::size_t(m) * stride + std::size_t(l)];
                if constexpr (with_gradient) {
                    const double s_next = a * (q + z * s - b * s_before);
                    s_before = s;
                    s = s_next;
                }
                const double q_next = a * (z * q - b * q_before);
                q_before = q;
                q = q_next;
            }
            if constexpr (with_gradient) {
                take(coefficient_index(l, m), q * re, Eigen::Vector3d(m * q * re_below, -m * q * im_below, s * re));
                if (m > 0) take(coefficient_index(l, -m), q * im, Eigen::Vector3d(m * q * im_below, m * q * re_below, s * im));
            } else {
                take(coefficient_index(l, m), q * re, Eigen::Vector3d());
                if (m > 0) take(coefficient_index(l, -m), q * im, Eigen::Vector3d());
            }
        }
        re_below = re;
        im_below = im;
        const double next = re * x - im * y;
        im = re * y + im * x;
        re = next;
    }
}

void Basis::evaluate(const Eigen::Vector3d& u, std::span<double> values) const
{
    assert(values.size() == std::size_t(coefficient_count(degree_)));
    visit<false>(degree_, u, [&](int k, double value, const Eigen::Vector3d&) { values[std::size_t(k)] = value; });
}

void Basis::evaluate(const Eigen::Vector3d& u, std::span<double> values, std::span<Eigen::Vector3d> gradients) const
{
    assert(values.size() == std::size_t(coefficient_count(degree_)) && gradients.size() == values.size());
    visit<true>(degree_, u, [&](int k, double value, const Eigen::Vector3d& g) {
        values[std::size_t(k)] = value;
        gradients[std::size_t(k)] = g - g.dot(u) * u;
    });
}

/// sum c_k Y_k as the polynomial in x, y, z that it is, with its Cartesian derivatives up to `order`. Sums over l come first, so
/// that the powers of x + iy are met once per m and not once per harmonic.
template <int order>
double Basis::polynomial(std::span<const double> coefficients, const Eigen::Vector3d& u, Eigen::Vector3d& gradient, Eigen::Matrix3d& hessian) const
{
    const int degree = int(std::lround(std::sqrt(double(coefficients.size())))) - 1;
    assert(degree <= degree_);
    const std::size_t stride = std::size_t(degree_ + 1);
    const double x = u.x(), y = u.y(), z = u.z();
    double total = 0, re = 1, im = 0, re_1 = 0, im_1 = 0, re_2 = 0, im_2 = 0;  // (x+iy)^m, ^(m-1), ^(m-2)
    double gx = 0, gy = 0, gz = 0, xx = 0, xy = 0, xz = 0, yz = 0, zz = 0;
    for (int m = 0; m <= degree; ++m) {
        double q = diagonal_[std::size_t(m)], q_before = 0, s = 0, s_before = 0, t = 0, t_before = 0;  // Q, dQ/dz, d2Q/dz2 at l and l-1
        double a = 0, b = 0, a_1 = 0, b_1 = 0, a_2 = 0, b_2 = 0;  // sums over l with c_lm and with c_l,-m
        const double *first = first_.data() + std::size_t(m) * stride, *second = second_.data() + std::size_t(m) * stride;
        for (int l = m; l <= degree; ++l) {
            if (l > m) {
                const double f = first[l], g = second[l];
                if constexpr (order > 1) {
                    const double next = f * (2 * s + z * t - g * t_before);
                    t_before = t;
                    t = next;
                }
                if constexpr (order > 0) {
                    const double next = f * (q + z * s - g * s_before);
                    s_before = s;
                    s = next;
                }
                const double next = f * (z * q - g * q_before);
                q_before = q;
                q = next;
            }
            const double *middle = coefficients.data() + coefficient_index(l, 0), c = middle[m], d = middle[-m];
            a += c * q, b += d * q;
            if constexpr (order > 0) a_1 += c * s, b_1 += d * s;
            if constexpr (order > 1) a_2 += c * t, b_2 += d * t;
        }
        // At m = 0 both sums are the same coefficients, but im and its derivatives vanish.
        total += a * re + b * im;
        if constexpr (order > 0) {
            gx += m * (a * re_1 + b * im_1);
            gy += m * (b * re_1 - a * im_1);
            gz += a_1 * re + b_1 * im;
        }
        if constexpr (order > 1) {
            const double mm = double(m) * (m - 1);
            xx += mm * (a * re_2 + b * im_2);
            xy += mm * (b * re_2 - a * im_2);
            xz += m * (a_1 * re_1 + b_1 * im_1);
            yz += m * (b_1 * re_1 - a_1 * im_1);
            zz += a_2 * re + b_2 * im;
        }
        re_2 = re_1, im_2 = im_1, re_1 = re, im_1 = im;
        re = re_1 * x - im_1 * y;
        im = im_1 * x + re_1 * y;
    }
    if constexpr (order > 0) gradient = Eigen::Vector3d(gx, gy, gz);
    if constexpr (order > 1) hessian << xx, xy, xz, xy, -xx, yz, xz, yz, zz;
    return total;
}

double Basis::sum(std::span<const double> coefficients, const Eigen::Vector3d& u) const
{
    Eigen::Vector3d gradient;
    Eigen::Matrix3d hessian;
    return polynomial<0>(coefficients, u, gradient, hessian);
}

double Basis::sum(std::span<const double> coefficients, const Eigen::Vector3d& u, Eigen::Vector3d& gradient) const
{
    Eigen::Matrix3d hessian;
    const double total = polynomial<1>(coefficients, u, gradient, hessian);
    gradient -= gradient.dot(u) * u;
    return total;
}

// The covariant derivative on the sphere of a function in space: P H P - (u . g) P, P = 1 - u u^T.
double Basis::sum(std::span<const double> coefficients, const Eigen::Vector3d& u, Eigen::Vector3d& gradient, Eigen::Matrix3d& hessian) const
{
    const double total = polynomial<2>(coefficients, u, gradient, hessian), radial = gradient.dot(u);
    const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - u * u.transpose();
    hessian = P * hessian * P - radial * P;
    gradient -= radial * u;
    return total;
}

}  // namespace coral::sh
