#pragma once
/// \file report/summary.h
/// The few numbers that say how a run went: the verdict of the page and the --json of the tool.
#include <string>
#include <vector>

#include "report/case_data.h"

namespace coral::report {

/// NaN stands for "the run did not measure it". SI.
struct Summary {
    double end_time;              ///< last output [s]
    double eroded_mass_fraction;  ///< at the end
    double eroded_count;          ///< at the end
    double fines_at_start;        ///< in the three layers at the first output, plus those eroded by then
    double trapped_count;         ///< at the end
    /// Early: median of the outputs in 5 to 15 % of the run, after the flow has started up; late: in the last 10 %. [-], [m/s]
    double gradient_early, gradient_late, conductivity_early, conductivity_late;
    double conductivity_least;    ///< after the first 5 % of the run [m/s]
    double mass_error, momentum_error;                                 ///< greatest magnitude over the run, unit of the series
    std::vector<std::string> warnings;  ///< what makes the run less than it seems, one sentence each
};

Summary summarise(const CaseData& data);

/// "23.4 % of the fines' mass eroded in 2 s (912 of 3900 fines); 35 trapped inside grains; hydraulic conductivity from 1.7 to 4.4 cm/s (× 2.6)."
std::string verdict(const Summary& summary);

/// Number with so many significant digits, no trailing zeros; "-" for NaN.
std::string short_number(double value, int digits = 4);

}  // namespace coral::report
