// Which figures there are, and the tables behind them. Numbers in brackets are the figures of Huang et al. that they answer.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "report/figure.h"

namespace coral::report {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

Cell number_cell(double value)
{
    if (std::isfinite(value)) return value;
    return std::string();
}

/// A panel as specified: series (with component) instead of columns.
struct PanelSpec {
    const char* title;
    const char* y_label;
    double factor;
    bool logarithmic;
    std::vector<std::array<const char*, 2>> curves;  ///< column, label
};

struct TimeFigure {
    const char* name;
    const char* title;
    const char* caption;
    std::vector<PanelSpec> panels;
};

const std::vector<TimeFigure>& time_figures()
{
    static const std::vector<TimeFigure> all{
        {"eroded_mass", "Eroded mass", "Mass of the fines below the filter plate over the mass of all fines at the start [Figs 11, 19, 23].",
         {{"", "eroded fines [% of mass]", 100, false, {{"eroded_mass_fraction", ""}}}}},
        {"fines_per_layer", "Fines per layer", "Fines in each third of the initial height of the sample [Figs 13, 20].",
         {{"Top layer", "fines [count]", 1, false, {{"fines_count_top", ""}}},
          {"Middle layer", "fines [count]", 1, false, {{"fines_count_middle", ""}}},
          {"Bottom layer", "fines [count]", 1, false, {{"fines_count_bottom", ""}}}}},
        {"hydraulic_gradient", "Hydraulic gradient", "Loss of head over the length of the sample [Fig. 15a].",
         {{"", "hydraulic gradient [-]", 1, false, {{"hydraulic_gradient", ""}}}}},
        {"hydraulic_conductivity", "Hydraulic conductivity", "Superficial velocity over hydraulic gradient [Fig. 15b].",
         {{"", "hydraulic conductivity [cm/s]", 100, false, {{"hydraulic_conductivity", ""}}}}},
        {"trapped_fines", "Trapped fines", "Fines whose centre lies in a void inside a grain [Fig. 12]. Unless [contact] spheres = \"walls\", throats of level sets are tighter for spheres by "
         "about half a lattice spacing, which overstates trapping.",
         {{"", "trapped fines [count]", 1, false, {{"trapped_count", ""}}}}},
        {"flow_velocity", "Flow between and inside grains",
         "Mean speed of the water between the grains, and inside their voids (within the filled shape of a grain) [Fig. 17].",
         {{"", "mean speed [m/s]", 1, false, {{"velocity_interparticle", "between grains"}, {"velocity_intraparticle", "inside grains"}}}}},
        {"fluid_forces", "Force of the flow on the grains", "Mean magnitude for each grain of the population [Fig. 25].",
         {{"", "mean fluid force [N]", 1, true, {{"fluid_force_coarse", "coarse"}, {"fluid_force_fine", "fine"}}}}},
        {"contact_anisotropy", "Anisotropy of contact normals", "Degree of anisotropy from the deviator of the fabric tensor [Fig. 26].",
         {{"", "anisotropy [-]", 1, false, {{"contact_anisotropy", ""}}}}},
        {"coordination", "Coordination number", "Mean number of contacts of a grain.",
         {{"", "coordination number [-]", 1, false, {{"coordination", ""}}}}},
        {"kinetic_energy", "Kinetic energy of the grains", "Sum over all grains.", {{"", "kinetic energy [J]", 1, true, {{"kinetic_energy", ""}}}}},
        {"pressure_drop", "Pressure drop", "Mean pressure on the inlet face less that on the outlet face.",
         {{"", "pressure drop [Pa]", 1, false, {{"pressure_drop", ""}}}}},
        {"balance_errors", "Balance errors", "How far mass and momentum of fluid and grains are from closing, as the solver counted them.",
         {{"", "error, magnitude", 1, true, {{"mass_balance_error", "mass"}, {"momentum_balance_error", "momentum"}}}}},
    };
    return all;
}

/// Whether a case has fines at all: without, curves of erosion are flat lines that say nothing.
bool has_fines(const CaseData& data)
{
    const Series* fines = data.find("fines_count");
    const Series* eroded = data.find("eroded_mass_fraction");
    const auto any = [](const Series* series) { return series && std::ranges::any_of(series->values, [](double v) { return v > 0; }); };
    return !fines || any(fines) || any(eroded);
}

bool about_fines(const std::string& figure) { return figure == "eroded_mass" || figure == "fines_per_layer" || figure == "trapped_fines"; }

/// Series and component behind a column name, or null.
struct Source {
    const Series* series = nullptr;
    std::size_t component = 0;
};

Source find_column(const CaseData& data, const std::string& column)
{
    if (const Series* direct = data.find(column); direct && direct->width == 1) return {direct, 0};
    for (const auto& [name, series] : data.series) {
        if (column.rfind(name, 0) != 0) continue;
        const auto names = column_names(name, series.width);
        const auto it = std::ranges::find(names, column);
        if (it != names.end()) return {&series, static_cast<std::size_t>(it - names.begin())};
    }
    return {};
}

bool has_finite(const Table& table, std::size_t column, const std::string& of_case = {})
{
    return std::ranges::any_of(table.rows, [&](const std::vector<Cell>& row) {
        return std::holds_alternative<double>(row[column]) && (of_case.empty() || std::get<std::string>(row[0]) == of_case);
    });
}

/// Drops curves and panels without data, and then cases without a row.
void keep_drawable(Figure& figure)
{
    for (Panel& panel : figure.panels)
        std::erase_if(panel.curves, [&](const Curve& curve) {
            const auto it = std::ranges::find(figure.table.columns, curve.column);
            return it == figure.table.columns.end() || !has_finite(figure.table, static_cast<std::size_t>(it - figure.table.columns.begin()));
        });
    std::erase_if(figure.panels, [](const Panel& panel) { return panel.curves.empty(); });
    for (const auto& row : figure.table.rows) {
        const std::string& name = std::get<std::string>(row[0]);
        if (std::ranges::find(figure.cases, name) == figure.cases.end()) figure.cases.push_back(name);
    }
}

Figure make_time_figure(const TimeFigure& spec, const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = spec.name;
    figure.title = spec.title;
    figure.caption = spec.caption;
    figure.x_column = "time";
    figure.x_label = "time [s]";
    figure.over_time = true;
    figure.table.columns = {"case", "time"};
    for (const PanelSpec& panel : spec.panels) {
        Panel made{panel.title, panel.y_label, panel.factor, panel.logarithmic, {}};
        for (const auto& [column, label] : panel.curves) {
            made.curves.push_back({column, label});
            figure.table.columns.emplace_back(column);
        }
        figure.panels.push_back(made);
    }
    for (const CaseData& data : cases) {
        if (about_fines(figure.name) && !has_fines(data)) continue;
        std::vector<Source> sources;
        for (std::size_t c = 2; c < figure.table.columns.size(); ++c) sources.push_back(find_column(data, figure.table.columns[c]));
        if (std::ranges::none_of(sources, [](const Source& s) { return s.series != nullptr; })) continue;
        for (std::size_t i = 0; i < data.time.size(); ++i) {
            std::vector<Cell> row{data.name, data.time[i]};
            for (const Source& s : sources) row.push_back(number_cell(s.series ? s.series->at(i, s.component) : nan_value));
            figure.table.add(std::move(row));
        }
    }
    return figure;
}

/// Fines in each layer at the first and the last output [Fig. 24].
Figure make_layer_bars(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "fines_left";
    figure.title = "Fines per layer before and after";
    figure.caption = "Fines in each third of the initial height at the start (outlined) and at the end (filled) [Fig. 24].";
    figure.kind = FigureKind::bars;
    figure.x_column = "layer";
    figure.table.columns = {"case", "layer", "count_start", "count_end"};
    figure.panels = {{"", "fines [count]", 1, false, {{"count_start", "start"}, {"count_end", "end"}}}};
    for (const CaseData& data : cases) {
        const Series* fines = data.find("fines_count");
        if (!fines || fines->width != 3 || !has_fines(data)) continue;
        for (std::size_t layer = 0; layer < 3; ++layer)
            figure.table.add({data.name, static_cast<double>(layer), number_cell(fines->at(0, layer)), number_cell(fines->at(fines->steps() - 1, layer))});
    }
    return figure;
}

/// Number of fines that came farther than d [Fig. 21].
Figure make_migration(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "migration_distance";
    figure.title = "Migration distance";
    figure.caption = "Number of fines whose path (moves summed over the outputs) is longer than d [Fig. 21].";
    figure.kind = FigureKind::steps;
    figure.x_column = "path_length";
    figure.x_label = "path length d [mm]";
    figure.x_factor = 1000;
    figure.table.columns = {"case", "path_length", "count_farther"};
    figure.panels = {{"", "fines that came farther than d [count]", 1, true, {{"count_farther", ""}}}};
    for (const CaseData& data : cases) {
        std::vector<double> path = data.migration.path_length;
        std::erase_if(path, [](double d) { return !std::isfinite(d); });
        std::ranges::sort(path);
        for (std::size_t i = 0; i + 1 < path.size(); ++i)
            figure.table.add({data.name, path[i], static_cast<double>(path.size() - 1 - i)});
    }
    return figure;
}

/// Cumulative distribution of the path of the fines that start in the top layer [Fig. 13].
Figure make_top_layer(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "migration_top_layer";
    figure.title = "Migration of the fines of the top layer";
    figure.caption = "Share of the fines that start in the top third whose path is not longer than d [Fig. 13].";
    figure.kind = FigureKind::steps;
    figure.x_column = "path_length";
    figure.x_label = "path length d [mm]";
    figure.x_factor = 1000;
    figure.table.columns = {"case", "path_length", "fraction_not_farther"};
    figure.panels = {{"", "share of the fines [%]", 100, false, {{"fraction_not_farther", ""}}}};
    for (const CaseData& data : cases) {
        std::vector<double> path;
        for (std::size_t i = 0; i < data.migration.layer.size() && i < data.migration.path_length.size(); ++i)
            if (data.migration.layer[i] == 2 && std::isfinite(data.migration.path_length[i])) path.push_back(data.migration.path_length[i]);
        std::ranges::sort(path);
        for (std::size_t i = 0; i < path.size(); ++i)
            figure.table.add({data.name, path[i], static_cast<double>(i + 1) / static_cast<double>(path.size())});
    }
    return figure;
}

/// Tracked fines with the two longest paths and the two shortest of the top layer: columns of the speeds [Fig. 14].
std::vector<std::size_t> telling_fines(const CaseData& data)
{
    const Migration& m = data.migration;
    if (data.tracks.speed.empty() || m.path_length.size() != m.id.size() || m.id.size() < 4) return {};
    std::vector<std::size_t> order(m.id.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::erase_if(order, [&](std::size_t i) {
        return !std::isfinite(m.path_length[i]) || std::ranges::find(data.tracks.id, m.id[i]) == data.tracks.id.end();
    });
    std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return m.path_length[a] > m.path_length[b]; });
    if (order.size() < 4) return {};
    std::vector<std::size_t> columns;
    for (std::size_t pick : {order[0], order[1], order[order.size() - 2], order[order.size() - 1]})
        columns.push_back(static_cast<std::size_t>(std::ranges::find(data.tracks.id, m.id[pick]) - data.tracks.id.begin()));
    return columns;
}

