#include "fluid/drag.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"

using namespace coral::fluid;

namespace {
constexpr double density = 1000.0, nu = 1e-6, diameter = 2e-3;
}

TEST(Drag, of_a_dense_bed_balances_the_pressure_drop_of_ergun)
{
    // force balance of model A in a uniform bed: eps dp/dx = n F_drag, n = 6 (1 - eps) / (pi d3), superficial U = eps u
    for (const double eps : {0.4, 0.5, 0.7})
        for (const double U : {1e-5, 1e-3, 0.1}) {
            const double u = U / eps;
            const double number_density = 6.0 * (1.0 - eps) / (std::numbers::pi * std::pow(diameter, 3));
            const double force = u * drag_coefficient(DragLaw::gidaspow, eps, u, diameter, density, nu);
            const double ergun = ergun_pressure_gradient(eps, U, diameter, density, nu);
            EXPECT_NEAR(number_density * force / eps / ergun, 1.0, 1e-12) << eps << " " << U;
        }
}

TEST(Drag, of_one_slow_sphere_is_that_of_stokes)
{
    const double slip = 1e-9;
    for (const DragLaw law : {DragLaw::gidaspow, DragLaw::wen_yu, DragLaw::schiller_naumann})
        EXPECT_NEAR(drag_coefficient(law, 1.0, slip, diameter, density, nu),
                    3.0 * std::numbers::pi * density * nu * diameter,
                    1e-3 * 3.0 * std::numbers::pi * density * nu * diameter);
}

TEST(Drag, of_schiller_and_naumann_has_the_published_values)
{
    EXPECT_NEAR(24.0 / 100.0 * single_sphere_drag_factor(100.0), 1.0918, 2e-4);  // 24/Re (1 + 0.15 Re^0.687)
    EXPECT_NEAR(24.0 / 5000.0 * single_sphere_drag_factor(5000.0), 0.44, 1e-12);
}

TEST(Drag, of_gidaspow_changes_continuously_from_ergun_to_wen_yu)
{
    for (const double reynolds : {0.01, 10.0, 1000.0}) {
        EXPECT_DOUBLE_EQ(drag_factor(DragLaw::gidaspow, 0.75, reynolds), drag_factor(DragLaw::ergun, 0.75, reynolds));
        EXPECT_DOUBLE_EQ(drag_factor(DragLaw::gidaspow, 0.85, reynolds), drag_factor(DragLaw::wen_yu, 0.85, reynolds));
        for (double eps = 0.7; eps < 0.9; eps += 0.001) {
            const double here = drag_factor(DragLaw::gidaspow, eps, reynolds);
            EXPECT_LT(std::abs(drag_factor(DragLaw::gidaspow, eps + 0.001, reynolds) - here), 0.05 * here);
        }
    }
}

TEST(Drag, refuses_a_law_it_does_not_know)
{
    EXPECT_EQ(drag_law_from_name("gidaspow"), DragLaw::gidaspow);
    EXPECT_THROW(drag_law_from_name("gidaspov"), coral::UsageError);
}
