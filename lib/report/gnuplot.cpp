// Scripts for gnuplot, and running them.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/output_file.h"
#include "core/parallel.h"
#include "core/text.h"
#include "report/detail/page_data.h"
#include "report/figure.h"
#include "report/summary.h"

extern char** environ;

namespace coral::report {
namespace {

namespace fs = std::filesystem;

constexpr auto& palette = detail::curve_colours;
constexpr std::array<int, 7> markers{7, 5, 9, 13, 11, 4, 6};
constexpr std::array<const char*, 4> dashes{"1", "(5,2)", "(1.5,1.5)", "(6,2,1.5,2)"};  // gnuplot's own leave holes wider than dashes in thick lines

/// Text in single quotes, where gnuplot reads nothing but a doubled quote.
std::string quoted(const std::string& text)
{
    std::string out = "'";
    for (char c : text) {
        if (c == '\n' || c == '\r') c = ' ';
        out += c;
        if (c == '\'') out += c;
    }
    return out + "'";
}

std::size_t column_of(const Figure& figure, const std::string& name)
{
    return static_cast<std::size_t>(std::ranges::find(figure.table.columns, name) - figure.table.columns.begin());
}

/// Drawn values of one curve of one case.
std::vector<double> values_of(const Figure& figure, std::size_t column, const std::string& of_case)
{
    std::vector<double> values;
    for (const auto& row : figure.table.rows)
        if (std::get<std::string>(row[0]) == of_case)
            if (const double* value = std::get_if<double>(&row[column])) values.push_back(*value);
    return values;
}

/// Cases that a panel draws.
std::vector<std::string> shown_cases(const Figure& figure, const Panel& panel)
{
    return panel.only_case.empty() ? figure.cases : std::vector<std::string>{panel.only_case};
}

struct Range {
    double low = HUGE_VAL, high = -HUGE_VAL, smallest_positive = HUGE_VAL;
};

Range range_of(const Figure& figure, const Panel& panel)
{
    Range range;
    for (const Curve& curve : panel.curves)
        for (const std::string& name : shown_cases(figure, panel))
            for (double v : values_of(figure, column_of(figure, curve.column), name)) {
                range.low = std::min(range.low, v);
                range.high = std::max(range.high, v);
                if (v != 0) range.smallest_positive = std::min(range.smallest_positive, std::abs(v));
            }
    return range;
}

/// Distance of ticks that leaves four to eight of them: 1, 2 or 5 times a power of ten. gnuplot's own choice crowds small panels.
double tick_step(double extent)
{
    const double rough = extent / 4, power = std::pow(10, std::floor(std::log10(rough)));
    return rough / power >= 5 ? 5 * power : rough / power >= 2 ? 2 * power : power;
}

/// Ticks along x for the data drawn; nothing when the axis has no extent or is logarithmic.
std::string x_ticks(const Figure& figure)
{
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const auto& row : figure.table.rows)
        if (const double* x = std::get_if<double>(&row[1])) {
            low = std::min(low, *x * figure.x_factor);
            high = std::max(high, *x * figure.x_factor);
        }
    if (figure.kind == FigureKind::bars || figure.kind == FigureKind::paths || figure.x_logarithmic || !(high > low)) return {};
    return "  set xtics " + to_text(tick_step(high - low)) + "\n";
}

/// Axis commands; a logarithmic axis only where there is something to show on it, else zero is in sight.
std::string y_axis(const Figure& figure, const Panel& panel, bool& logarithmic)
{
    const Range range = range_of(figure, panel);
    logarithmic = panel.logarithmic && std::isfinite(range.smallest_positive);
    if (logarithmic) return "  set logscale y; set format y '10^{%L}'; set yrange [*:*]\n";
    std::string text = "  unset logscale y; set format y '%g'; ";
    if (range.low < 0) return text + "set yrange [*:*]\n";
    return text + (range.high > 0 ? "set yrange [0:*]\n" : "set yrange [0:1]\n");
}

std::string scaled(std::size_t column, double factor, bool absolute)
{
    std::string text = "$" + std::to_string(column + 1);
    if (absolute) text = "abs(" + text + ")";
    return factor == 1 ? text : text + "*" + to_text(factor);
}

std::string title_of(const Figure& figure, const std::string& name, const Curve& curve)
{
    if (figure.cases.size() == 1 || name.empty()) return curve.label;
    return curve.label.empty() ? name : name + ", " + curve.label;
}

/// `data ... using` for the rows of one case, with the abscissa in place.
std::string rows_of(const Figure& figure, const std::string& name, std::size_t x_column)
{
    return "data skip 1 using (strcol(1) eq " + quoted(name) + " ? " + scaled(x_column, figure.x_factor, false) + " : NaN)";
}

/// Bands first, so that no curve is hidden; they have no place in the legend.
std::string plot_bands(const Figure& figure, const Panel& panel, bool logarithmic, bool& first)
{
    std::string text;
    const std::vector<std::string> cases = shown_cases(figure, panel);
    for (std::size_t k = 0; k < cases.size(); ++k)
        for (std::size_t c = 0; c < panel.curves.size(); ++c) {
            const Curve& curve = panel.curves[c];
            if (curve.low.empty() || values_of(figure, column_of(figure, curve.low), cases[k]).empty()) continue;
            const std::size_t look = cases.size() == 1 ? c : k;
            text += std::string(first ? " " : ", \\\n       ") + rows_of(figure, cases[k], 1) + ":(" + scaled(column_of(figure, curve.low), panel.factor, logarithmic) + "):(" +
                    scaled(column_of(figure, curve.high), panel.factor, logarithmic) + ") with filledcurves fs transparent solid 0.2 noborder lc rgb '" +
                    palette[look % palette.size()] + "' notitle";
            first = false;
        }
    return text;
}

std::string plot_curves(const Figure& figure, const Panel& panel, bool logarithmic)
{
    bool first = true;
    std::string text = "  plot" + plot_bands(figure, panel, logarithmic, first);
    const std::vector<std::string> cases = shown_cases(figure, panel);
    for (std::size_t k = 0; k < cases.size(); ++k)
        for (std::size_t c = 0; c < panel.curves.size(); ++c) {
            const Curve& curve = panel.curves[c];
            const std::size_t column = column_of(figure, curve.column);
            const auto values = values_of(figure, column, cases[k]);
            if (std::ranges::none_of(values, [&](double v) { return !logarithmic || v != 0; })) continue;
            const std::size_t look = cases.size() == 1 ? c : k;
            const std::string title = title_of(figure, panel.only_case.empty() ? cases[k] : std::string(), curve);
            const bool lines = figure.kind == FigureKind::lines || figure.kind == FigureKind::paths;
            text += std::string(first ? " " : ", \\\n       ") + rows_of(figure, cases[k], curve.x_column.empty() ? 1 : column_of(figure, curve.x_column)) + ":(" +
                    scaled(column, panel.factor, logarithmic) + ")" + (lines ? " with linespoints" : " with steps") + " lw 2 lc rgb '" + palette[look % palette.size()] +
                    "' dt " + dashes[(cases.size() == 1 ? 0 : c) % dashes.size()];
            if (lines) text += " pt " + std::to_string(markers[look % markers.size()]) + " ps 0.7 pi " + std::to_string(std::max<std::size_t>(1, values.size() / 10));
            text += title.empty() ? " notitle" : " title " + quoted(title);
            first = false;
        }
    return text + "\n";
}

/// Clustered bars: for each category one place per case, the first curve outlined and the second filled, with its band as a line.
std::string plot_bars(const Figure& figure, const Panel& panel)
{
    std::string text = "  set xtics (";
    for (std::size_t i = 0; i < figure.categories.size(); ++i) text += (i ? ", " : "") + quoted(figure.categories[i]) + " " + std::to_string(i);
    text += ")\n  set xrange [-0.6:" + to_text(static_cast<double>(figure.categories.size()) - 0.4) + "]\n  plot";
    const double width = 0.8 / static_cast<double>(figure.cases.size());
    for (std::size_t k = 0; k < figure.cases.size(); ++k) {
        const double shift = (static_cast<double>(k) - 0.5 * static_cast<double>(figure.cases.size() - 1)) * width;
        const std::string where = "data skip 1 using (strcol(1) eq " + quoted(figure.cases[k]) + " ? $2+(" + to_text(shift) + ") : NaN)";
        const std::string colour = std::string(" lc rgb '") + palette[k % palette.size()] + "'";
        const std::string name = figure.cases.size() == 1 ? std::string() : figure.cases[k] + ", ";
        for (std::size_t c = 0; c < panel.curves.size(); ++c) {
            const Curve& curve = panel.curves[c];
            const std::string column = std::to_string(column_of(figure, curve.column) + 1);
            text += std::string(k + c == 0 ? " " : ", \\\n       ") + where + ":" + column + ":(" + to_text(0.92 * width) + ") with boxes fs " +
                    (c == 0 ? "empty lw 1.5" : "solid 0.7 noborder") + colour + " title " + quoted(name + curve.label);
            if (curve.low.empty()) continue;
            text += ", \\\n       " + where + ":" + column + ":" + std::to_string(column_of(figure, curve.low) + 1) + ":" + std::to_string(column_of(figure, curve.high) + 1) +
                    " with yerrorbars pt 0 lw 1.5 lc rgb '#222222' notitle";
        }
    }
    return text + "\n";
}

/// The table as text in columns.
std::string plot_table(const Figure& figure)
{
    const std::size_t rows = figure.table.rows.size(), columns = figure.table.columns.size();
    std::string text = "  unset border; unset tics; unset xlabel; unset ylabel; unset grid\n  set xrange [0:1]; set yrange [" + to_text(static_cast<double>(rows) + 0.7) + ":-0.7]\n";
    const auto place = [&](const std::string& what, std::size_t row, std::size_t column, const char* font) {
        return "  set label " + quoted(what) + " at " + to_text((static_cast<double>(column) + 0.1) / static_cast<double>(columns)) + "," + to_text(static_cast<double>(row)) + " noenhanced" + font + "\n";
    };
    for (std::size_t c = 0; c < columns; ++c) text += place(figure.table.columns[c], 0, c, " font ',14'");
    for (std::size_t r = 0; r < rows; ++r)
        for (std::size_t c = 0; c < columns; ++c) {
            const Cell& cell = figure.table.rows[r][c];
            text += place(std::holds_alternative<double>(cell) ? short_number(std::get<double>(cell)) : std::get<std::string>(cell), r + 1, c, "");
        }
    return text + "  set arrow from 0,0.5 to 1,0.5 nohead lc rgb '#888888'\n  plot NaN notitle\n  unset label; unset arrow\n";
}

/// Runs gnuplot in `folder`; its messages end up in the error.
void run_gnuplot(const fs::path& folder, const std::string& script)
{
    const fs::path messages = folder / (script + ".messages");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 2, (script + ".messages").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    // -d: without the user's own start-up file, so that a figure looks the same everywhere.
    std::array<std::string, 3> words{"gnuplot", "-d", script};
    std::array<char*, 4> arguments{words[0].data(), words[1].data(), words[2].data(), nullptr};
    pid_t child = 0;
    const int failure = posix_spawnp(&child, "gnuplot", &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failure == ENOENT) throw Error("gnuplot", "is not installed, and it draws the figures", "sudo apt-get install gnuplot-nox");
    if (failure != 0) throw Error("gnuplot", std::string("could not be started: ") + std::strerror(failure), "sudo apt-get install gnuplot-nox");
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {}
    std::string said;
    if (fs::exists(messages)) said = read_text_file(messages);
    fs::remove(messages);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 127) throw Error("gnuplot", "is not installed, and it draws the figures", "sudo apt-get install gnuplot-nox");
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        std::ranges::replace(said, '\n', ' ');
        throw Error("gnuplot " + script, "failed: " + said, "run it by hand in the figures folder");
    }
}

}  // namespace

