#include "sh/basis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "sh/quadrature.h"

namespace coral::sh::test {
namespace {

const double pi = std::numbers::pi;

TEST(Basis, has_the_closed_forms_of_the_lowest_degrees)
{
    const Eigen::Vector3d u = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
    std::vector<double> y(9);
    Basis(2).evaluate(u, y);
    EXPECT_NEAR(y[0], std::sqrt(1 / (4 * pi)), 1e-15);
    EXPECT_NEAR(y[1], std::sqrt(3 / (4 * pi)) * u.y(), 1e-15);  // l = 1, m = -1; no Condon-Shortley phase: all signs plus
    EXPECT_NEAR(y[2], std::sqrt(3 / (4 * pi)) * u.z(), 1e-15);
    EXPECT_NEAR(y[3], std::sqrt(3 / (4 * pi)) * u.x(), 1e-15);
    EXPECT_NEAR(y[4], std::sqrt(15 / (4 * pi)) * u.x() * u.y(), 1e-15);
    EXPECT_NEAR(y[5], std::sqrt(15 / (4 * pi)) * u.y() * u.z(), 1e-15);
    EXPECT_NEAR(y[6], std::sqrt(5 / (16 * pi)) * (3 * u.z() * u.z() - 1), 1e-15);
    EXPECT_NEAR(y[7], std::sqrt(15 / (4 * pi)) * u.z() * u.x(), 1e-15);
    EXPECT_NEAR(y[8], std::sqrt(15 / (16 * pi)) * (u.x() * u.x() - u.y() * u.y()), 1e-15);
}

TEST(Basis, is_orthonormal_up_to_degree_20)
{
    const int degree = 20, count = coefficient_count(degree);
    const SphereQuadrature q = sphere_quadrature(degree + 1, 2 * degree + 2);
    const Basis basis(degree);
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(count, count);
    Eigen::VectorXd y(count);
    for (std::size_t i = 0; i < q.weights.size(); ++i) {
        basis.evaluate(q.directions[i], {y.data(), std::size_t(count)});
        gram += q.weights[i] * y * y.transpose();
    }
    EXPECT_LE((gram - Eigen::MatrixXd::Identity(count, count)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Basis, gradient_is_tangential_and_right_at_the_poles_too)
{
    const int degree = 8, count = coefficient_count(degree);
    const Basis basis(degree);
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    std::vector<Eigen::Vector3d> directions = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}};
    for (int n = 0; n < 20; ++n) directions.push_back(Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized());
    std::vector<double> y(static_cast<std::size_t>(count)), ahead(y), behind(y);
    std::vector<Eigen::Vector3d> gradients(y.size());
    for (const Eigen::Vector3d& u : directions) {
        basis.evaluate(u, y, gradients);
        for (int axis = 0; axis < 3; ++axis) {
            const Eigen::Vector3d t = Eigen::Vector3d::Unit(axis) - u[axis] * u;
            basis.evaluate((u + 1e-5 * t).normalized(), ahead);
            basis.evaluate((u - 1e-5 * t).normalized(), behind);
            for (std::size_t k = 0; k < y.size(); ++k) {
                ASSERT_NEAR(gradients[k].dot(t), (ahead[k] - behind[k]) / 2e-5, 2e-7);
                ASSERT_NEAR(gradients[k].dot(u), 0.0, 1e-12);
            }
        }
    }
}

TEST(Basis, sum_of_fewer_coefficients_is_that_of_the_lower_degree)
{
    const std::vector<double> c = {1.0, 0.2, -0.3, 0.4};
    const Eigen::Vector3d u = Eigen::Vector3d(-0.2, 0.6, 0.1).normalized();
    EXPECT_NEAR(Basis(9).sum(c, u), Basis(1).sum(c, u), 1e-15);
}

TEST(Basis, sum_has_the_derivatives_of_its_harmonics)
{
    const int degree = 9;
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    std::vector<double> c(std::size_t(coefficient_count(degree))), y(c.size());
    std::vector<Eigen::Vector3d> gradients(c.size());
    for (double& value : c) value = normal(random);
    const Basis basis(degree);
    std::vector<Eigen::Vector3d> directions = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}};
    for (int n = 0; n < 10; ++n) directions.push_back(Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized());
    for (const Eigen::Vector3d& u : directions) {
        Eigen::Vector3d gradient;
        Eigen::Matrix3d hessian;
        const double value = basis.sum(c, u, gradient, hessian);
        basis.evaluate(u, y, gradients);
        double sum = 0;
        Eigen::Vector3d slope = Eigen::Vector3d::Zero();
        for (std::size_t k = 0; k < c.size(); ++k) sum += c[k] * y[k], slope += c[k] * gradients[k];
        EXPECT_NEAR(value, sum, 1e-13);
        EXPECT_LE((gradient - slope).norm(), 1e-12);
        EXPECT_LE((hessian * u).norm(), 1e-11) << "not tangential";
        // Second difference along the great circle through u in direction t is t.H.t.
        for (const Eigen::Vector3d& t : {u.unitOrthogonal(), Eigen::Vector3d(u.cross(u.unitOrthogonal())), Eigen::Vector3d((u.unitOrthogonal() + u.cross(u.unitOrthogonal())).normalized())}) {
            const double step = 1e-4;
            const auto at = [&](double s) { return basis.sum(c, std::cos(s) * u + std::sin(s) * t); };
            EXPECT_NEAR(t.dot(hessian * t), (at(step) - 2 * at(0) + at(-step)) / step / step, 2e-4);
        }
    }
}

TEST(GaussLegendre, integrates_polynomials_of_degree_2n_minus_1)
{
    for (const int n : {1, 2, 11, 44, 101}) {
        std::vector<double> x, w;
        gauss_legendre(n, x, w);
        double sum = 0, power = 0;
        for (std::size_t i = 0; i < x.size(); ++i) sum += w[i], power += w[i] * std::pow(x[i], 2 * n - 2);
        EXPECT_NEAR(sum, 2.0, 1e-13) << n;
        EXPECT_NEAR(power, 2.0 / (2 * n - 1), 1e-13) << n;
        EXPECT_TRUE(std::is_sorted(x.begin(), x.end()));
    }
}

TEST(Analyse, gives_the_coefficients_of_a_band_limited_function_back)
{
    const int degree = 10;
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    std::vector<double> c(std::size_t(coefficient_count(degree)));
    for (double& value : c) value = normal(random);
    const Basis basis(degree);
    const SphereQuadrature q = oversampled_quadrature(degree);
    std::vector<double> values;
    for (const auto& u : q.directions) values.push_back(basis.sum(c, u));
    const std::vector<double> back = analyse(q, values, degree);
    for (std::size_t k = 0; k < c.size(); ++k) ASSERT_NEAR(back[k], c[k], 1e-12);
}

}  // namespace
}  // namespace coral::sh::test
