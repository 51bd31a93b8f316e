// Which figures there are, and the tables behind those over time. Numbers in brackets are the figures of Huang et al. that they answer.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "report/detail/figures.h"
#include "report/pool.h"

namespace coral::report {
namespace {

using detail::has_fines;
using detail::number_cell;

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

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
        {"fines_per_layer", "Fines per layer", "Fines in each layer of the initial height of the sample [Figs 13, 20].", {}},
        {"hydraulic_gradient", "Hydraulic gradient", "Loss of head over the length of the sample [Fig. 15a].",
         {{"", "hydraulic gradient [-]", 1, false, {{"hydraulic_gradient", ""}}}}},
        {"hydraulic_conductivity", "Hydraulic conductivity", "Superficial velocity over hydraulic gradient [Fig. 15b].",
         {{"", "hydraulic conductivity [cm/s]", 100, false, {{"hydraulic_conductivity", ""}}}}},
        {"fine_states", "Moving and clogged fines",
         "Fines that move (from 4 diameters a second on, until they fall below 1) and fines that stopped after they had moved [Fig. 14].",
         {{"Now", "fines [count]", 1, false, {{"moving_count", "moving"}, {"clogged_count", "clogged"}}},
          {"Since the start", "events [count]", 1, false, {{"clogging_events", "clogged"}, {"unclogging_events", "went on"}}}}},
        {"trapped_fines", "Trapped fines", "Fines whose centre lies in a void inside a grain, those of them that are wholly inside (the others sit in its mouth), and those that came in during "
         "the run [Fig. 12]. With [contact] spheres = \"nearest\", throats of level sets are tighter for spheres by about half a lattice spacing, which overstates trapping.",
         {{"", "trapped fines [count]", 1, false, {{"trapped_count", "all"}, {"trapped_enclosed", "wholly inside"}, {"trapped_entered", "came in"}}}}},
        {"flow_velocity", "Flow between and inside grains",
         "Mean speed of the water between the grains, and in their voids that are linked to the outside, a cell or more below the surface [Fig. 17].",
         {{"", "mean speed [m/s]", 1, false, {{"velocity_interparticle", "between grains"}, {"velocity_intraparticle", "inside grains"}}}}},
        {"fluid_forces", "Force of the flow on the grains", "Mean magnitude for each grain of the population [Fig. 25].",
         {{"", "mean fluid force [N]", 1, true, {{"fluid_force_coarse", "coarse"}, {"fluid_force_fine", "fine"}}}}},
        {"contact_anisotropy", "Anisotropy of contact normals", "Degree of anisotropy from the deviator of the fabric tensor; band: its standard error, or the spread of repeats [Fig. 26].",
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

bool about_fines(const std::string& figure) { return figure == "eroded_mass" || figure == "fines_per_layer" || figure == "trapped_fines" || figure == "fine_states"; }

/// Series and component behind a column name, or null.
struct Source {
    const Series* series = nullptr;
    std::size_t component = 0;
    double at(std::size_t step) const { return series && step < series->steps() ? series->at(step, component) : nan_value; }
};

Source find_column(const std::map<std::string, Series>& all, const std::string& column)
{
    if (const auto direct = all.find(column); direct != all.end() && direct->second.width == 1) return {&direct->second, 0};
    for (const auto& [name, series] : all) {
        if (column.rfind(name, 0) != 0) continue;
        const auto names = column_names(name, series.width);
        const auto it = std::ranges::find(names, column);
        if (it != names.end()) return {&series, static_cast<std::size_t>(it - names.begin())};
    }
    return {};
}

bool has_finite(const Table& table, std::size_t column)
{
    return std::ranges::any_of(table.rows, [&](const std::vector<Cell>& row) { return std::holds_alternative<double>(row[column]); });
}

/// Drops curves and panels without data, and then cases without a row.
void keep_drawable(Figure& figure)
{
    const auto there = [&](const std::string& name) {
        const auto it = std::ranges::find(figure.table.columns, name);
        return it != figure.table.columns.end() && has_finite(figure.table, static_cast<std::size_t>(it - figure.table.columns.begin()));
    };
    for (Panel& panel : figure.panels) {
        std::erase_if(panel.curves, [&](const Curve& curve) { return !there(curve.column); });
        for (Curve& curve : panel.curves)
            if (!there(curve.low)) curve.low.clear(), curve.high.clear();
    }
    std::erase_if(figure.panels, [](const Panel& panel) { return panel.curves.empty(); });
    for (const auto& row : figure.table.rows) {
        const std::string& name = std::get<std::string>(row[0]);
        if (std::ranges::find(figure.cases, name) == figure.cases.end()) figure.cases.push_back(name);
    }
}

/// Panels of the figure of layers: as many as the cases have, the topmost first.
std::vector<PanelSpec> layer_panels(const std::vector<CaseData>& cases, std::vector<std::string>& names)
{
    std::size_t layers = 0;
    for (const CaseData& data : cases)
        if (data.find("fines_count")) layers = std::max(layers, data.layers);
    const std::vector<std::string> columns = column_names("fines_count", layers), titles = detail::layer_names(layers);
    names.clear();
    for (std::size_t k = layers; k-- > 0;) {
        names.push_back((layers == 3 ? std::string(1, static_cast<char>(titles[k][0] - 32)) + titles[k].substr(1) + " layer" : "Layer " + titles[k]));
        names.push_back(columns[k]);
    }
    std::vector<PanelSpec> panels;
    for (std::size_t k = 0; k < layers; ++k) panels.push_back({names[2 * k].c_str(), "fines [count]", 1, false, {{names[2 * k + 1].c_str(), ""}}});
    return panels;
}

/// The band around one value of a case: least and greatest of its repeats; of a single run, value -+ standard error where the run has one.
std::array<double, 2> band_at(const CaseData& data, const std::string& column, double value, std::size_t step)
{
    if (data.repeats > 1) return {find_column(data.low, column).at(step), find_column(data.high, column).at(step)};
    const double error = find_column(data.series, column + "_error").at(step);
    return {value - error, value + error};
}

/// A mean over no volume is written as 0 by the run; it is no speed.
bool has_meaning(const CaseData& data, const std::string& column, std::size_t step)
{
    return column != "velocity_intraparticle" || !data.find("intraparticle_volume") || find_column(data.series, "intraparticle_volume").at(step) > 0;
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
    std::vector<std::string> names;  // keeps the texts of panels made here
    const std::vector<PanelSpec> panels = spec.panels.empty() ? layer_panels(cases, names) : spec.panels;
    std::vector<std::string> columns;
    for (const PanelSpec& panel : panels) {
        Panel made{panel.title, panel.y_label, panel.factor, panel.logarithmic, {}, {}};
        for (const auto& [column, label] : panel.curves) {
            made.curves.push_back({column, label, std::string(column) + "_low", std::string(column) + "_high", {}});
            columns.emplace_back(column);
            for (const char* end : {"", "_low", "_high"}) figure.table.columns.push_back(std::string(column) + end);
        }
        figure.panels.push_back(made);
    }
    for (const CaseData& data : cases) {
        if (about_fines(figure.name) && !has_fines(data)) continue;
        std::vector<Source> sources;
        for (const std::string& column : columns) sources.push_back(find_column(data.series, column));
        if (std::ranges::none_of(sources, [](const Source& s) { return s.series != nullptr; })) continue;
        for (std::size_t i = 0; i < data.time.size(); ++i) {
            std::vector<Cell> row{data.name, data.time[i]};
            for (std::size_t c = 0; c < columns.size(); ++c) {
                const double value = has_meaning(data, columns[c], i) ? sources[c].at(i) : nan_value;
                const auto [low, high] = band_at(data, columns[c], value, i);
                for (const double v : {value, low, high}) row.push_back(number_cell(v));
            }
            figure.table.add(std::move(row));
        }
    }
    return figure;
}

}  // namespace

bool detail::has_fines(const CaseData& data)
{
    const Series* fines = data.find("fines_count");
    const Series* eroded = data.find("eroded_mass_fraction");
    const auto any = [](const Series* series) { return series && std::ranges::any_of(series->values, [](double v) { return v > 0; }); };
    return !fines || any(fines) || any(eroded);
}

std::vector<Figure> make_figures(const std::vector<CaseData>& runs)
{
    const std::vector<CaseData> cases = pool_repeats(runs);
    std::vector<Figure> figures;
    for (const TimeFigure& spec : time_figures()) figures.push_back(make_time_figure(spec, cases));
    figures.insert(figures.begin() + 2, detail::layer_bars(cases));
    for (Figure& figure : detail::migration_figures(cases)) figures.push_back(std::move(figure));
    figures.push_back(detail::fine_paths(cases));
    figures.push_back(detail::fine_speeds(cases));
    figures.push_back(detail::trapped_by_grain(cases));
    figures.push_back(detail::trapped_by_throat(cases));
    figures.push_back(detail::gradation(cases));
    figures.push_back(detail::stability_table(cases));
    for (Figure& figure : figures) keep_drawable(figure);
    std::erase_if(figures, [](const Figure& figure) { return figure.panels.empty(); });
    return figures;
}

Table erosion_table(const std::vector<CaseData>& cases)
{
    // Columns in the order of the figures first, so that the file opens on what users look for; then the rest by name.
    std::vector<std::string> columns;
    const auto offer = [&](const std::string& column) {
        const bool there = std::ranges::any_of(cases, [&](const CaseData& data) { return find_column(data.series, column).series != nullptr; });
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
        for (const std::string& column : columns) sources.push_back(find_column(data.series, column));
        for (std::size_t i = 0; i < data.time.size(); ++i) {
            std::vector<Cell> row{data.name, data.time[i]};
            for (const Source& s : sources) row.push_back(number_cell(s.at(i)));
            table.add(std::move(row));
        }
    }
    return table;
}

}  // namespace coral::report
