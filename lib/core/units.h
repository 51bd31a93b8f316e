#pragma once
/// \file core/units.h
/// Quantities as users write them ("30um", "50kPa", "45deg"), converted to SI at the border of the program.
#include <string>
#include <string_view>

namespace coral {

enum class Dimension {
    number,        ///< plain number; "%" is accepted and means 1/100
    length,        ///< m
    time,          ///< s
    mass,          ///< kg
    velocity,      ///< m/s
    acceleration,  ///< m/s2
    angle,         ///< rad
    angular_velocity,     ///< rad/s
    density,              ///< kg/m3
    pressure,             ///< Pa
    stiffness,            ///< N/m
    kinematic_viscosity,  ///< m2/s
    kinematic_pressure,   ///< m2/s2
    force,                ///< N
};

/// SI unit of a dimension as text, "1" for plain numbers.
std::string_view si_unit(Dimension dimension);

/// Value in SI of "30um", "0.2 mm", "1e-6" (a bare number is SI).
/// \throws UsageError naming `where` when the text is no number, has an unknown unit or a unit of another dimension
double parse_quantity(std::string_view text, Dimension dimension, std::string_view where);

/// Human form with an engineering prefix: 3e-5 m -> "30 um".
std::string format_quantity(double value, Dimension dimension);

}  // namespace coral