Figure make_speeds(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "fine_speeds";
    figure.title = "Speed of four fines";
    figure.caption = "The two tracked fines with the longest path and the two with the shortest [Fig. 14b].";
    figure.x_column = "time";
    figure.x_label = "time [s]";
    figure.table.columns = {"case", "time", "speed_longest_1", "speed_longest_2", "speed_shortest_1", "speed_shortest_2"};
    figure.panels = {{"Longest paths", "speed [m/s]", 1, false, {{"speed_longest_1", "first"}, {"speed_longest_2", "second"}}},
                     {"Shortest paths", "speed [m/s]", 1, false, {{"speed_shortest_1", "second"}, {"speed_shortest_2", "first"}}}};
    for (const CaseData& data : cases) {
        const auto columns = telling_fines(data);
        if (columns.empty()) continue;
        const std::size_t count = data.tracks.id.size();
        for (std::size_t i = 0; i < data.tracks.time.size(); ++i) {
            std::vector<Cell> row{data.name, data.tracks.time[i]};
            for (std::size_t c : columns) row.push_back(number_cell(data.tracks.speed[i * count + c]));
            figure.table.add(std::move(row));
        }
    }
    return figure;
}

Figure make_gradation(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "particle_size_distribution";
    figure.title = "Particle size distribution";
    figure.caption = "Mass passing over equivalent diameter (of the filled shape), from the grains of the sample [Fig. 8].";
    figure.kind = FigureKind::steps;
    figure.x_column = "diameter";
    figure.x_label = "equivalent diameter [mm]";
    figure.x_factor = 1000;
    figure.x_logarithmic = true;
    figure.table.columns = {"case", "diameter", "passing"};
    figure.panels = {{"", "mass passing [%]", 100, false, {{"passing", ""}}}};
    for (const CaseData& data : cases)
        for (std::size_t i = 0; i < data.psd_diameter.size(); ++i)
            if (data.psd_diameter[i] > 0) figure.table.add({data.name, data.psd_diameter[i], number_cell(data.psd_passing[i])});
    return figure;
}

}  // namespace

