#pragma once
/// \file fluid/drag.h
/// Drag laws of particles smaller than a few cells.
/// Force on a particle: F = b (u - v), b = 3 pi eps rho nu d fhat(eps, Re), with u the interstitial fluid velocity and
/// Re = eps |u - v| d / nu (superficial slip: only then does Gidaspow's dense branch reproduce Ergun [Huang et al., eq.
/// 12-14]). The force of the pressure gradient, -V grad p, is separate (model A).
#include <string>
#include <vector>

namespace coral::fluid {

/// Laws of one particle alone take the presence of others by Di Felice's factor eps^-chi; bed laws hold for spheres.
enum class DragLaw {
    gidaspow,  ///< Ergun below a void fraction of 0.75, Wen-Yu above 0.85, blended in between (the plain switch at 0.8
               ///< jumps by 15 %)
    ergun,     ///< Ergun 1952 at any void fraction
    wen_yu,    ///< Wen and Yu 1966: single-particle drag times eps^-3.65
    schiller_naumann,    ///< one particle alone; the void fraction is ignored
    di_felice,           ///< Di Felice 1994: Dallavalle's sphere times eps^-chi, chi = 3.7 - 0.65 exp(-(1.5 - lg Re)^2/2)
    koch_hill,           ///< Koch and Hill 2001, from lattice-Boltzmann beds; void fraction 0.35 to 0.9, a lone grain is off
    beetstra,            ///< Beetstra, van der Hoef and Kuipers 2007, the same, Re up to 1000
    hoelzer_sommerfeld,  ///< Hoelzer and Sommerfeld 2008: irregular particles, orientation counts; times eps^-chi
    ganser,              ///< Ganser 1993: irregular particles, times eps^-chi
};

/// What a drag law may know of the shape of a particle. Both are 1 for a sphere.
struct DragShape {
    double sphericity = 1.0;  ///< surface of the sphere of equal volume over the surface
    double crosswise_sphericity = 1.0;  ///< section of the sphere of equal volume over the area seen along the slip
};

/// Names as case.toml has them: gidaspow, ergun, wen-yu, ...; in the order of DragLaw.
const std::vector<std::string>& drag_law_names();
/// \throws UsageError listing the names
DragLaw drag_law_from_name(const std::string& name);

/// Drag over Stokes drag of one sphere, Schiller and Naumann 1933: 1 + 0.15 Re^0.687 up to Re 1000, then C_D = 0.44.
double single_sphere_drag_factor(double reynolds);

/// C_D Re/24 of one particle alone by the law's own correlation (Schiller and Naumann's where the law is one of beds);
/// C_D refers to the section of the sphere of equal volume, Re to its diameter.
///     di_felice           C_D = (0.63 + 4.8/sqrt(Re))^2                                     [Dallavalle 1948]
///     hoelzer_sommerfeld  C_D = 8/(Re sqrt(c)) + 16/(Re sqrt(s)) + 3/(sqrt(Re) s^(3/4)) + 0.42 10^(0.4 (-lg s)^0.2)/c
///                         [Powder Technol. 184:361, eq. 9, lengthwise sphericity taken as crosswise, c; s sphericity]
///     ganser              C_D/K2 = 24/X (1 + 0.1118 X^0.6567) + 0.4305/(1 + 3305/X), X = K1 K2 Re,
///                         K1 = 1/(1/(3 sqrt(c)) + 2/(3 sqrt(s))), K2 = 10^(1.8148 (-lg s)^0.5743)
///                         [Powder Technol. 77:143; c = 1 is his isometric particle]
double single_particle_drag_factor(DragLaw law, double reynolds, const DragShape& shape = {});

/// fhat(eps, Re) >= 0 [Huang et al., eq. 13]. \param void_fraction in (0, 1] \param reynolds with the superficial slip
///     koch_hill  eps (F0 + F3 Re/2), F3 = 0.0673 + 0.212 phi + 0.0232/eps^5, phi = 1 - eps; F0 = 10 phi/eps^3 from
///                phi = 0.4 on, below (1 + 3 sqrt(phi/2) + 135/64 phi ln phi + 16.14 phi)/(1 + 0.681 phi - 8.48 phi^2
///                + 8.16 phi^3)   [Annu. Rev. Fluid Mech. 33:619, whose Re has the radius: hence Re/2]
///     beetstra   10 phi/eps^2 + eps^2 (1 + 1.5 sqrt(phi))
///                + 0.413 Re/(24 eps^2) (1/eps + 3 eps phi + 8.4 Re^-0.343)/(1 + 10^(3 phi) Re^-(0.5 + 2 phi))
///                [AIChE J. 53:489, eq. 21]
double drag_factor(DragLaw law, double void_fraction, double reynolds, const DragShape& shape = {});

/// b [kg/s] in F = b (u - v). \param slip |u - v|, interstitial [m/s] \param diameter of the sphere of equal volume [m]
/// \param density, kinematic_viscosity of the fluid
double drag_coefficient(DragLaw law, double void_fraction, double slip, double diameter, double density,
                        double kinematic_viscosity, const DragShape& shape = {});

/// Pressure gradient of a uniform packed bed, Ergun 1952 [Pa/m]. \param superficial_velocity [m/s]
double ergun_pressure_gradient(double void_fraction, double superficial_velocity, double diameter, double density,
                               double kinematic_viscosity);

}  // namespace coral::fluid
