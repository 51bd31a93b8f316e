#include "report/page.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/output_file.h"
#include "report/detail/encode.h"
#include "report/detail/page_data.h"
#include "report/detail/pictures.h"
#include "report/pool.h"
#include "report/scene.h"
#include "report/summary.h"

namespace coral::report {
namespace {

namespace fs = std::filesystem;
using detail::html;

constexpr std::size_t most_scenes = 4;  ///< cases in the 3-D view; they share one budget of bytes

std::string section(const std::string& id, const std::string& title) { return "<section id=\"" + id + "\">\n<h2>" + title + "</h2>\n"; }

std::string row_of(const std::vector<std::string>& cells, const char* element = "td", const std::string& attributes = {})
{
    std::string text = "<tr" + attributes + ">";
    for (const std::string& cell : cells) text += std::string("<") + element + ">" + html(cell) + "</" + element + ">";
    return text + "</tr>\n";
}

/// Table with one column for each case; rows in order of first appearance, those that differ between the cases marked.
std::string compare_table(const std::vector<CaseData>& cases, const std::vector<std::vector<Setting>>& columns)
{
    std::vector<std::string> names;
    std::vector<std::map<std::string, std::string>> values(cases.size());
    for (std::size_t k = 0; k < cases.size(); ++k)
        for (const Setting& setting : columns[k]) {
            if (std::ranges::find(names, setting.name) == names.end()) names.push_back(setting.name);
            values[k][setting.name] = setting.value;
        }
    std::string text = "<div class=\"scroll\"><table>\n";
    if (cases.size() > 1) {
        std::vector<std::string> header{""};
        for (const CaseData& data : cases) header.push_back(data.name);
        text += row_of(header, "th");
    }
    for (const std::string& name : names) {
        std::vector<std::string> row{name};
        bool differs = false;
        for (auto& of_case : values) {
            row.push_back(of_case.contains(name) ? of_case[name] : "-");
            differs = differs || row.back() != row[1];
        }
        text += row_of(row, "td", differs ? " class=\"differs\"" : "");
    }
    return text + "</table></div>\n" + (cases.size() > 1 ? "<p class=\"soft\">Shaded rows differ between the cases.</p>\n" : "");
}

/// Eroded mass of repeats: mean, standard deviation and range.
std::string spread_lines(const std::vector<CaseData>& cases)
{
    std::string text;
    for (const CaseData& pooled : pool_repeats(cases)) {
        if (pooled.repeats < 2) continue;
        double sum = 0, squares = 0, low = HUGE_VAL, high = -HUGE_VAL;
        for (const CaseData& data : cases) {
            if (data.label != pooled.label) continue;
            const double eroded = 100 * summarise(data).eroded_mass_fraction;
            sum += eroded;
            squares += eroded * eroded;
            low = std::min(low, eroded);
            high = std::max(high, eroded);
        }
        const double n = static_cast<double>(pooled.repeats), mean = sum / n, deviation = std::sqrt(std::max(0.0, squares - n * mean * mean) / (n - 1));
        text += "<p><strong>" + html(pooled.label) + "</strong>: " + short_number(mean, 3) + " % of the fines' mass eroded, mean of " + std::to_string(pooled.repeats) +
                " packings; standard deviation " + short_number(deviation, 2) + " %, range " + short_number(low, 3) + " to " + short_number(high, 3) + " %.</p>\n";
    }
    return text;
}

std::string pictures_section(const std::vector<detail::NamedPicture>& pictures, const fs::path& folder)
{
    if (pictures.empty()) return {};
    std::string text = section("pictures", "Samples and flow") + "<div class=\"pictures\">\n";
    for (const detail::NamedPicture& picture : pictures)
        text += "<figure><img alt=\"" + html(picture.title) + "\" src=\"data:image/png;base64," + detail::base64(read_text_file(folder / picture.file)) + "\">\n<figcaption><strong>" +
                html(picture.title) + ".</strong> " + html(picture.caption) + "</figcaption></figure>\n";
    return text + "</div>\n</section>\n";
}

std::string verdict_section(const std::vector<CaseData>& cases)
{
    std::string text = "<div class=\"verdict\">\n" + spread_lines(cases), warnings;
    for (const CaseData& data : cases) {
        const Summary summary = summarise(data);
        text += "<p><strong>" + html(data.name) + "</strong>: " + html(verdict(summary)) + "</p>\n";
        std::vector<std::string> lines = summary.warnings;
        lines.insert(lines.end(), data.notes.begin(), data.notes.end());
        for (const std::string& line : lines) warnings += "<p class=\"warning\"><strong>" + html(data.name) + "</strong>: " + html(line) + "</p>\n";
    }
    return text + "</div>\n" + warnings;
}

std::string figures_section(const std::vector<Figure>& figures, const fs::path& folder)
{
    std::string text = section("figures", "Figures") + "<div class=\"figures\">\n";
    for (const Figure& figure : figures) {
        const std::string svg = read_text_file(folder / (figure.name + ".svg"));
        const bool as_svg = svg.size() < 300000 || fs::file_size(folder / (figure.name + ".png")) > svg.size();
        const std::string picture = as_svg ? "data:image/svg+xml;base64," + detail::base64(svg)
                                           : "data:image/png;base64," + detail::base64(read_text_file(folder / (figure.name + ".png")));
        text += std::string("<figure") + (figure.panels.size() > 1 || figure.kind == FigureKind::table ? " class=\"wide\"" : "") + "><img alt=\"" + html(figure.title) + "\" src=\"" + picture +
                "\">\n<figcaption>" + html(figure.caption) + " <a class=\"soft\" href=\"figures/" + figure.name + ".csv\">figures/" + figure.name + ".csv</a></figcaption></figure>\n";
    }
    return text + "</div>\n<p class=\"soft\">Numbers in brackets are the figures of Huang et al. that these answer. Each picture lies in figures/ as SVG and PNG, "
                  "with its numbers (csv) and the gnuplot script that draws it.</p>\n</section>\n";
}

std::string key_figures(const std::vector<CaseData>& cases)
{
    std::vector<std::vector<Setting>> columns;
    for (const CaseData& data : cases) {
        const Summary s = summarise(data);
        const auto centimetres = [](double k) { return std::isfinite(k) ? short_number(100 * k) + " cm/s" : std::string("-"); };
        columns.push_back({{"Time reached", short_number(s.end_time) + " s"},
                           {"Eroded mass", std::isfinite(s.eroded_mass_fraction) ? short_number(100 * s.eroded_mass_fraction) + " %" : "-"},
                           {"Eroded fines", short_number(s.eroded_count, 9) + " of " + short_number(s.fines_at_start, 9)},
                           {"Fines trapped inside grains", short_number(s.trapped_count, 9)},
                           {"Hydraulic gradient, early", short_number(s.gradient_early)},
                           {"Hydraulic gradient, late", short_number(s.gradient_late)},
                           {"Hydraulic conductivity, early", centimetres(s.conductivity_early)},
                           {"Hydraulic conductivity, late", centimetres(s.conductivity_late)},
                           {"Hydraulic conductivity, least after 5 % of the run", centimetres(s.conductivity_least)}});
    }
    return section("numbers", "Key figures") + compare_table(cases, columns) +
           "<p class=\"soft\">Early is the median of the outputs between 5 and 15 % of the run, after the flow has started up; late that of the last 10 %.</p>\n</section>\n";
}

std::string setup_section(const std::vector<CaseData>& cases)
{
    std::vector<std::vector<Setting>> columns;
    bool any = false;
    for (const CaseData& data : cases) {
        columns.push_back(data.setup);
        any = any || !data.setup.empty();
    }
    std::string text = section("setup", "Set-up");
    text += any ? compare_table(cases, columns) : "<p>The results hold no case.toml.</p>\n";
    for (const CaseData& data : cases)
        if (!data.case_toml.empty()) text += "<details><summary>case.toml of " + html(data.name) + "</summary><pre>" + html(data.case_toml) + "</pre></details>\n";
    return text + "</section>\n";
}

std::string criteria_section(const std::vector<CaseData>& cases)
{
    std::string text = section("criteria", "Internal stability of the sample");
    if (std::ranges::all_of(cases, [](const CaseData& data) { return data.criteria.empty(); })) return text + "<p>No sample.h5 with criteria lies beside the results.</p>\n</section>\n";
    text += "<div class=\"scroll\"><table>\n" + row_of({"Case", "Criterion", "Value", "Threshold", "Verdict", "Definition"}, "th");
    for (const CaseData& data : cases)
        for (const Criterion& c : data.criteria) text += row_of({data.name, c.name, short_number(c.value), short_number(c.threshold), c.verdict, c.definition});
    return text + "</table></div>\n</section>\n";
}

std::string balance_section(const std::vector<CaseData>& cases)
{
    std::vector<std::vector<Setting>> columns;
    for (const CaseData& data : cases) {
        const Summary s = summarise(data);
        const auto with_unit = [&](double value, const char* series) {
            const Series* found = data.find(series);
            return short_number(value, 3) + (found && found->unit != "1" ? " " + found->unit : "");
        };
        std::vector<Setting> rows{{"Greatest mass balance error", with_unit(s.mass_error, "mass_balance_error")},
                                  {"Greatest momentum balance error", with_unit(s.momentum_error, "momentum_balance_error")}};
        const Series* fines = data.find("fines_count");
        const Series* eroded = data.find("eroded_count");
        if (fines && eroded) {
            const std::size_t last = fines->steps() - 1;
            double left = 0;
            for (std::size_t layer = 0; layer < fines->width; ++layer) left += fines->at(last, layer);
            rows.push_back({"Fines in the layers + eroded, start", short_number(s.fines_at_start, 9)});
            rows.push_back({"Fines in the layers + eroded, end", short_number(left, 9) + " + " + short_number(eroded->at(last), 9) + " = " +
                                                                    short_number(left + eroded->at(last), 9)});
        }
        columns.push_back(rows);
    }
    return section("balances", "Balance checks") + compare_table(cases, columns) +
           "<p class=\"soft\">Mass and momentum of fluid and grains should close to round-off; an error without a unit is relative.</p>\n</section>\n";
}

std::string performance_section(const std::vector<CaseData>& cases)
{
    std::vector<std::vector<Setting>> columns;
    bool any = false;
    for (const CaseData& data : cases) {
        columns.push_back(data.performance);
        any = any || !data.performance.empty();
    }
    return section("performance", "Performance") + (any ? compare_table(cases, columns) : "<p>The results hold no /performance.</p>\n") + "</section>\n";
}

std::string history_section(const std::vector<CaseData>& cases, const RecordEntry& record)
{
    std::string text = section("history", "How these results were made");
    for (const CaseData& data : cases) {
        if (cases.size() > 1) text += "<h3>" + html(data.name) + "</h3>\n";
        text += "<ol>\n";
        History steps = data.history;
        if (!record.tool.empty()) steps.push_back(record);
        for (const RecordEntry& step : steps) {
            text += "<li><strong>" + html(step.tool) + "</strong> " + html(step.version);
            for (std::size_t i = 0; i < step.inputs.size(); ++i) text += (i ? ", " : " on ") + html(step.inputs[i]);
            if (!step.options.empty()) {
                text += "<details><summary>options</summary><table>\n";
                for (const auto& [name, value] : step.options) text += row_of({name, value});
                text += "</table></details>";
            }
            text += "</li>\n";
        }
        text += "</ol>\n";
    }
    return text + "</section>\n";
}

/// Source of a Debian-packaged library, or empty with a note.
std::string library_source(const fs::path& file, const std::string& package, std::vector<std::string>& notes)
{
    if (fs::is_regular_file(file)) return detail::script_safe_source(read_text_file(file));
    notes.push_back(file.string() + " is missing, so the page has no part that needs it; sudo apt-get install " + package);
    return {};
}

/// Licence of both libraries; their authors ask that copies carry it.
constexpr const char* mit_licence =
    "Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated documentation files (the \"Software\"), "
    "to deal in the Software without restriction, including without limitation the rights to use, copy, modify, merge, publish, distribute, sublicense, "
    "and/or sell copies of the Software, and to permit persons to whom the Software is furnished to do so, subject to the following conditions: The above "
    "copyright notice and this permission notice shall be included in all copies or substantial portions of the Software. THE SOFTWARE IS PROVIDED \"AS "
    "IS\", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR "
    "PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN "
    "ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.";

std::string curves_section(const std::vector<Figure>& figures, const fs::path& libraries, std::vector<std::string>& notes)
{
    const std::string source = library_source(libraries / "dygraphs/dygraph.min.js", "libjs-dygraphs", notes);
    std::string text = "<section id=\"curves-section\" class=\"interactive\">\n<h2>Curves to zoom</h2>\n";
    if (source.empty()) return text + "<p class=\"soft\">Left out: libjs-dygraphs was not installed where this page was made.</p>\n</section>\n";
    const fs::path style = libraries / "dygraphs/dygraph.min.css";
    if (fs::is_regular_file(style)) text += "<style>" + read_text_file(style) + "</style>\n";
    return text + "<p class=\"soft\">Drag to zoom, shift-drag to move, double click for the whole run.</p>\n<noscript><p>Scripts are off; the figures above show the "
                  "same curves.</p></noscript>\n<div id=\"charts\"></div>\n<script type=\"application/json\" id=\"curves\">" +
           detail::script_safe_json(detail::curves_json(figures)) + "</script>\n<script>" + source + "</script>\n<script>" + detail::page_js + "</script>\n</section>\n";
}

/// Controls and canvas of the 3-D view; the legend names what the colours mean.
std::string viewer_controls(const std::vector<std::string>& names)
{
    std::string choice;
    for (std::size_t i = 0; i < names.size(); ++i) choice += "<option value=\"" + std::to_string(i) + "\">" + html(names[i]) + "</option>";
    return "<div class=\"controls\"><label" + std::string(names.size() > 1 ? "" : " hidden") + ">Case <select id=\"view-case\">" + choice +
           "</select></label><label>Time <input type=\"range\" id=\"view-frame\" min=\"0\" value=\"0\"></label><span id=\"view-time\"></span>"
           "<button id=\"view-play\" type=\"button\">Play</button><label>Cut <input type=\"range\" id=\"view-cut\" min=\"0\" max=\"100\" value=\"0\"></label>"
           "<label>Grains <input type=\"range\" id=\"view-fade\" min=\"5\" max=\"100\" value=\"100\"></label></div>\n<div id=\"viewer\"></div>\n"
           "<p class=\"soft\">Fines by the layer they started in:<span class=\"swatch\" style=\"background:#d55e00\"></span>top"
           "<span class=\"swatch\" style=\"background:#009e73\"></span>middle<span class=\"swatch\" style=\"background:#0072b2\"></span>bottom"
           "<span class=\"swatch\" style=\"background:#e3cfa4\"></span>other bodies. Drag to turn, wheel to zoom, shift-drag to move; Cut opens the sample from the front and shows surfaces only: solid looks hollow there.</p>\n"
           "<p class=\"soft\" id=\"viewer-message\"></p>\n";
}

std::string scene_section(const std::vector<CaseData>& cases, const fs::path& libraries, std::vector<std::string>& notes)
{
    std::string text = "<section id=\"view\" class=\"interactive\">\n<h2>Grains and fines in 3-D</h2>\n";
    const std::string source = library_source(libraries / "three/three.min.js", "libjs-three", notes);
    if (source.empty()) return text + "<p class=\"soft\">Left out: libjs-three was not installed where this page was made.</p>\n</section>\n";
    const std::size_t shown = std::min(cases.size(), most_scenes);
    SceneLimits limits;
    limits.position_words /= shown;
    limits.mesh_words /= shown;
    std::string scenes, remarks;
    std::vector<std::string> names;
    for (std::size_t k = 0; k < shown; ++k) {
        std::string note;
        std::string scene = scene_json(cases[k], limits, note);
        if (scene.empty()) {
            remarks += "<p class=\"soft\">" + html(cases[k].name + ": " + note) + "</p>\n";
            continue;
        }
        scene.insert(1, "\"note\":\"" + note + "\",");
        scenes += (scenes.empty() ? "" : ",") + scene;
        names.push_back(cases[k].name);
    }
    if (cases.size() > shown) remarks += "<p class=\"soft\">The view holds the first " + std::to_string(shown) + " cases.</p>\n";
    if (names.empty()) return text + remarks + "</section>\n";
    return text + "<noscript><p>Scripts are off; the figures above show the same run.</p></noscript>\n" + viewer_controls(names) + remarks +
           "<script type=\"application/json\" id=\"scenes\">" + detail::script_safe_json("[" + scenes + "]") + "</script>\n<script>" + source + "</script>\n<script>" +
           detail::viewer_js + "</script>\n</section>\n";
}

std::string data_link(const std::vector<CaseData>& cases)
{
    const std::string csv = erosion_table(cases).to_csv();
    if (csv.size() > 700000) return "<p class=\"soft\">All series of all cases lie in <a href=\"erosion.csv\">erosion.csv</a> beside this page.</p>\n";
    return "<p><a download=\"erosion.csv\" href=\"data:text/csv;base64," + detail::base64(csv) + "\">All series as CSV</a></p>\n";
}

}  // namespace

std::string report_page(const std::vector<CaseData>& cases, const std::vector<Figure>& figures, const fs::path& figures_folder, const ReportOptions& options,
                        std::vector<std::string>& notes)
{
    std::string title = "Erosion report: " + cases.front().name;
    if (cases.size() > 1) title = "Erosion report: " + std::to_string(cases.size()) + " cases";
    std::string page = "<!DOCTYPE html>\n" + std::string(page_mark) +
                       "\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                       "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n"
                       "<title>" + html(title) + "</title>\n<style>\n" + detail::page_css + "</style></head>\n<body>\n<h1>" + html(title) + "</h1>\n"
                       "<nav><a href=\"#figures\">Figures</a><a href=\"#pictures\">Pictures</a><a href=\"#numbers\">Key figures</a><a href=\"#setup\">Set-up</a><a href=\"#criteria\">Stability</a>"
                       "<a href=\"#balances\">Balances</a><a href=\"#performance\">Performance</a><a href=\"#history\">History</a>"
                       "<a href=\"#curves-section\">Curves</a><a href=\"#view\">3-D</a></nav>\n";
    const fs::path pictures_folder = figures_folder.parent_path() / "pictures";
    const std::vector<detail::NamedPicture> pictures = detail::draw_pictures(cases, pictures_folder, notes);
    page += verdict_section(cases) + data_link(cases) + figures_section(figures, figures_folder) + pictures_section(pictures, pictures_folder) + key_figures(cases) + setup_section(cases) + criteria_section(cases) +
            balance_section(cases) + performance_section(cases) + history_section(cases, options.record);
    page += curves_section(figures, options.libraries, notes);
    page += scene_section(cases, options.libraries, notes);
    page += "<details class=\"soft\"><summary>Licences of the scripts in this page</summary><p>dygraphs: Copyright (c) Dan Vanderkam and contributors. three.js: "
            "Copyright (c) three.js authors. Both under the MIT licence: " + html(mit_licence) + "</p></details>\n";
    return page + "</body></html>\n";
}

}  // namespace coral::report
