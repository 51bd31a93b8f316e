// Figures of single fines: how far they came, on which paths, where they are trapped. Numbers in brackets are those of Huang et al.
#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <numeric>

#include "report/detail/figures.h"
#include "report/summary.h"

namespace coral::report::detail {
namespace {

/// A figure over sorted path lengths: which fines count, and what is drawn of the i-th of n.
struct PathFigure {
    const char *name, *title, *caption, *column, *y_label;
    double factor;
    bool logarithmic, top_only, last_too;
    std::function<double(std::size_t i, std::size_t n, double repeats)> value;
};

const std::vector<PathFigure>& path_figures()
{
    static const std::vector<PathFigure> all{
        {"migration_distance", "Migration distance", "Number of fines whose path (moves summed over the outputs) is longer than d; of repeats, the mean of a run [Fig. 21].",
         "count_farther", "fines that came farther than d [count]", 1, true, false, false,
         [](std::size_t i, std::size_t n, double repeats) { return static_cast<double>(n - 1 - i) / repeats; }},
        {"migration_top_layer", "Migration of the fines of the top layer", "Share of the fines that start in the top layer whose path is not longer than d [Fig. 13].",
         "fraction_not_farther", "share of the fines [%]", 100, false, true, true,
         [](std::size_t i, std::size_t n, double) { return static_cast<double>(i + 1) / static_cast<double>(n); }},
    };
    return all;
}

std::vector<double> sorted_paths(const CaseData& data, bool top_only)
{
    std::vector<double> paths;
    for (std::size_t i = 0; i < data.migration.path_length.size(); ++i) {
        const bool counts = !top_only || (i < data.migration.layer.size() && data.migration.layer[i] + 1 == static_cast<std::int64_t>(data.layers));
        if (counts && std::isfinite(data.migration.path_length[i])) paths.push_back(data.migration.path_length[i]);
    }
    std::ranges::sort(paths);
    return paths;
}

Figure path_figure(const PathFigure& spec, const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = spec.name;
    figure.title = spec.title;
    figure.caption = spec.caption;
    figure.kind = FigureKind::steps;
    figure.x_column = "path_length";
    figure.x_label = "path length d [mm]";
    figure.x_factor = 1000;
    figure.table.columns = {"case", "path_length", spec.column};
    figure.panels = {{"", spec.y_label, spec.factor, spec.logarithmic, {{spec.column, {}, {}, {}, {}}}, {}}};
    for (const CaseData& data : cases) {
        const std::vector<double> paths = sorted_paths(data, spec.top_only);
        for (std::size_t i = 0; i + (spec.last_too ? 0 : 1) < paths.size(); ++i)
            figure.table.add({data.name, paths[i], spec.value(i, paths.size(), static_cast<double>(data.repeats))});
    }
    return figure;
}

/// A fine that tells a story: its column in the tracks, and a name for the legend.
struct Chosen {
    std::size_t column;
    std::string name;
};

/// Up to three fines that ended clogged (those that clogged several times first, then by path) and three that were eroded (median paths among the eroded).
/// Results without states take the shortest and the longest paths.
std::vector<Chosen> choose_fines(const CaseData& data)
{
    const Migration& m = data.migration;
    if (m.path_length.size() < m.id.size() || m.id.size() < 4) return {};
    std::map<std::int64_t, std::size_t> column_of;
    for (std::size_t c = 0; c < data.tracks.id.size(); ++c) column_of[data.tracks.id[c]] = c;
    std::vector<std::size_t> clogged, eroded;
    for (std::size_t i = 0; i < m.id.size(); ++i) {
        if (!std::isfinite(m.path_length[i]) || !column_of.contains(m.id[i])) continue;
        const bool left = i < m.eroded.size() && m.eroded[i] != 0;
        if (left) eroded.push_back(i);
        else if (m.state.empty() || m.state[i] == 2) clogged.push_back(i);
    }
    const auto times_clogged = [&](std::size_t i) { return i < m.cloggings.size() ? std::min<std::int64_t>(m.cloggings[i], 2) : 0; };
    std::ranges::stable_sort(clogged, [&](std::size_t a, std::size_t b) {
        return times_clogged(a) != times_clogged(b) ? times_clogged(a) > times_clogged(b) : m.path_length[a] > m.path_length[b];
    });
    std::ranges::stable_sort(eroded, [&](std::size_t a, std::size_t b) { return m.path_length[a] < m.path_length[b]; });
    std::vector<Chosen> chosen;
    for (std::size_t k = 0; k < std::min<std::size_t>(3, clogged.size()); ++k)
        chosen.push_back({column_of[m.id[clogged[k]]], "P" + std::to_string(k + 1) + " clogged"});
    for (std::size_t k = 0; k < std::min<std::size_t>(3, eroded.size()); ++k)
        chosen.push_back({column_of[m.id[eroded[(2 * k + 1) * eroded.size() / 6]]], "P" + std::to_string(k + 4) + " eroded"});
    return chosen;
}

}  // namespace

std::vector<Figure> migration_figures(const std::vector<CaseData>& cases)
{
    std::vector<Figure> figures;
    for (const PathFigure& spec : path_figures()) figures.push_back(path_figure(spec, cases));
    return figures;
}

Figure fine_paths(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "fine_paths";
    figure.title = "Paths of six fines";
    figure.caption = "Seen from the side: three fines that ended clogged after moving and three that were eroded, of the first run of each case [Fig. 14a].";
    figure.kind = FigureKind::paths;
    figure.x_column = "time";
    figure.x_label = "x [mm]";
    figure.x_factor = 1000;
    figure.table.columns = {"case", "time"};
    for (int k = 1; k <= 6; ++k)
        for (const char* axis : {"x_", "y_", "z_"}) figure.table.columns.push_back(axis + std::to_string(k));
    for (const CaseData& data : cases) {
        if (data.tracks.position.empty() || figure.panels.size() == 4) continue;
        const std::vector<Chosen> chosen = choose_fines(data);
        if (chosen.empty()) continue;
        Panel panel{data.name, "z [mm]", 1000, false, {}, data.name};
        for (std::size_t k = 0; k < chosen.size(); ++k)
            panel.curves.push_back({"z_" + std::to_string(k + 1), chosen[k].name, {}, {}, "x_" + std::to_string(k + 1)});
        figure.panels.push_back(panel);
        for (std::size_t t = 0; t < data.tracks.time.size(); ++t) {
            std::vector<Cell> row{data.name, data.tracks.time[t]};
            for (std::size_t k = 0; k < 6; ++k)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    row.push_back(k < chosen.size() ? number_cell(data.tracks.position[3 * (t * data.tracks.id.size() + chosen[k].column) + axis]) : Cell(std::string()));
            figure.table.add(std::move(row));
        }
    }
    return figure;
}

Figure fine_speeds(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "fine_speeds";
    figure.title = "Speed of six fines";
    figure.caption = "The fines of the paths above: clogging and unclogging show as stops and starts [Fig. 14b].";
    figure.x_column = "time";
    figure.x_label = "time [s]";
    figure.table.columns = {"case", "time"};
    for (int k = 1; k <= 6; ++k) figure.table.columns.push_back("speed_" + std::to_string(k));
    for (const CaseData& data : cases) {
        if (data.tracks.speed.empty() || figure.panels.size() == 4) continue;
        const std::vector<Chosen> chosen = choose_fines(data);
        if (chosen.empty()) continue;
        Panel panel{data.name, "speed [m/s]", 1, false, {}, data.name};
        for (std::size_t k = 0; k < chosen.size(); ++k) panel.curves.push_back({"speed_" + std::to_string(k + 1), chosen[k].name, {}, {}, {}});
        figure.panels.push_back(panel);
        for (std::size_t t = 0; t < data.tracks.time.size(); ++t) {
            std::vector<Cell> row{data.name, data.tracks.time[t]};
            for (std::size_t k = 0; k < 6; ++k)
                row.push_back(k < chosen.size() ? number_cell(data.tracks.speed[t * data.tracks.id.size() + chosen[k].column]) : Cell(std::string()));
            figure.table.add(std::move(row));
        }
    }
    return figure;
}

Figure trapped_by_grain(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "trapped_by_grain";
    figure.title = "Trapped fines by grain";
    figure.caption = "Fines in the voids of each grain at the end (outlined), and those wholly inside (filled); the others sit in the mouth of a void [Fig. 12].";
    figure.kind = FigureKind::bars;
    figure.x_column = "place";
    figure.x_label = "grain (body number)";
    figure.table.columns = {"case", "place", "grain", "count", "count_inside"};
    figure.panels = {{"", "trapped fines [count]", 1, false, {{"count", "all", {}, {}, {}}, {"count_inside", "wholly inside", {}, {}, {}}}, {}}};
    std::map<std::int64_t, std::size_t> place;
    for (const CaseData& data : cases)
        for (const std::int64_t grain : data.trapped.grain) place[grain];
    for (auto& [grain, at] : place) {
        at = figure.categories.size();
        figure.categories.push_back(std::to_string(grain));
    }
    for (const CaseData& data : cases)
        for (const auto& [grain, at] : place) {
            double all = 0, inside = 0;
            for (std::size_t k = 0; k < data.trapped.grain.size(); ++k)
                if (data.trapped.grain[k] == grain) all += 1, inside += static_cast<double>(data.trapped.enclosed[k]);
            if (all > 0) figure.table.add({data.name, static_cast<double>(at), static_cast<double>(grain), all, inside});
        }
    return figure;
}

Figure trapped_by_throat(const std::vector<CaseData>& cases)
{
    constexpr std::array ends{0.5, 0.8, 1.0, 1.2, 1.5};  // of the bins
    Figure figure;
    figure.name = "trapped_by_throat";
    figure.title = "Trapped fines by throat";
    figure.caption = "Fines in voids at the end, by the narrowest place of their widest way out over their diameter: left of 1 the void holds them, right of 1 they could leave. "
                     "Throats are read off the lattice up to one spacing too narrow.";
    figure.kind = FigureKind::bars;
    figure.x_column = "place";
    figure.x_label = "throat / diameter of the fine";
    figure.table.columns = {"case", "place", "above", "below", "count"};
    figure.panels = {{"", "trapped fines [count]", 1, false, {{"count", "trapped", {}, {}, {}}}, {}}};
    for (std::size_t k = 0; k <= ends.size(); ++k)
        figure.categories.push_back(k == 0 ? "< " + short_number(ends[0]) : k == ends.size() ? "> " + short_number(ends.back()) : short_number(ends[k - 1]) + "-" + short_number(ends[k]));
    for (const CaseData& data : cases) {
        if (data.trapped.way_out.empty()) continue;
        std::array<double, ends.size() + 1> count{};
        for (const double ratio : data.trapped.way_out) count[static_cast<std::size_t>(std::ranges::upper_bound(ends, ratio) - ends.begin())] += 1;
        for (std::size_t k = 0; k < count.size(); ++k)
            figure.table.add({data.name, static_cast<double>(k), k == 0 ? 0.0 : ends[k - 1], k == ends.size() ? Cell(std::string()) : Cell(ends[k]),
                              count[k] / static_cast<double>(data.repeats)});
    }
    return figure;
}

}  // namespace coral::report::detail
