#pragma once
/// \file report/report.h
/// The whole report as a folder: erosion.csv, figures/, report.html.
#include <filesystem>
#include <string>
#include <vector>

#include "core/record.h"
#include "report/case_data.h"

namespace coral::report {

struct ReportOptions {
    std::filesystem::path libraries = "/usr/share/javascript";  ///< folder with dygraphs/ and three/ as Debian installs them
    RecordEntry record;                                         ///< this run, last step of the history on the page
};

/// What write_report did.
struct ReportOutcome {
    std::vector<std::string> figures;  ///< stems of the figures drawn
    std::size_t page_bytes = 0;
    std::vector<std::string> notes;    ///< parts left out and why
};

/// Writes the report. The folder appears whole: it is made beside its place under a temporary name and then moved there; an earlier
/// report in that place is replaced, any other folder with content is refused. Same cases, same bytes.
/// \throws Error when the folder cannot be written or holds files that are not of a report, or gnuplot is missing or fails
ReportOutcome write_report(const std::vector<CaseData>& cases, const std::filesystem::path& folder, const ReportOptions& options);

}  // namespace coral::report
