#include "sh/import.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "core/output_file.h"
#include "core/table.h"
#include "core/text.h"
#include "core/units.h"
#include "sh/quadrature.h"

namespace coral::sh {
namespace {

namespace fs = std::filesystem;

constexpr int highest_degree = 200;  // of Basis
constexpr std::string_view table_head = "Name xlow xhi";

std::string at_line(const fs::path& file, std::size_t line) { return file.string() + ":" + std::to_string(line); }

std::vector<std::string_view> words_of(std::string_view line)
{
    constexpr std::string_view blanks = " \t\r";
    std::vector<std::string_view> words;
    for (std::size_t begin = line.find_first_not_of(blanks); begin != std::string_view::npos;) {
        const std::size_t end = std::min(line.find_first_of(blanks, begin), line.size());
        words.push_back(line.substr(begin, end - begin));
        begin = line.find_first_not_of(blanks, end);
    }
    return words;
}

/// Calls take(number, words) for every line that is not blank.
template <class Take>
void each_line(const std::string& text, const Take& take)
{
    std::size_t number = 0;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        const auto words = words_of(std::string_view(text).substr(begin, end - begin));
        ++number;
        if (!words.empty()) take(number, words);
        begin = end + 1;
    }
}

template <class Number>
std::optional<Number> number_of(std::string_view word)
{
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value{};
    const auto [rest, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (problem != std::errc{} || rest != word.data() + word.size()) return {};
    if constexpr (std::is_floating_point_v<Number>)
        if (!std::isfinite(value)) return {};
    return value;
}

/// What a message shows of a bad line: its beginning, without bytes that a terminal would take amiss.
std::string quoted(const std::vector<std::string_view>& words)
{
    std::string text;
    for (const std::string_view word : words) text.append(text.empty() ? "" : " ").append(word.substr(0, 40));
    if (text.size() > 40) text = text.substr(0, 40) + "...";
    std::ranges::replace_if(text, [](unsigned char c) { return c < 32 || c > 126; }, '?');
    return "'" + text + "'";
}

struct Coefficient {
    double re = 0, im = 0;
    bool given = false;
};

/// The a_nm of a file at index n(n+1)+m, complete up to the highest degree.
std::vector<Coefficient> read_coefficients(const fs::path& file)
{
    std::vector<Coefficient> a;
    each_line(read_text_file(file), [&](std::size_t line, const std::vector<std::string_view>& words) {
        const auto fail = [&](const std::string& what) { throw Error(at_line(file, line), what + ", found " + quoted(words)); };
        std::optional<int> n, m;
        std::optional<double> re, im;
        if (words.size() == 4) n = number_of<int>(words[0]), m = number_of<int>(words[1]), re = number_of<double>(words[2]), im = number_of<double>(words[3]);
        if (!n || !m || !re || !im) fail("expected four numbers 'n m Re(a_nm) Im(a_nm)'");
        if (*n < 0 || *n > highest_degree) fail("expected a degree n of 0 to " + std::to_string(highest_degree));
        if (std::abs(*m) > *n) fail("expected an order m of -n to n");
        a.resize(std::max(a.size(), std::size_t(coefficient_count(*n))));
        Coefficient& c = a[std::size_t(coefficient_index(*n, *m))];
        if (c.given) fail("this harmonic was given before");
        c = {*re, *im, true};
    });
    if (a.empty()) throw Error(file.string(), "is empty", "expected lines 'n m Re(a_nm) Im(a_nm)'");
    for (std::size_t k = 0; k < a.size(); ++k)
        if (!a[k].given) {
            const int n = int(std::sqrt(double(k)));
            throw Error(file.string(), "the harmonic n = " + std::to_string(n) + ", m = " + std::to_string(int(k) - n * (n + 1)) + " is missing", "is the file complete?");
        }
    return a;
}

/// Column by the beginning of its name. \throws Error when absent
std::size_t column_of(const Table& table, const std::string& beginning, const fs::path& file)
{
    for (std::size_t c = 0; c < table.columns.size(); ++c)
        if (table.columns[c].starts_with(beginning)) return c;
    throw Error(at_line(file, 1), "has no column '" + beginning + "...'", "expected the header of a Sand Atlas table");
}

/// Factor of a unit in brackets, such as "Volume (µm³)" or "length(mm)" [m]; 0 when there is none.
double unit_in(std::string name)
{
    const std::size_t open = name.rfind('('), close = name.rfind(')');
    if (open == std::string::npos || close == std::string::npos || close < open) return 0;
    std::string unit = name.substr(open + 1, close - open - 1);
    const auto replace = [&unit](std::string_view from, std::string_view to) {
        if (const std::size_t at = unit.find(from); at != std::string::npos) unit.replace(at, from.size(), to);
    };
    replace("³", "");
    replace("\u03bc", "u");  // the Greek letter
    replace("\u00b5", "u");  // the micro sign
    try {
        return parse_quantity("1" + unit, Dimension::length, "");
    } catch (const UsageError&) {
        return 0;
    }
}

bool usable(double value) { return std::isfinite(value) && value > 0; }

}  // namespace

PublishedFormat published_format(const fs::path& file)
{
    const std::string text = read_text_file(file);
    const std::string_view head = std::string_view(text).substr(0, text.find('\n'));
    if (text.starts_with("\x1f\x8b")) throw Error(file.string(), "is compressed", "unpack it with gunzip");
    if (head.starts_with("Xsize")) throw Error(file.string(), "holds voxels, not coefficients", "csct2ls makes level sets of voxels");
    if (head.starts_with("Particle ID")) return PublishedFormat::sand_atlas_table;
    if (head.starts_with(table_head)) return PublishedFormat::tsquare_table;
    const auto words = words_of(head);
    if (words.size() == 4 && number_of<int>(words[0]) && number_of<int>(words[1])) return PublishedFormat::tsquare_coefficients;
    throw Error(at_line(file, 1), "expected coefficients 'n m Re(a_nm) Im(a_nm)', a table '" + std::string(table_head) + " ...' or a table 'Particle ID,...', found " + quoted(words));
}

Surface read_tsquare(const fs::path& file, double unit)
{
    const std::vector<Coefficient> a = read_coefficients(file);
    Surface surface;
    surface.degree = int(std::lround(std::sqrt(double(a.size())))) - 1;
    surface.method = "tsquare";
    surface.coefficients.resize(a.size());
    const double size = a[0].re;
    if (!(size > 0)) throw Error(file.string(), "expected a_00 greater than zero, found " + to_text(size));
    for (int n = 0; n <= surface.degree; ++n)
        for (int m = 0; m <= n; ++m) {
            const Coefficient plus = a[std::size_t(coefficient_index(n, m))], minus = a[std::size_t(coefficient_index(n, -m))];
            const double sign = m % 2 ? -1 : 1, root = m ? std::numbers::sqrt2 : 1;
            if (std::hypot(minus.re - sign * plus.re, minus.im + sign * plus.im) > 1e-6 * size)
                throw Error(file.string(), "a_nm and a_n,-m of n = " + std::to_string(n) + ", m = " + std::to_string(m) + " are not conjugate up to (-1)^m: the radius would not be real");
            surface.coefficients[std::size_t(coefficient_index(n, m))] = unit * sign * root * plus.re;
            if (m) surface.coefficients[std::size_t(coefficient_index(n, -m))] = -unit * sign * root * plus.im;
        }
    return surface;
}

double tsquare_table_unit(const fs::path& file)
{
    const std::string text = read_text_file(file);
    double unit = 0;
    for (const std::string_view word : words_of(std::string_view(text).substr(0, text.find('\n'))))
        if (unit == 0) unit = unit_in(std::string(word));
    return unit;
}

std::map<std::string, PublishedFigures> read_tsquare_table(const fs::path& file, double unit)
{
    std::map<std::string, PublishedFigures> table;
    std::size_t columns = 0;
    each_line(read_text_file(file), [&](std::size_t line, const std::vector<std::string_view>& words) {
        if (columns == 0) {
            columns = words.size();
            if (columns < 13) throw Error(at_line(file, line), "expected the header '" + std::string(table_head) + " ...' of at least 13 columns, found " + quoted(words));
            return;
        }
        if (words.size() != columns)
            throw Error(at_line(file, line), "expected " + std::to_string(columns) + " columns, found " + std::to_string(words.size()));
        double value[12];
        for (std::size_t c = 1; c <= 12; ++c) {
            const auto number = number_of<double>(words[c]);
            if (!number) throw Error(at_line(file, line), "expected a number in column " + std::to_string(c + 1) + ", found " + quoted({words[c]}));
            value[c - 1] = *number;
        }
        PublishedFigures figures;
        figures.lower = unit * Eigen::Vector3d(value[0], value[2], value[4]);
        figures.upper = unit * Eigen::Vector3d(value[1], value[3], value[5]);
        figures.volume = unit * unit * unit * value[6];
        figures.area = unit * unit * value[7];
        figures.degree = figures.named_degree = int(value[11]);
        table[std::string(words[0])] = figures;
    });
    return table;
}

Surface ellipsoid_surface(const Eigen::Vector3d& semi_axes, int degree)
{
    // Radii are not band-limited: enough directions keep what is cut off from folding back.
    const SphereQuadrature quadrature = oversampled_quadrature(std::max(degree, 10));
    std::vector<double> radii;
    for (const Eigen::Vector3d& u : quadrature.directions) radii.push_back(1.0 / u.cwiseQuotient(semi_axes).norm());
    Surface surface;
    surface.degree = degree;
    surface.method = "ellipsoid";
    surface.coefficients = analyse(quadrature, radii, degree);
    return scaled_to_volume(surface, 4.0 / 3.0 * std::numbers::pi * semi_axes.prod());
}

AxesTable read_sand_atlas(const fs::path& file, int degree)
{
    const Table table = read_table(file);
    const std::size_t id = column_of(table, "Particle ID", file), volume = column_of(table, "Volume", file);
    const std::size_t axes[3] = {column_of(table, "Major Axis Length", file), column_of(table, "Middle Axis Length", file), column_of(table, "Minor Axis Length", file)};
    const double unit = unit_in(table.columns[axes[0]]);
    if (!(unit > 0) || unit_in(table.columns[volume]) != unit)
        throw Error(at_line(file, 1), "expected one unit for axes and volume, as in 'Volume (um³)', found '" + table.columns[axes[0]] + "', '" + table.columns[volume] + "'");
    AxesTable result;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
        const auto number = [&](std::size_t column) {
            const Cell& cell = table.rows[row][column];
            if (const double* value = std::get_if<double>(&cell)) return *value;
            const std::string* text = std::get_if<std::string>(&cell);
            if (!text || !text->empty()) throw Error(at_line(file, row + 2), "expected a number in column '" + table.columns[column] + "', found '" + (text ? *text : "") + "'");
            return std::numeric_limits<double>::quiet_NaN();
        };
        const Eigen::Vector3d lengths = unit * Eigen::Vector3d(number(axes[0]), number(axes[1]), number(axes[2]));
        PublishedShape shape;
        shape.figures.volume = unit * unit * unit * number(volume);
        if (!usable(shape.figures.volume) || !usable(lengths.minCoeff()) || !usable(lengths.sum())) {
            ++result.left_out;
            continue;
        }
        // True sphericity is that of the voxel surface, not of the ellipsoid: the area is shown, not reached.
        const auto sphericity = std::ranges::find_if(table.columns, [](const std::string& c) { return c.starts_with("True Sphericity"); });
        if (sphericity != table.columns.end())
            shape.figures.area = std::cbrt(36 * std::numbers::pi * shape.figures.volume * shape.figures.volume) / number(std::size_t(sphericity - table.columns.begin()));
        shape.name = file.filename().string() + " " + std::to_string(static_cast<long long>(number(id)));
        shape.surface = ellipsoid_surface(0.5 * lengths, degree);
        if (!(body_properties(shape.surface).smallest_radius > 0)) {
            ++result.too_slender;
            continue;
        }
        result.shapes.push_back(std::move(shape));
    }
    if (result.shapes.empty()) throw Error(file.string(), "has no row whose volume and three axes make a shape of degree " + std::to_string(degree));
    return result;
}

}  // namespace coral::sh
