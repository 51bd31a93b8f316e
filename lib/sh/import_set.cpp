#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/units.h"
#include "sh/import.h"

namespace coral::sh {
namespace {

namespace fs = std::filesystem;

constexpr int ellipsoid_degree = 10;

/// A coefficient set or an axes table.
struct ShapeSource {
    fs::path file;
    PublishedFormat format;
    bool from_folder;  ///< not named by the user
};

/// Files of each format, folders opened.
struct Sorted {
    std::vector<ShapeSource> shapes;  ///< as given
    std::vector<fs::path> tables;
};

Sorted sort_files(const std::vector<fs::path>& files)
{
    Sorted sorted;
    const auto take = [&sorted](const fs::path& file, bool from_folder) {
        const PublishedFormat format = published_format(file);
        if (format == PublishedFormat::tsquare_table) sorted.tables.push_back(file);
        else sorted.shapes.push_back({file, format, from_folder});
    };
    for (const fs::path& file : files) {
        if (!fs::is_directory(file)) {
            take(file, false);
            continue;
        }
        std::vector<fs::path> inside;
        for (const auto& entry : fs::directory_iterator(file))
            if (entry.is_regular_file() && entry.path().extension() == ".dat") inside.push_back(entry.path());
        if (inside.empty()) throw Error(file.string(), "holds no .dat file", "name the files to import");
        std::ranges::sort(inside);
        for (const fs::path& one : inside) take(one, true);
    }
    return sorted;
}

/// Unit of the sets that the tables name [m]: the option's, else the tables'; 0 when neither says it.
double unit_of(const Sorted& sorted, const ImportOptions& options)
{
    double unit = options.unit;
    for (const fs::path& table : sorted.tables) {
        const double named = tsquare_table_unit(table);
        if (named > 0 && unit > 0 && std::abs(named / unit - 1) > 1e-12)
            throw UsageError(table.string(), "says that a unit is " + format_quantity(named, Dimension::length) + ", not " + format_quantity(unit, Dimension::length), "leave out --unit, or import one project at a time");
        if (unit == 0) unit = named;
    }
    return unit;
}

/// The degree that the published volume belongs to: TSQUARE goes up in steps of two, and a few rows of its tables name the step
/// where it gave up and hold the figures of the one before.
void find_published_degree(PublishedShape& shape)
{
    const auto meets = [&](int degree) { return std::abs(body_properties(truncated(shape.surface, degree)).volume / shape.figures.volume - 1) < 1e-6; };
    const int named = shape.figures.named_degree;
    if (named > 2 && !meets(named) && meets(named - 2)) shape.figures.degree = named - 2;
}

void scale(PublishedShape& shape, double factor)
{
    shape.surface = scaled(shape.surface, factor);
    shape.figures.volume *= factor * factor * factor;
    shape.figures.area *= factor * factor;
    shape.figures.lower *= factor;
    shape.figures.upper *= factor;
}

ImportedShape imported(PublishedShape shape, const ImportOptions& options)
{
    const int wanted = options.degree > 0 ? options.degree : shape.figures.degree > 0 ? shape.figures.degree : shape.surface.degree;
    shape.surface = truncated(shape.surface, wanted);
    BodyProperties body = body_properties(shape.surface);
    if (!(body.smallest_radius > 0))
        throw Error(shape.name, "its radius is not positive everywhere at degree " + std::to_string(shape.surface.degree), "take another degree");
    const auto diameter = [](double volume) { return std::cbrt(6 * volume / std::numbers::pi); };
    if (options.scale_to > 0) {
        scale(shape, options.scale_to / diameter(body.volume));
        body = body_properties(shape.surface);
    }
    ImportedShape result;
    result.name = result.record.name = shape.name;
    result.record.surface = shape.surface;
    result.record.surface.centre -= body.centroid;
    result.record.volume = body.volume;
    result.record.equivalent_diameter = diameter(body.volume);
    result.area = body.area;
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    // The shape is given by its coefficients: it is star-shaped, and there is no other surface to be near to.
    result.record.errors = {unknown, unknown, body.volume / shape.figures.volume - 1, body.area / shape.figures.area - 1, unknown, unknown, 0.0};
    // The frame moved by the centroid, and the box with it.
    result.figures = shape.figures;
    result.figures.lower -= body.centroid;
    result.figures.upper -= body.centroid;
    return result;
}

}  // namespace

ImportedSet import_shapes(const std::vector<fs::path>& files, const ImportOptions& options)
{
    const Sorted sorted = sort_files(files);
    const double unit = unit_of(sorted, options);
    std::map<std::string, PublishedFigures> table;
    for (const fs::path& file : sorted.tables) table.merge(read_tsquare_table(file, unit));
    ImportedSet set;
    std::vector<PublishedShape> published;
    for (const ShapeSource& source : sorted.shapes) {
        if (source.format == PublishedFormat::sand_atlas_table) {
            AxesTable axes = read_sand_atlas(source.file, options.degree > 0 ? options.degree : ellipsoid_degree);
            set.left_out += axes.left_out;
            set.too_slender += axes.too_slender;
            std::ranges::move(axes.shapes, std::back_inserter(published));
            continue;
        }
        const std::string name = source.file.filename().string();
        const auto row = table.find(name);
        // A table speaks for the sets it names; with --scale-to any unit does.
        const double size = row != table.end() && unit > 0 ? unit : options.unit > 0 ? options.unit : options.scale_to > 0 ? 1.0 : 0.0;
        if (size == 0 && source.from_folder) {
            set.without_unit.push_back(name);
            continue;
        }
        if (size == 0) throw UsageError(source.file.string(), "does not say the unit of its lengths", "give it, as in --unit 1mm, or a size, as in --scale-to 5mm");
        PublishedShape shape{name, read_tsquare(source.file, size), {}};
        if (row != table.end() && unit > 0) shape.figures = row->second;
        published.push_back(std::move(shape));
    }
    set.shapes.resize(published.size());
    parallel_blocks(published.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            if (published[n].figures.named_degree > 0) find_published_degree(published[n]);
            set.shapes[n] = imported(std::move(published[n]), options);
        }
    });
    if (set.shapes.empty() && !set.without_unit.empty())
        throw UsageError(set.without_unit.front(), "does not say the unit of its lengths", "give it, as in --unit 1mm, or a size, as in --scale-to 5mm");
    if (set.shapes.empty()) throw Error(sorted.tables.empty() ? "--import" : sorted.tables[0].string(), "there is no shape among the files, only a table of figures", "add the coefficient files it names");
    for (std::size_t n = 0; n < set.shapes.size(); ++n) set.shapes[n].record.id = int(n) + 1;
    return set;
}

}  // namespace coral::sh
