#pragma once
/// \file fluid/drag.h
/// Drag laws of particles smaller than a few cells.
/// Force on a particle: F = b (u - v), b = 3 pi eps rho nu d fhat(eps, Re), with u the interstitial fluid velocity and
/// Re = eps |u - v| d / nu (superficial slip: only then does Gidaspow's dense branch reproduce Ergun [Huang et al., eq.
/// 12-14]). The force of the pressure gradient, -V grad p, is separate (model A).
#include <string>

namespace coral::fluid {

enum class DragLaw {
    gidaspow,  ///< Ergun below a void fraction of 0.75, Wen-Yu above 0.85, blended in between (the plain switch at 0.8
               ///< jumps by 15 %)
    ergun,     ///< Ergun 1952 at any void fraction
    wen_yu,    ///< Wen and Yu 1966: single-particle drag times eps^-3.65
    schiller_naumann,  ///< one particle alone; the void fraction is ignored
};

/// "gidaspow", "ergun", "wen-yu" or "schiller-naumann". \throws UsageError listing the names
DragLaw drag_law_from_name(const std::string& name);

/// Drag over Stokes drag of one sphere, Schiller and Naumann 1933: 1 + 0.15 Re^0.687 up to Re 1000, then C_D = 0.44.
double single_sphere_drag_factor(double reynolds);

/// fhat(eps, Re) >= 0 [Huang et al., eq. 13]. \param void_fraction in (0, 1] \param reynolds with the superficial slip
double drag_factor(DragLaw law, double void_fraction, double reynolds);

/// b [kg/s] in F = b (u - v). \param slip |u - v|, interstitial [m/s] \param density, kinematic_viscosity of the fluid
double drag_coefficient(DragLaw law, double void_fraction, double slip, double diameter, double density,
                        double kinematic_viscosity);

/// Pressure gradient of a uniform packed bed, Ergun 1952 [Pa/m]. \param superficial_velocity [m/s]
double ergun_pressure_gradient(double void_fraction, double superficial_velocity, double diameter, double density,
                               double kinematic_viscosity);

}  // namespace coral::fluid
