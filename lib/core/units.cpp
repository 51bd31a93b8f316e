#include "core/units.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/text.h"

namespace coral {
namespace {

struct Unit {
    std::string_view name;
    double factor;
};

/// Units accepted for a dimension, the SI unit first.
const std::vector<Unit>& units_of(Dimension dimension)
{
    static const std::vector<Unit> number{{"1", 1}, {"%", 0.01}};
    static const std::vector<Unit> length{{"m", 1}, {"nm", 1e-9}, {"um", 1e-6}, {"µm", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}, {"km", 1e3}};
    static const std::vector<Unit> time{{"s", 1}, {"ns", 1e-9}, {"us", 1e-6}, {"ms", 1e-3}, {"min", 60}, {"h", 3600}};
    static const std::vector<Unit> mass{{"kg", 1}, {"mg", 1e-6}, {"g", 1e-3}, {"t", 1e3}};
    static const std::vector<Unit> velocity{{"m/s", 1}, {"um/s", 1e-6}, {"mm/s", 1e-3}, {"cm/s", 1e-2}};
    static const std::vector<Unit> acceleration{{"m/s2", 1}, {"m/s^2", 1}, {"mm/s2", 1e-3}, {"cm/s2", 1e-2}};
    static const std::vector<Unit> angle{{"rad", 1}, {"deg", std::numbers::pi / 180}};
    static const std::vector<Unit> angular_velocity{{"rad/s", 1}, {"deg/s", std::numbers::pi / 180}, {"rpm", std::numbers::pi / 30}};
    static const std::vector<Unit> density{{"kg/m3", 1}, {"kg/m^3", 1}, {"g/cm3", 1000}, {"g/cm^3", 1000}};
    static const std::vector<Unit> pressure{{"Pa", 1}, {"kPa", 1e3}, {"MPa", 1e6}, {"GPa", 1e9}, {"bar", 1e5}};
    static const std::vector<Unit> stiffness{{"N/m", 1}, {"kN/m", 1e3}, {"MN/m", 1e6}, {"N/mm", 1e3}};
    static const std::vector<Unit> viscosity{{"m2/s", 1}, {"m^2/s", 1}, {"mm2/s", 1e-6}, {"cSt", 1e-6}};
    static const std::vector<Unit> kinematic_pressure{{"m2/s2", 1}, {"m^2/s^2", 1}};
    static const std::vector<Unit> force{{"N", 1}, {"uN", 1e-6}, {"mN", 1e-3}, {"kN", 1e3}};
    switch (dimension) {
        case Dimension::number: return number;
        case Dimension::length: return length;
        case Dimension::time: return time;
        case Dimension::mass: return mass;
        case Dimension::velocity: return velocity;
        case Dimension::acceleration: return acceleration;
        case Dimension::angle: return angle;
        case Dimension::angular_velocity: return angular_velocity;
        case Dimension::density: return density;
        case Dimension::pressure: return pressure;
        case Dimension::stiffness: return stiffness;
        case Dimension::kinematic_viscosity: return viscosity;
        case Dimension::kinematic_pressure: return kinematic_pressure;
        case Dimension::force: return force;
    }
    return number;
}

std::string list_of(const std::vector<Unit>& units)
{
    std::string text;
    for (const Unit& unit : units) text.append(text.empty() ? "" : ", ").append(unit.name);
    return text;
}

}  // namespace

std::string_view si_unit(Dimension dimension) { return units_of(dimension).front().name; }

double parse_quantity(std::string_view text, Dimension dimension, std::string_view where)
{
    const std::string_view whole = text;
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    double value = 0;
    const auto [rest, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    const std::vector<Unit>& units = units_of(dimension);
    const std::string quoted = "'" + std::string(whole) + "'";
    if (failure != std::errc{} || !std::isfinite(value)) {
        const std::string example = dimension == Dimension::number ? "0.3" : "0.3" + std::string(units.size() > 3 ? units[3].name : units[0].name);
        throw UsageError(where, quoted + " is not a quantity", "write a number and a unit, such as " + example);
    }
    std::string_view unit(rest, static_cast<std::size_t>(text.data() + text.size() - rest));
    while (!unit.empty() && unit.front() == ' ') unit.remove_prefix(1);
    while (!unit.empty() && unit.back() == ' ') unit.remove_suffix(1);
    if (unit.empty()) return value;
    const auto found = std::ranges::find(units, unit, &Unit::name);
    if (found == units.end())
        throw UsageError(where, quoted + " has the unit '" + std::string(unit) + "'", "use one of: " + list_of(units));
    return value * found->factor;
}

std::string format_quantity(double value, Dimension dimension)
{
    // Prefixed units that people read easily; the largest that leaves a number of at least one.
    static constexpr std::array readable{"nm", "um", "mm", "m", "ns", "us", "ms", "s", "mg", "g", "kg", "mm/s", "m/s", "Pa", "kPa", "MPa"};
    const std::vector<Unit>& units = units_of(dimension);
    const Unit* best = &units.front();
    for (const Unit& unit : units) {
        const bool known = std::ranges::find(readable, unit.name) != readable.end();
        if (!known || value == 0) continue;
        const double size = std::abs(value) / unit.factor;
        const double best_size = std::abs(value) / best->factor;
        if (size >= 1 - 1e-12 && (best_size < 1 - 1e-12 || size < best_size)) best = &unit;
    }
    double shown = value / best->factor;
    // For reading: six digits, which also hides the noise of dividing by a decimal factor (0.2 mm / 1e-3).
    std::array<char, 32> buffer;
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), shown, std::chars_format::general, 6).ptr;
    std::string text(buffer.data(), end);
    if (dimension == Dimension::number) return text;
    return text + " " + std::string(best->name);
}

}  // namespace coral
