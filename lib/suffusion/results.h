#pragma once
/// \file suffusion/results.h
/// results.h5: what a run has measured so far. The file is rewritten whole, so it can be read at any time.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "suffusion/trapping.h"

namespace coral::suffusion {

/// One quantity over time: `width` numbers for each row (series) or for each row and tracked body (trajectories).
struct Column {
    std::string name;
    std::string unit;
    std::size_t width = 1;
    std::vector<double> values;
};

/// One number of /performance, with its unit.
struct Measure {
    std::string name;
    std::string unit;
    double value = 0;
};

struct Results {
    std::vector<Column> series;           ///< /series/<name>, the first is time
    std::vector<std::int64_t> tracked;    ///< /trajectories/id: body numbers
    std::vector<Column> trajectories;     ///< /trajectories/<name> [nt, m(, width)]
    std::vector<std::int64_t> fines;      ///< /migration/id
    std::vector<double> path_length;      ///< followed through every step [m]
    std::vector<double> net_displacement; ///< [m]
    std::vector<std::int64_t> layer;      ///< at the start: 0 bottom ... layers - 1 top
    std::vector<std::int64_t> eroded;     ///< 1 once below the filter plate
    std::vector<std::int64_t> state;      ///< FineState at the last output
    std::vector<std::int64_t> cloggings;  ///< how often the fine stopped after moving
    std::vector<Trapped> trapped;         ///< /trapped: fines in voids at the last output
    std::vector<Measure> performance;     ///< wall-clock values: the only part of the file that differs between two equal runs
    std::string history;                  ///< JSON
    std::string case_text;                ///< case.toml as read

    std::size_t rows() const;
    Column& column(const std::string& name);  ///< of the series; made when new
    /// Drops rows from `count` on (a resumed run goes on from its checkpoint).
    void truncate(std::size_t count);
};

/// Whole or not at all. \throws Error when the file cannot be written
void write_results(const std::filesystem::path& file, const Results& results);
/// \throws Error when missing, damaged or not a results file
Results read_results(const std::filesystem::path& file);

}  // namespace coral::suffusion
