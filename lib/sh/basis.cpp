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

double Basis::sum(std::span<const double> coefficients, const Eigen::Vector3d& u) const
{
    const int degree = int(std::lround(std::sqrt(double(coefficients.size())))) - 1;
    assert(degree <= degree_);
    double total = 0;
    visit<false>(degree, u, [&](int k, double value, const Eigen::Vector3d&) { total += coefficients[std::size_t(k)] * value; });
    return total;
}

double Basis::sum(std::span<const double> coefficients, const Eigen::Vector3d& u, Eigen::Vector3d& gradient) const
{
    const int degree = int(std::lround(std::sqrt(double(coefficients.size())))) - 1;
    assert(degree <= degree_);
    double total = 0;
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    visit<true>(degree, u, [&](int k, double value, const Eigen::Vector3d& slope) {
        total += coefficients[std::size_t(k)] * value;
        g += coefficients[std::size_t(k)] * slope;
    });
    gradient = g - g.dot(u) * u;
    return total;
}

}  // namespace coral::sh
