#include "report/summary.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace coral::report {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

double last_of(const CaseData& data, const std::string& name)
{
    const Series* series = data.find(name);
    return series && series->width == 1 ? series->values.back() : unknown;
}

double greatest_magnitude(const CaseData& data, const std::string& name)
{
    const Series* series = data.find(name);
    if (!series) return unknown;
    double greatest = unknown;
    for (double v : series->values)
        if (std::isfinite(v) && !(std::abs(v) <= greatest)) greatest = std::abs(v);
    return greatest;
}

/// Median of the finite, positive values of a series between two times; the first one after `from` when there is none between.
double median_between(const CaseData& data, const std::string& name, double from, double to)
{
    const Series* series = data.find(name);
    if (!series || series->width != 1) return unknown;
    std::vector<double> values;
    for (std::size_t i = 0; i < series->steps(); ++i) {
        const double v = series->at(i);
        if (!std::isfinite(v) || v <= 0 || data.time[i] < from) continue;
        if (data.time[i] > to && !values.empty()) break;
        values.push_back(v);
        if (data.time[i] > to) break;
    }
    if (values.empty()) return unknown;
    std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
    return values[values.size() / 2];
}

double least_after(const CaseData& data, const std::string& name, double from)
{
    const Series* series = data.find(name);
    double least = unknown;
    if (!series || series->width != 1) return least;
    for (std::size_t i = 0; i < series->steps(); ++i)
        if (const double v = series->at(i); data.time[i] >= from && std::isfinite(v) && v > 0 && !(v >= least)) least = v;
    return least;
}

/// Fines of the layers plus those eroded, at one output.
double counted_fines(const CaseData& data, std::size_t step)
{
    const Series* fines = data.find("fines_count");
    if (!fines) return unknown;
    const Series* eroded = data.find("eroded_count");
    double count = eroded ? eroded->at(step) : 0;
    for (std::size_t layer = 0; layer < fines->width; ++layer) count += fines->at(step, layer);
    return count;
}

/// Greatest error of the energy ledger over the greatest energy stored in the bodies and their contacts; 0 where the series are not there.
double energy_error(const CaseData& data)
{
    const Series *closure = data.find("energy_closure"), *kinetic = data.find("kinetic_energy"), *elastic = data.find("elastic_energy");
    if (!closure || !kinetic || !elastic) return 0;
    double error = 0, stored = 0;
    for (std::size_t n = 0; n < closure->steps(); ++n) {
        error = std::max(error, std::abs(closure->at(n)));
        stored = std::max(stored, kinetic->at(n) + elastic->at(n));
    }
    return stored > 0 ? error / stored : 0;
}

void warn(const CaseData& data, Summary& summary)
{
    if (data.duration > 0 && summary.end_time < data.duration * (1 - 1e-6))
        summary.warnings.push_back("The run stopped at " + short_number(summary.end_time) + " s of " + short_number(data.duration) +
                                   " s; suffuse --resume goes on.");
    for (const auto& [name, series] : data.series) {
        // A ratio over a flow that does not run yet is no number at the start; later it is a fault.
        const std::size_t from = std::min(series.values.size(), series.width);
        const auto bad = std::count_if(series.values.begin() + static_cast<std::ptrdiff_t>(from), series.values.end(), [](double v) { return std::isinf(v); });
        if (bad > 0) summary.warnings.push_back("The series " + name + " holds " + std::to_string(bad) + " infinite values.");
    }
    const double kinetic = last_of(data, "kinetic_energy");
    if (data.find("kinetic_energy") && !std::isfinite(kinetic)) summary.warnings.push_back("The kinetic energy is not finite at the end: the run diverged.");
    const double sealed = median_between(data, "velocity_sealed", 0.5 * summary.end_time, summary.end_time);
    const double between = median_between(data, "velocity_interparticle", 0.5 * summary.end_time, summary.end_time);
    if (sealed > 0.2 * between)
        summary.warnings.push_back("Water moves at " + short_number(100 * sealed / between, 2) + " % of the speed between the grains in voids that have no way out, where it should be at rest: "
                                   "walls in the grains are too thin for the flow cells, and the velocity inside grains is overstated. A finer --cell helps; a wall needs 1.5 cells.");
    if (const double swallowed = last_of(data, "swallowed_count"); swallowed > 0)
        summary.warnings.push_back(short_number(swallowed, 9) + " fines were pressed wholly into the solid of grains and feel nothing of them any more: loads are higher than this contact stiffness can carry. "
                                   "A higher normal_stiffness helps.");
    if (const double error = energy_error(data); error > 0.01)
        summary.warnings.push_back("The ledger of energy is off by up to " + short_number(100 * error, 2) + " % of what bodies and contacts held at most.");
    if (summary.mass_error > 1e-3 && data.find("mass_balance_error")->unit == "1")
        summary.warnings.push_back("The mass balance is off by up to " + short_number(summary.mass_error, 2) + " (relative).");
    if (summary.momentum_error > 1e-2 && data.find("momentum_balance_error")->unit == "1")
        summary.warnings.push_back("The momentum balance is off by up to " + short_number(summary.momentum_error, 2) + " (relative).");
}

}  // namespace

std::string short_number(double value, int digits)
{
    if (!std::isfinite(value)) return "-";
    char text[48];
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    return text;
}

Summary summarise(const CaseData& data)
{
    Summary s{};
    s.end_time = data.time.back();
    s.eroded_mass_fraction = last_of(data, "eroded_mass_fraction");
    s.eroded_count = last_of(data, "eroded_count");
    s.fines_at_start = counted_fines(data, 0);
    s.trapped_count = last_of(data, "trapped_count");
    const double start = data.time.front(), span = s.end_time - start;
    const auto early = [&](const char* name) { return median_between(data, name, start + 0.05 * span, start + 0.15 * span); };
    const auto late = [&](const char* name) { return median_between(data, name, start + 0.9 * span, s.end_time); };
    s.gradient_early = early("hydraulic_gradient");
    s.gradient_late = late("hydraulic_gradient");
    s.conductivity_early = early("hydraulic_conductivity");
    s.conductivity_late = late("hydraulic_conductivity");
    s.conductivity_least = least_after(data, "hydraulic_conductivity", start + 0.05 * span);
    s.mass_error = greatest_magnitude(data, "mass_balance_error");
    s.momentum_error = greatest_magnitude(data, "momentum_balance_error");
    warn(data, s);
    return s;
}

std::string verdict(const Summary& s)
{
    std::string text;
    if (s.fines_at_start == 0) {
        text = "Ran to " + short_number(s.end_time) + " s without fines";
    } else if (std::isfinite(s.eroded_mass_fraction)) {
        text = short_number(100 * s.eroded_mass_fraction, 3) + " % of the fines' mass eroded in " + short_number(s.end_time) + " s";
        if (std::isfinite(s.eroded_count))
            text += " (" + short_number(s.eroded_count, 9) + (std::isfinite(s.fines_at_start) ? " of " + short_number(s.fines_at_start, 9) : "") + " fines)";
        if (std::isfinite(s.trapped_count)) text += "; " + short_number(s.trapped_count, 9) + " trapped inside grains";
    } else {
        text = "Ran to " + short_number(s.end_time) + " s; no erosion was measured";
    }
    if (std::isfinite(s.conductivity_early) && std::isfinite(s.conductivity_late))
        text += "; hydraulic conductivity from " + short_number(100 * s.conductivity_early, 3) + " to " + short_number(100 * s.conductivity_late, 3) +
                " cm/s (× " + short_number(s.conductivity_late / s.conductivity_early, 3) + ")";
    return text + ".";
}

}  // namespace coral::report
