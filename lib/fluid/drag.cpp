#include "fluid/drag.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace coral::fluid {

namespace {

double ergun_factor(double eps, double reynolds)
{
    return (150.0 * (1.0 - eps) + 1.75 * reynolds) / (18.0 * eps * eps);
}

double wen_yu_factor(double eps, double reynolds)
{
    return single_sphere_drag_factor(reynolds) * std::pow(eps, -3.65);
}

}  // namespace

DragLaw drag_law_from_name(const std::string& name)
{
    if (name == "gidaspow") return DragLaw::gidaspow;
    if (name == "ergun") return DragLaw::ergun;
    if (name == "wen-yu") return DragLaw::wen_yu;
    if (name == "schiller-naumann") return DragLaw::schiller_naumann;
    throw UsageError("fluid.drag", "unknown drag law '" + name + "'",
                     "use gidaspow, ergun, wen-yu or schiller-naumann");
}

double single_sphere_drag_factor(double reynolds)
{
    if (reynolds > 1000.0) return 0.44 * reynolds / 24.0;
    return 1.0 + 0.15 * std::pow(reynolds, 0.687);
}

double drag_factor(DragLaw law, double eps, double reynolds)
{
    switch (law) {
        case DragLaw::ergun:
            return ergun_factor(eps, reynolds);
        case DragLaw::wen_yu:
            return wen_yu_factor(eps, reynolds);
        case DragLaw::schiller_naumann:
            return single_sphere_drag_factor(reynolds);
        case DragLaw::gidaspow:
            break;
    }
    const double wen_yu_share = std::clamp((eps - 0.75) / 0.1, 0.0, 1.0);
    double factor = 0.0;
    if (wen_yu_share < 1.0) factor += (1.0 - wen_yu_share) * ergun_factor(eps, reynolds);
    if (wen_yu_share > 0.0) factor += wen_yu_share * wen_yu_factor(eps, reynolds);
    return factor;
}

double drag_coefficient(DragLaw law, double eps, double slip, double diameter, double density, double nu)
{
    if (law == DragLaw::schiller_naumann) eps = 1.0;
    const double reynolds = eps * slip * diameter / nu;
    return 3.0 * std::numbers::pi * eps * density * nu * diameter * drag_factor(law, eps, reynolds);
}

double ergun_pressure_gradient(double eps, double U, double d, double rho, double nu)
{
    const double solid = 1.0 - eps;
    const double eps3 = eps * eps * eps;
    return 150.0 * rho * nu * U * solid * solid / (eps3 * d * d) + 1.75 * rho * U * std::abs(U) * solid / (eps3 * d);
}

}  // namespace coral::fluid
