#include "fluid/drag.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/text.h"

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

double gidaspow_factor(double eps, double reynolds)
{
    const double wen_yu_share = std::clamp((eps - 0.75) / 0.1, 0.0, 1.0);
    double factor = 0.0;
    if (wen_yu_share < 1.0) factor += (1.0 - wen_yu_share) * ergun_factor(eps, reynolds);
    if (wen_yu_share > 0.0) factor += wen_yu_share * wen_yu_factor(eps, reynolds);
    return factor;
}

double koch_hill_factor(double eps, double reynolds)
{
    const double phi = 1.0 - eps;
    double F0 = 1.0;
    if (phi >= 0.4)
        F0 = 10.0 * phi / (eps * eps * eps);
    else if (phi > 0.0)
        F0 = (1.0 + 3.0 * std::sqrt(phi / 2.0) + 135.0 / 64.0 * phi * std::log(phi) + 16.14 * phi) /
             (1.0 + phi * (0.681 + phi * (-8.48 + phi * 8.16)));
    const double F3 = 0.0673 + 0.212 * phi + 0.0232 / std::pow(eps, 5.0);
    return eps * (F0 + 0.5 * F3 * reynolds);
}

double beetstra_factor(double eps, double reynolds)
{
    const double phi = std::max(1.0 - eps, 0.0), squared = eps * eps;
    const double slow = 10.0 * phi / squared + squared * (1.0 + 1.5 * std::sqrt(phi));
    if (!(reynolds > 0.0)) return slow;
    const double shape = (1.0 / eps + 3.0 * eps * phi + 8.4 * std::pow(reynolds, -0.343)) /
                         (1.0 + std::pow(10.0, 3.0 * phi) * std::pow(reynolds, -0.5 - 2.0 * phi));
    return slow + 0.413 * reynolds / (24.0 * squared) * shape;
}

double hoelzer_sommerfeld_factor(double reynolds, const DragShape& shape)
{
    const double c = shape.crosswise_sphericity, s = std::min(shape.sphericity, 1.0);
    return (8.0 / std::sqrt(c) + 16.0 / std::sqrt(s) + 3.0 * std::sqrt(reynolds) / std::pow(s, 0.75) +
            0.42 * std::pow(10.0, 0.4 * std::pow(-std::log10(s), 0.2)) / c * reynolds) /
           24.0;
}

double ganser_factor(double reynolds, const DragShape& shape)
{
    const double c = shape.crosswise_sphericity, s = std::min(shape.sphericity, 1.0);
    const double K1 = 1.0 / (1.0 / (3.0 * std::sqrt(c)) + 2.0 / (3.0 * std::sqrt(s)));
    const double K2 = std::pow(10.0, 1.8148 * std::pow(-std::log10(s), 0.5743));
    const double X = K1 * K2 * reynolds;
    return (1.0 + 0.1118 * std::pow(X, 0.6567)) / K1 + K2 * reynolds / 24.0 * 0.4305 * X / (X + 3305.0);
}

/// eps^-chi [Di Felice 1994]
double di_felice_crowding(double eps, double reynolds)
{
    const double offset = reynolds > 0.0 ? 1.5 - std::log10(reynolds) : 10.0;
    return std::pow(eps, -(3.7 - 0.65 * std::exp(-0.5 * offset * offset)));
}

}  // namespace

const std::vector<std::string>& drag_law_names()
{
    static const std::vector<std::string> names{"gidaspow",  "ergun",    "wen-yu",             "schiller-naumann", "di-felice",
                                                "koch-hill", "beetstra", "hoelzer-sommerfeld", "ganser"};
    return names;
}

DragLaw drag_law_from_name(const std::string& name)
{
    const std::vector<std::string>& names = drag_law_names();
    std::string all;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (names[i] == name) return static_cast<DragLaw>(i);
        all += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + names[i];
    }
    throw UsageError("fluid.drag", "unknown drag law '" + name + "'" + did_you_mean(name, names), "use " + all);
}

double single_sphere_drag_factor(double reynolds)
{
    if (reynolds > 1000.0) return 0.44 * reynolds / 24.0;
    return 1.0 + 0.15 * std::pow(reynolds, 0.687);
}

double single_particle_drag_factor(DragLaw law, double reynolds, const DragShape& shape)
{
    const double dallavalle = 0.63 * std::sqrt(reynolds) + 4.8;
    switch (law) {
        case DragLaw::di_felice:
            return dallavalle * dallavalle / 24.0;
        case DragLaw::hoelzer_sommerfeld:
            return hoelzer_sommerfeld_factor(reynolds, shape);
        case DragLaw::ganser:
            return ganser_factor(reynolds, shape);
        default:
            return single_sphere_drag_factor(reynolds);
    }
}

double drag_factor(DragLaw law, double eps, double reynolds, const DragShape& shape)
{
    switch (law) {
        case DragLaw::gidaspow:
            return gidaspow_factor(eps, reynolds);
        case DragLaw::ergun:
            return ergun_factor(eps, reynolds);
        case DragLaw::wen_yu:
            return wen_yu_factor(eps, reynolds);
        case DragLaw::schiller_naumann:
            return single_sphere_drag_factor(reynolds);
        case DragLaw::koch_hill:
            return koch_hill_factor(eps, reynolds);
        case DragLaw::beetstra:
            return beetstra_factor(eps, reynolds);
        default:
            return single_particle_drag_factor(law, reynolds, shape) * di_felice_crowding(eps, reynolds);
    }
}

double drag_coefficient(DragLaw law, double eps, double slip, double diameter, double density, double nu,
                        const DragShape& shape)
{
    if (law == DragLaw::schiller_naumann) eps = 1.0;
    const double reynolds = eps * slip * diameter / nu;
    return 3.0 * std::numbers::pi * eps * density * nu * diameter * drag_factor(law, eps, reynolds, shape);
}

double ergun_pressure_gradient(double eps, double U, double d, double rho, double nu)
{
    const double solid = 1.0 - eps;
    const double eps3 = eps * eps * eps;
    return 150.0 * rho * nu * U * solid * solid / (eps3 * d * d) + 1.75 * rho * U * std::abs(U) * solid / (eps3 * d);
}

}  // namespace coral::fluid
