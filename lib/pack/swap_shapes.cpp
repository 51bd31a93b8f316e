// Templates for a swap: harmonics and thinned hulls of the grains of a library or of the sample itself.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/text.h"
#include "dem/polyhedron.h"
#include "pack/detail/swap.h"
#include "sdf/surface_nodes.h"
#include "sdf/vdb_io.h"
#include "sh/fit.h"
#include "sh/quadrature.h"
#include "sh/shape_file.h"
#include "sh/tabulate.h"

namespace coral::pack::detail {
namespace {

using Vec3 = Eigen::Vector3d;

double diameter_of(double volume) { return std::cbrt(6 * volume / std::numbers::pi); }

std::string percent(double share) { return to_text(std::round(1000 * share) / 10) + " %"; }

sh::Surface surface_of(const Stone& stone, int degree, std::vector<std::string>& warnings)
{
    if (!stone.coefficients.empty()) {
        sh::Surface surface;
        surface.degree = stone.degree;
        surface.centre = stone.centre;
        surface.coefficients = stone.coefficients;
        return surface;
    }
    if (!stone.apparent)
        throw UsageError(stone.name, "holds neither harmonics nor a level set to fit them to", "name a file of shapes with --library grains.sh.h5");
    const sh::RadialSamples samples = sh::cast_rays(*stone.apparent, degree);
    if (!samples.centre_inside || samples.non_star_fraction > sh::non_star_refusal)
        throw Error(stone.name, percent(samples.non_star_fraction) + " of the directions from its centroid cross the surface more than once, harmonics cannot describe it",
                    "leave the grain out of the packing, or keep level sets");
    if (samples.non_star_fraction > sh::non_star_warning)
        warnings.push_back(stone.name + ": " + percent(samples.non_star_fraction) + " of the directions cross its surface more than once; the outermost crossing is fitted");
    return sh::fit(samples, degree, stone.volume);
}

/// Corners of the hull that is left of the points.
std::vector<Vec3> thinned_hull(const std::vector<Vec3>& points, int corners, const std::string& name)
{
    std::vector<Vec3> chosen;
    std::vector<char> taken(points.size(), 0);
    const auto take = [&](std::size_t i) {
        if (!taken[i]) chosen.push_back(points[i]);
        taken[i] = 1;
    };
    for (int axis = 0; axis < 3; ++axis) {
        const auto less = [axis](const Vec3& a, const Vec3& b) { return a[axis] < b[axis]; };
        take(std::size_t(std::min_element(points.begin(), points.end(), less) - points.begin()));
        take(std::size_t(std::max_element(points.begin(), points.end(), less) - points.begin()));
    }
    while (int(chosen.size()) < corners) {
        const dem::Polyhedron hull(chosen, name);
        std::size_t farthest = 0;
        double most = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            Vec3 normal;
            const double out = taken[i] ? 0 : hull.depth_and_normal(points[i] - hull.moved(), normal);
            if (out > most) farthest = i, most = out;
        }
        if (!(most > 1e-6 * hull.bounding_radius())) break;
        take(farthest);
    }
    return chosen;
}

}  // namespace

std::optional<std::int64_t> id_of(const std::string& name)
{
    const std::size_t last = name.find_last_not_of("0123456789");
    const std::string digits = name.substr(last == std::string::npos ? 0 : last + 1);
    if (digits.empty() || digits.size() > 18) return {};
    return std::stoll(digits);
}

Stone stone_of(const ShapeTemplate& shape)
{
    Stone stone;
    stone.name = shape.name;
    stone.id = id_of(shape.name).value_or(0);
    stone.degree = shape.degree;
    stone.coefficients = shape.coefficients;
    stone.centre = shape.centre;
    stone.volume = shape.apparent_volume;
    stone.apparent = shape.apparent_grid ? shape.apparent_grid : shape.grid;
    stone.points = shape.kind == ShapeKind::polyhedron ? shape.vertices : shape.nodes;
    return stone;
}

