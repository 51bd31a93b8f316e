#include "fluid/fine_force.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fluid/porous.h"

using namespace coral::fluid;
using Eigen::Vector3d;

namespace {
constexpr double pi = std::numbers::pi;
}

TEST(FineForce, is_that_of_the_drag_law_where_nothing_is_felt_of_itself)
{
    FeltFlow felt;
    felt.void_fraction = 0.6;
    felt.velocity = {0.01, -0.02, 0.03};
    felt.pressure_gradient = felt.wide_pressure_gradient = {1.0, 2.0, 3.0};
    const FineParticle particle{{0.001, 0.002, 0.003}, 2e-3, 4e-9, {}};
    const FineForce f = fine_force(DragLaw::gidaspow, particle, felt, 1000.0, 1e-6);
    const Vector3d slip = felt.velocity - particle.velocity;
    EXPECT_DOUBLE_EQ(f.coefficient, drag_coefficient(DragLaw::gidaspow, 0.6, slip.norm(), 2e-3, 1000.0, 1e-6));
    EXPECT_LT((f.force - f.coefficient * slip).norm(), 1e-14 * f.force.norm());
}

TEST(FineForce, own_wake_is_that_of_the_oseen_equations)
{
    // The integral of the header, by the midpoint rule in both spaces.
    const int n = 400, waves = 700;
    const double dk = 0.05;
    const auto kernel_of = [&](double k) {
        double sum = 0.0, mass = 0.0;
        for (int i = 0; i < n; ++i) {
            const double s = (i + 0.5) / n, w = peskin_kernel(2 * s);
            sum += w * s * std::sin(k * s) / k;
            mass += w * s * s;
        }
        return sum / mass;
    };
    for (const double reynolds : {0.01, 0.3, 1.0, 5.0, 30.0, 300.0, 3000.0}) {
        double G = 0.0;
        for (int i = 0; i < waves; ++i) {
            const double k = (i + 0.5) * dk, a = reynolds / k, w = kernel_of(k);
            const double angles = a < 0.05 ? 4.0 / 3.0 - 4.0 * a * a / 15.0 : 2 * ((1 + 1 / (a * a)) * std::atan(a) / a - 1 / (a * a));
            G += w * w * angles * dk / (4 * pi * pi);
        }
        EXPECT_NEAR(self_velocity_factor(reynolds) / G, 1.0, 6e-3) << reynolds;
    }
}
