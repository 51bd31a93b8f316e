#pragma once
/// \file report/case_data.h
/// What one finished (or stopped) suffusion case holds, as the report needs it. SI units throughout.
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/record.h"

namespace coral::report {

/// One `/series/<name>` of results.h5: `width` numbers at each output time, row by row.
struct Series {
    std::string unit;
    std::size_t width = 1;
    std::vector<double> values;  ///< [steps * width]

    std::size_t steps() const { return values.size() / width; }
    double at(std::size_t step, std::size_t component = 0) const { return values[step * width + component]; }
};

/// `/trajectories`: tracked bodies at each output time. Arrays that the file lacks are empty.
struct Tracks {
    std::vector<std::int64_t> id;     ///< body numbers, [bodies]
    std::vector<double> time;         ///< [s], [steps]
    std::vector<double> position;     ///< [m], [steps, bodies, 3]
    std::vector<double> orientation;  ///< unit quaternions (w, x, y, z), [steps, bodies, 4]
    std::vector<double> speed;        ///< [m/s], [steps, bodies]
};

/// `/migration`: how far each fine came.
struct Migration {
    std::vector<std::int64_t> id;
    std::vector<double> path_length;       ///< [m]
    std::vector<double> net_displacement;  ///< between the first and the last output [m]
    std::vector<std::int64_t> layer;       ///< layer at the start, 0 at the bottom
    std::vector<std::int64_t> eroded;      ///< 1 once below the filter plate
    std::vector<std::int64_t> state;       ///< at the end: 0 never moved, 1 moving, 2 clogged, 3 eroded; empty in older results
    std::vector<std::int64_t> cloggings;   ///< how often the fine stopped after moving
};

/// `/trapped`: fines in the voids of grains at the end.
struct TrappedFines {
    std::vector<std::int64_t> fine, grain;  ///< body numbers
    std::vector<std::int64_t> enclosed;     ///< 1 when the whole fine is inside, 0 in the mouth of a void
    std::vector<double> way_out;            ///< width of the widest throat on the way out / diameter of the fine; of those for which both are known
};

/// A body as drawn: `shape` is the template k of `/shapes/<k>` in sample.h5, or -1 for a sphere that case.toml describes.
struct Body {
    std::string role;
    std::int64_t shape = -1;
    double scale = 1;
    double diameter = 0;  ///< equivalent diameter [m]; 0 when unknown
};

/// Internal-stability criterion as stored with the sample.
struct Criterion {
    std::string name;
    double value = 0, threshold = 0;
    std::string verdict;
    std::string definition;  ///< value, condition and source in one line; may be empty
};

/// A line of a two-column table: what, and its value as text with unit.
struct Setting {
    std::string name, value;
};

/// Filter plate: square holes of edge `hole` every `pitch`, at height `z` [m].
struct Plate {
    double z = 0, hole = 0, pitch = 0;
};

struct CaseData {
    std::string name;  ///< shown in legends and in the column `case`
    std::string label; ///< runs with the same label repeat one case with other packings; empty when none was given
    std::size_t repeats = 1;              ///< runs behind it (pool.h)
    std::map<std::string, Series> low, high;  ///< least and greatest over the repeats; empty for one run
    std::filesystem::path folder;
    std::vector<double> time;  ///< [s]
    std::map<std::string, Series> series;
    Tracks tracks;
    Migration migration;
    TrappedFines trapped;
    std::size_t layers = 3;               ///< that fines are counted in
    std::vector<Setting> performance;
    History history;

    std::filesystem::path sample;  ///< sample.h5, empty when there is none
    std::vector<Body> bodies;      ///< those of the sample, then those of case.toml
    std::vector<Criterion> criteria;
    std::vector<double> psd_diameter, psd_passing;  ///< [m], fraction of mass finer

    std::string case_toml;  ///< as run (kept in results.h5) or as it lies in the folder; empty when absent
    std::vector<Setting> setup;
    double duration = 0;             ///< asked for in case.toml [s]; 0 when unknown
    double domain_origin[3] = {};    ///< [m]
    double domain_size[3] = {};      ///< [m]; zeros when unknown
    std::vector<Plate> plates;
    std::vector<std::string> notes;  ///< what could not be read, one sentence each

    /// The series, or null when the run did not write it.
    const Series* find(const std::string& series_name) const;
};

/// Reads `folder/results.h5` and, when present, `sample.h5` and `case.toml`; optional parts that are missing stay empty.
/// \throws UsageError when the folder is missing
/// \throws Error      when results.h5 is missing or damaged, or its series disagree in length
CaseData read_case(const std::filesystem::path& folder);

/// Reads several cases and makes their names unique (folder name; with its parent when two agree).
/// A folder may be given as LABEL=FOLDER: the case is then called so; several with one label are repeats, called "LABEL (folder name)". Double quotes and commas become ' and ;.
/// What exists as it stands is a folder, whatever signs it holds.
std::vector<CaseData> read_cases(const std::vector<std::filesystem::path>& folders);

/// Column names of a series: itself, or with `_bottom, _middle, _top` (fines_count of three layers), `_xx` ... (contact_fabric), `_x, _y, _z`,
/// `_1` ... (from the bottom upwards for layers) when it has several components.
std::vector<std::string> column_names(const std::string& series, std::size_t width);

}  // namespace coral::report
