// What a planned case may be wrong by, from the tables of docs/speed-and-error.md.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "suffusion/plan.h"

namespace coral::suffusion {

namespace {

struct Measured {
    double at, error;
};

/// Along the measured points of a table, straight in logarithms; beyond its ends the value there, for nothing was measured.
double interpolate(std::span<const Measured> table, double at)
{
    at = std::clamp(at, table.front().at, table.back().at);
    std::size_t k = 1;
    while (k + 1 < table.size() && table[k].at < at) ++k;
    const Measured &low = table[k - 1], &high = table[k];
    const double part = std::log(at / low.at) / std::log(high.at / low.at);
    return low.error * std::pow(high.error / low.error, part);
}

std::string percent(double error)
{
    return fmt::format("{:.2g} %", 100 * error);
}

// Drag of a fixed sphere at Re 100 and of a sphere in a square duct, the worse of both, by cells per diameter [docs/validation/fluid.md, semi-resolved.md].
constexpr Measured resolved_drag[] = {{5, 0.33}, {8, 0.13}, {10, 0.068}, {15, 0.052}, {20, 0.025}};
// Scatter of the force of one contact of a porous grain of 15 mm by surface nodes, at overlaps of 100 and 300 um [docs/validation/dem-accuracy.md].
constexpr Measured weak_scatter[] = {{1000, 1.1}, {2500, 0.73}, {6000, 0.28}, {12000, 0.17}, {24000, 0.065}};
constexpr Measured strong_scatter[] = {{1000, 0.57}, {2500, 0.19}, {6000, 0.11}, {12000, 0.05}, {24000, 0.03}};
constexpr double kernel_force = 0.01, kernel_bed = 0.07, kernel_in_pore = 0.27;
constexpr double tight_wall_cells = 2, throat_bias = 0.1, query_bias = 0.56;

std::string of_schemes(const Plan& plan, const PopulationPlan& p)
{
    if (p.count == 0) return {};
    if (p.scheme == Scheme::resolved)
        return fmt::format("{:<9} drag {}{} on a grain alone ({:.0f} cells per diameter); walls of voids thinner than {} let water through\n", p.role,
                           p.smallest / plan.domain.cell > std::end(resolved_drag)[-1].at ? "under " : "",
                           percent(interpolate(resolved_drag, p.smallest / plan.domain.cell)), p.smallest / plan.domain.cell,
                           format_quantity(tight_wall_cells * plan.domain.cell, Dimension::length));
    return fmt::format("{:<9} drag {} of its law on a grain alone, {} in a bed; in pores of two diameters {} low\n", p.role, percent(kernel_force), percent(kernel_bed),
                       percent(kernel_in_pore));
}

}  // namespace

std::string explain_accuracy(const Plan& plan, const pack::Sample& sample)
{
    double spacing = 0;
    std::size_t fewest_nodes = 0;
    for (const pack::ShapeTemplate& shape : sample.shapes) {
        if (!shape.grid) continue;
        spacing = std::max(spacing, shape.grid->spacing);
        if (shape.kind == pack::ShapeKind::level_set && (fewest_nodes == 0 || shape.nodes.size() < fewest_nodes)) fewest_nodes = shape.nodes.size();
    }
    std::string text = "expected errors (measured on known cases: docs/speed-and-error.md)\n";
    for (const PopulationPlan& p : plan.populations) text += of_schemes(plan, p);
    if (spacing > 0)
        text += fmt::format("throats   about {} too narrow for a fine that two walls press ({} spacing), {} where it meets one wall at a time\n",
                            format_quantity(throat_bias * spacing, Dimension::length), format_quantity(spacing, Dimension::length),
                            format_quantity(query_bias * spacing, Dimension::length));
    if (fewest_nodes > 0)
        text += fmt::format("contact   forces of {} nodes right on average, single ones scatter by {} at 4.5 N and {} at 25 N\n", fewest_nodes,
                            percent(interpolate(weak_scatter, static_cast<double>(fewest_nodes))), percent(interpolate(strong_scatter, static_cast<double>(fewest_nodes))));
    return text;
}

}  // namespace coral::suffusion