std::vector<Figure> make_figures(const std::vector<CaseData>& cases)
{
    std::vector<Figure> figures;
    for (const TimeFigure& spec : time_figures()) figures.push_back(make_time_figure(spec, cases));
    figures.insert(figures.begin() + 1, make_layer_bars(cases));
    figures.push_back(make_migration(cases));
    figures.push_back(make_top_layer(cases));
    figures.push_back(make_speeds(cases));
    figures.push_back(make_gradation(cases));
    for (Figure& figure : figures) keep_drawable(figure);
    std::erase_if(figures, [](const Figure& figure) { return figure.panels.empty(); });
    return figures;
}

Table erosion_table(const std::vector<CaseData>& cases)
{
    // Columns in the order of the figures first, so that the file opens on what users look for; then the rest by name.
    std::vector<std::string> columns;
    const auto offer = [&](const std::string& column) {
        const bool there = std::ranges::any_of(cases, [&](const CaseData& data) { return find_column(data, column).series != nullptr; });
        if (there && std::ranges::find(columns, column) == columns.end()) columns.push_back(column);
    };
    offer("eroded_mass_fraction");
    offer("eroded_count");
    for (const TimeFigure& spec : time_figures())
        for (const PanelSpec& panel : spec.panels)
            for (const auto& curve : panel.curves) offer(curve[0]);
    for (const CaseData& data : cases)
        for (const auto& [name, series] : data.series)
            for (const std::string& column : column_names(name, series.width)) offer(column);

    Table table;
    table.columns = {"case", "time"};
    table.columns.insert(table.columns.end(), columns.begin(), columns.end());
    for (const CaseData& data : cases) {
        std::vector<Source> sources;
        for (const std::string& column : columns) sources.push_back(find_column(data, column));
        for (std::size_t i = 0; i < data.time.size(); ++i) {
            std::vector<Cell> row{data.name, data.time[i]};
            for (const Source& s : sources) row.push_back(number_cell(s.series ? s.series->at(i, s.component) : nan_value));
            table.add(std::move(row));
        }
    }
    return table;
}

}  // namespace coral::report
