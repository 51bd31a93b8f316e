#pragma once
/// \file report/detail/figures.h
/// Builders of the figures that are no curves over time. Each may return a figure without rows.
#include <cmath>
#include <string>
#include <vector>

#include "report/figure.h"

namespace coral::report::detail {

/// Number, or an empty cell where it is not finite.
inline Cell number_cell(double value)
{
    if (std::isfinite(value)) return value;
    return std::string();
}

/// Whether a case has fines at all: without, curves of erosion are flat lines that say nothing.
bool has_fines(const CaseData& data);
/// "bottom", "middle", "top" of three layers, else "1" (bottom) to "n (top)".
std::vector<std::string> layer_names(std::size_t layers);

// The sample and what is left of it (figures_sample.cpp).
Figure layer_bars(const std::vector<CaseData>& cases);
Figure gradation(const std::vector<CaseData>& cases);
Figure stability_table(const std::vector<CaseData>& cases);
// Single fines (figures_fines.cpp).
std::vector<Figure> migration_figures(const std::vector<CaseData>& cases);
Figure fine_paths(const std::vector<CaseData>& cases);
Figure fine_speeds(const std::vector<CaseData>& cases);
Figure trapped_by_grain(const std::vector<CaseData>& cases);
Figure trapped_by_throat(const std::vector<CaseData>& cases);

}  // namespace coral::report::detail
