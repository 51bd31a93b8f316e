// Tables of ours, known by their columns.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/table.h"
#include "grain-info/describe.h"

namespace coral::grain_info {
namespace {

/// Tables of ours by columns they start with, and who writes them.
struct KnownTable {
    const char* beginning;
    const char* kind;
};
constexpr KnownTable known_tables[] = {
    {"id,label,voxels,volume", "table of grains (csct2ls --table)"},
    {"id,degree,method,rms_error,max_error,volume_error,area_error,inertia_error,non_star_fraction,seconds", "table of harmonic shapes (ls2sh --table)"},
    {"id,degree,method,rms_error", "errors by degree (ls2sh --convergence)"},
    {"id,void,volume", "table of voids (csct2ls --voids)"},
    {"case,time", "series of cases (erosion-report)"},
    {"label,kind,volume,apparent_volume", "true figures of a made sample (make-sample-ct)"},
};

}  // namespace

Report describe_table(const std::filesystem::path& file)
{
    const Table table = read_table(file);
    std::string columns;
    for (const std::string& name : table.columns) columns += name + ",";
    const auto known = std::ranges::find_if(known_tables, [&](const KnownTable& k) { return columns.starts_with(k.beginning); });
    if (known == std::end(known_tables)) throw Error(file.string(), "is a table, but none of ours (its columns: " + columns.substr(0, std::min<std::size_t>(columns.size() - 1, 60)) + ")",
                    "known are the tables of csct2ls, ls2sh, make-sample-ct and erosion-report");
    Report report(known->kind);
    report.add("rows", table.rows.size());
    Json ranges = Json::object();
    std::vector<std::string> lines;
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
        std::vector<double> values;
        for (const auto& row : table.rows)
            if (const double* value = std::get_if<double>(&row[c]); value && std::isfinite(*value)) values.push_back(*value);
        std::ranges::sort(values);
        if (values.empty()) {
            ranges[table.columns[c]] = nullptr;
            lines.push_back(table.columns[c]);
            continue;
        }
        const double middle = 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
        ranges[table.columns[c]] = {values.front(), middle, values.back()};
        lines.push_back(fmt::format("{}: {:.6g} to {:.6g}, median {:.6g}", table.columns[c], values.front(), values.back(), middle));
    }
    report.list("columns", ranges, lines);
    return report;
}

}  // namespace coral::grain_info