std::string gnuplot_script(const Figure& figure)
{
    const std::size_t panels = figure.panels.size();
    const bool wide = panels > 1;
    const bool table = figure.kind == FigureKind::table;
    const std::size_t width = wide ? 400 * panels : table ? 800 : 600, height = wide ? 420 : table ? 110 + 24 * figure.table.rows.size() : 410;
    std::string text = "# " + figure.title + ". Redraw with: gnuplot " + figure.name + ".gp\n" +
                       "# erosion-report writes this file anew each time; copy the folder to restyle figures for a journal.\n"
                       "data = " + quoted(figure.name + ".csv") + "  # ";
    for (std::size_t c = 0; c < figure.table.columns.size(); ++c) text += (c ? ", " : "") + std::to_string(c + 1) + " " + figure.table.columns[c];
    text += "\nset datafile separator comma\nset encoding utf8\nset key noenhanced\n"
            "set border 3 lc rgb '#444444'; set tics nomirror tc rgb '#222222'; set grid lc rgb '#DDDDDD' lt 1\n"
            "set key below center horizontal Left reverse spacing 1.3 samplen 2.5\n"
            "png = strstrt(GPVAL_TERMINALS, 'pngcairo') ? 'pngcairo' : 'png'\n"
            "do for [kind in 'svg png'] {\n";
    const std::string size = std::to_string(width) + "," + std::to_string(height);
    const std::string large = std::to_string(5 * width / 2) + "," + std::to_string(5 * height / 2);
    text += "  if (kind eq 'svg') { set terminal svg size " + size + " dynamic font 'sans-serif,13' background '#FFFFFF' }\n"
            "  if (kind eq 'png' && png eq 'pngcairo') { set terminal pngcairo size " + large + " font 'sans-serif,10' fontscale 2.5 linewidth 2.5 pointscale 2.5 background '#FFFFFF' }\n"
            "  if (kind eq 'png' && png eq 'png') { set terminal png size " + large + " large linewidth 2 }\n"
            "  set output " + quoted(figure.name + ".") + ".kind\n";
    if (wide) text += "  set multiplot layout 1," + std::to_string(panels) + " title " + quoted(figure.title) + " noenhanced font ',15'\n";
    if (figure.x_logarithmic) text += "  set logscale x\n";
    text += "  set xlabel " + quoted(figure.x_label) + " noenhanced offset 0,0.4\n" + x_ticks(figure);
    for (const Panel& panel : figure.panels) {
        bool logarithmic = false;
        const std::string& title = wide ? panel.title : figure.title;  // of one panel, the case is clear
        text += "  set title " + quoted(title) + " noenhanced" + (wide ? "" : " font ',15'") + "\n  set ylabel " + quoted(panel.y_label) + " noenhanced\n" +
                y_axis(figure, panel, logarithmic);
        if (figure.kind == FigureKind::paths) text += "  set size ratio -1\n";
        text += figure.kind == FigureKind::bars ? plot_bars(figure, panel) : table ? plot_table(figure) : plot_curves(figure, panel, logarithmic);
    }
    if (wide) text += "  unset multiplot\n";
    return text + "}\nunset output\n";
}

void draw_figures(const std::vector<Figure>& figures, const fs::path& folder)
{
    for (const Figure& figure : figures) {
        figure.table.write(folder / (figure.name + ".csv"));
        write_text_file(folder / (figure.name + ".gp"), gnuplot_script(figure));
    }
    parallel_blocks(figures.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) run_gnuplot(folder, figures[i].name + ".gp");
    });
    for (const Figure& figure : figures)
        for (const char* kind : {".svg", ".png"}) {
            const fs::path picture = folder / (figure.name + kind);
            if (!fs::exists(picture) || fs::file_size(picture) == 0)
                throw Error("gnuplot " + figure.name + ".gp", "wrote no " + picture.filename().string(), "is gnuplot-nox whole? sudo apt-get install --reinstall gnuplot-nox");
        }
}

}  // namespace coral::report
