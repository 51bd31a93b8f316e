#pragma once
/// \file report/page.h
/// report.html: one file that works offline and says everything without script; scripts add curves to zoom and a 3-D view.
#include <filesystem>
#include <string>
#include <vector>

#include "report/case_data.h"
#include "report/figure.h"
#include "report/report.h"

namespace coral::report {

/// First bytes of the page after the doctype, by which an earlier report is known again.
inline constexpr const char* page_mark = "<!-- coralsand erosion-report -->";

/// \param figures_folder  where draw_figures has put the pictures
/// \param notes           parts left out are added, one sentence each
std::string report_page(const std::vector<CaseData>& cases, const std::vector<Figure>& figures, const std::filesystem::path& figures_folder,
                        const ReportOptions& options, std::vector<std::string>& notes);

}  // namespace coral::report