Library read_library(const std::filesystem::path& file)
{
    constexpr int points = 3000;
    Library library;
    if (file.extension() == ".vdb") {
        const sdf::GrainReader reader(file);
        library.history = reader.history();
        for (const int id : reader.ids()) {
            sdf::GrainLevelSet grain = reader.read(id);
            Stone stone;
            stone.id = id;
            stone.name = file.filename().string() + " grain_" + std::to_string(id);
            stone.volume = grain.apparent_volume;
            stone.points = sdf::surface_nodes(grain.apparent, points).positions;
            stone.apparent = std::make_shared<const sdf::DistanceGrid>(std::move(grain.apparent));
            library.stones.push_back(std::move(stone));
        }
    } else {
        const sh::ShapeFile shapes = sh::read_shapes(file);
        library.history = shapes.history;
        for (const sh::ShapeRecord& record : shapes.shapes) {
            Stone stone;
            stone.id = record.id;
            stone.name = file.filename().string() + " shape " + std::to_string(record.id);
            stone.degree = record.surface.degree;
            stone.coefficients = record.surface.coefficients;
            stone.centre = record.surface.centre;
            stone.volume = sh::body_properties(record.surface).volume;
            const sh::Evaluator surface(record.surface);
            for (const Vec3& u : sh::spread_directions(points)) stone.points.push_back(surface.point(u));
            library.stones.push_back(std::move(stone));
        }
    }
    if (library.stones.empty()) throw Error(file.string(), "has no grains", "make it again with csct2ls or ls2sh");
    return library;
}

NewShape harmonic_shape(const Stone& stone, double volume, int degree, double reach, int nodes, std::vector<std::string>& warnings)
{
    const sh::Surface surface = sh::scaled_to_volume(surface_of(stone, degree, warnings), volume);
    const sh::BodyProperties body = sh::body_properties(surface);
    if (!(body.smallest_radius > 0))
        throw Error(stone.name, "its harmonics of degree " + std::to_string(surface.degree) + " have no positive radius everywhere", "fit a higher degree");
    const sh::Surface centred = sh::centred(surface);
    const double d = diameter_of(body.volume), spacing = d / 60;
    if (reach > 4 * d)
        throw UsageError(stone.name, "spheres " + to_text(std::round(2 * reach / (1.5 * d))) + " times its size would need its distance far outside", "take polyhedra for the fine grains");
    NewShape made;
    made.origin = body.centroid;
    ShapeTemplate& shape = made.shape;
    shape.kind = ShapeKind::sh;
    shape.name = stone.name;
    shape.volume = shape.apparent_volume = body.volume;
    shape.equivalent_diameter = d;
    shape.inertia = body.inertia;
    shape.grid = std::make_shared<sdf::DistanceGrid>(sh::tabulate(centred, spacing, std::max(reach, 3 * spacing)));
    shape.degree = centred.degree;
    shape.coefficients = centred.coefficients;
    shape.centre = centred.centre;
    sdf::SurfaceNodes surface_nodes = sdf::surface_nodes(*shape.grid, nodes);
    shape.nodes = std::move(surface_nodes.positions);
    shape.node_areas = std::move(surface_nodes.areas);
    return made;
}

NewShape polyhedral_shape(const Stone& stone, double volume, int faces, int nodes)
{
    // a hull of triangles with c corners has 2c - 4 of them
    std::vector<Vec3> corners = thinned_hull(stone.points, faces / 2 + 2, stone.name);
    const dem::Polyhedron rough(corners, stone.name);
    const double factor = std::cbrt(volume / rough.volume());
    for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = factor * (corners[i] - rough.moved());
    const dem::Polyhedron hull(corners, stone.name);
    NewShape made;
    made.origin = rough.moved() + hull.moved();  // scaled about the centroid
    ShapeTemplate& shape = made.shape;
    shape.kind = ShapeKind::polyhedron;
    shape.name = stone.name + " hull of " + std::to_string(hull.faces().size()) + " faces";
    shape.volume = shape.apparent_volume = hull.volume();
    shape.equivalent_diameter = diameter_of(hull.volume());
    shape.inertia = hull.inertia();
    shape.vertices.assign(hull.vertices().begin(), hull.vertices().end());
    dem::SurfaceNodes surface_nodes = dem::polyhedron_nodes(hull, nodes);
    shape.nodes = std::move(surface_nodes.positions);
    shape.node_areas = std::move(surface_nodes.areas);
    return made;
}

}  // namespace coral::pack::detail
