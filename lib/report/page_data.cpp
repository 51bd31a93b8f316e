// Curves of the page as JSON for dygraphs.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>

#include "report/detail/page_data.h"

namespace coral::report::detail {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t most_rows = 1500;  ///< of one case; more cannot be told apart on a screen

/// Seven digits are more than a screen shows and a third of the bytes.
ordered_json rounded(double value)
{
    if (!std::isfinite(value)) return nullptr;
    char text[32];
    std::snprintf(text, sizeof text, "%.7g", value);
    return std::strtod(text, nullptr);
}

ordered_json panel_json(const Figure& figure, const Panel& panel)
{
    const auto column_of = [&](const std::string& name) {
        return static_cast<std::size_t>(std::ranges::find(figure.table.columns, name) - figure.table.columns.begin());
    };
    const std::size_t width = figure.cases.size() * panel.curves.size();
    std::map<double, std::vector<ordered_json>> rows;
    const bool banded = std::ranges::any_of(panel.curves, [](const Curve& curve) { return !curve.low.empty(); });
    ordered_json out{{"title", panel.title}, {"y_label", panel.y_label}, {"logarithmic", panel.logarithmic}, {"banded", banded}};
    std::size_t place = 0;
    bool positive = false;
    for (std::size_t k = 0; k < figure.cases.size(); ++k) {
        std::vector<const std::vector<Cell>*> of_case;
        for (const auto& row : figure.table.rows)
            if (std::get<std::string>(row[0]) == figure.cases[k]) of_case.push_back(&row);
        const std::size_t stride = (of_case.size() + most_rows - 1) / most_rows;
        for (std::size_t c = 0; c < panel.curves.size(); ++c, ++place) {
            const std::size_t column = column_of(panel.curves[c].column);
            for (std::size_t i = 0; i < of_case.size(); ++i) {
                if (i % stride != 0 && i + 1 != of_case.size()) continue;
                const double* value = std::get_if<double>(&(*of_case[i])[column]);
                if (!value) continue;
                const double drawn = panel.factor * (panel.logarithmic ? std::abs(*value) : *value);
                if (panel.logarithmic && drawn == 0) continue;
                positive = positive || drawn > 0;
                auto& row = rows[std::get<double>((*of_case[i])[1])];
                row.resize(width);
                row[place] = rounded(drawn);
                if (!banded) continue;
                const Curve& curve = panel.curves[c];
                ordered_json ends = ordered_json::array();
                for (const std::string& end : {curve.low, curve.high}) {
                    const double* other = end.empty() ? nullptr : std::get_if<double>(&(*of_case[i])[column_of(end)]);
                    ends.push_back(rounded(panel.factor * (other ? (panel.logarithmic ? std::abs(*other) : *other) : *value)));
                }
                row[place] = {ends[0], rounded(drawn), ends[1]};
            }
            const std::size_t look = figure.cases.size() == 1 ? c : k;
            std::string label = panel.curves[c].label;
            if (figure.cases.size() > 1 || label.empty()) label = figure.cases[k] + (label.empty() ? "" : ", " + label);
            out["labels"].push_back(label);
            out["colors"].push_back(curve_colours[look % curve_colours.size()]);
            static const std::array<ordered_json, 3> patterns{nullptr, ordered_json{7, 4}, ordered_json{2, 3}};
            out["dashes"].push_back(figure.cases.size() == 1 ? nullptr : patterns[c % patterns.size()]);
        }
    }
    out["logarithmic"] = panel.logarithmic && positive;
    out["rows"] = ordered_json::array();
    for (auto& [time, values] : rows) {
        ordered_json row{rounded(time)};
        for (auto& value : values) row.push_back(std::move(value));
        out["rows"].push_back(std::move(row));
    }
    return out;
}

}  // namespace

std::string curves_json(const std::vector<Figure>& figures)
{
    ordered_json all = ordered_json::array();
    for (const Figure& figure : figures) {
        if (!figure.over_time) continue;
        ordered_json entry{{"name", figure.name}, {"title", figure.title}};
        for (const Panel& panel : figure.panels) entry["panels"].push_back(panel_json(figure, panel));
        all.push_back(std::move(entry));
    }
    return all.dump();
}

}  // namespace coral::report::detail
