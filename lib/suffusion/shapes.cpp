#include "suffusion/shapes.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <optional>
#include <sstream>

#include "core/error.h"
#include "core/output_file.h"
#include "core/text.h"
#include "dem/superellipsoid.h"
#include "sdf/extend.h"
#include "sdf/mass_properties.h"
#include "sdf/mesh.h"
#include "sdf/mesh_reader.h"
#include "sdf/surface_nodes.h"
#include "sdf/vdb_io.h"
#include "sh/shape_file.h"
#include "sh/tabulate.h"

namespace coral::suffusion {

namespace {

constexpr int level_set_nodes = 6000, harmonics_nodes = 2500;  // docs/numerics.md, contact

std::shared_ptr<const dem::Shape> grid_shape(std::string name, sdf::DistanceGrid grid, int nodes, double apparent_volume)
{
    const sdf::MassProperties mass = sdf::mass_properties(grid);
    grid.origin -= mass.centroid;
    sdf::SurfaceNodes surface = sdf::surface_nodes(grid, nodes);
    dem::GridShapeData data;
    data.name = std::move(name);
    data.nodes = std::move(surface.positions);
    data.node_areas = std::move(surface.areas);
    data.volume = mass.volume;
    data.apparent_volume = apparent_volume;
    data.inertia = mass.inertia;
    data.distance = std::make_shared<const sdf::DistanceGrid>(std::move(grid));
    return dem::Shape::grid(std::move(data));
}

std::shared_ptr<const dem::Shape> level_set_shape(const BodySpec& body, const std::filesystem::path& file, double reach)
{
    const sdf::GrainReader reader(file);
    std::string digits = body.grid;
    const bool apparent = digits.ends_with("_apparent");
    if (apparent) digits.resize(digits.size() - 9);
    if (digits.starts_with("grain_")) digits = digits.substr(6);
    const bool number = !digits.empty() && std::ranges::all_of(digits, [](char c) { return c >= '0' && c <= '9'; }) && digits.size() < 10;
    if (!number || std::ranges::find(reader.ids(), std::stoi(digits)) == reader.ids().end()) {
        std::vector<std::string> names;
        for (const int id : reader.ids()) names.push_back("grain_" + std::to_string(id));
        throw UsageError(body.location, "there is no grid '" + body.grid + "' in " + file.string() + did_you_mean(body.grid, names),
                         "it holds grain_1 to grain_" + std::to_string(reader.ids().size()));
    }
    const sdf::GrainLevelSet grain = reader.read(std::stoi(digits));
    const sdf::DistanceGrid& grid = apparent ? grain.apparent : grain.solid;
    return grid_shape(file.filename().string() + " " + body.grid, sdf::extended(grid, reach + 2 * grid.spacing), level_set_nodes,
                      grain.apparent_volume);
}

std::shared_ptr<const dem::Shape> harmonics_shape(const BodySpec& body, const std::filesystem::path& file, double reach)
{
    const sh::ShapeFile shapes = sh::read_shapes(file);
    for (const sh::ShapeRecord& record : shapes.shapes) {
        if (std::to_string(record.id) != body.grid) continue;
        const double spacing = record.equivalent_diameter / 60;
        return grid_shape(file.filename().string() + " " + body.grid, sh::tabulate(sh::centred(record.surface), spacing, reach + 2 * spacing),
                          harmonics_nodes, 0);
    }
    throw UsageError(body.location, "there is no shape '" + body.grid + "' in " + file.string(),
                     "it holds " + std::to_string(shapes.shapes.size()) + " shapes");
}

/// Vertices of an OFF file, which names their number first.
std::vector<Eigen::Vector3d> read_off(const std::filesystem::path& file, double unit)
{
    std::istringstream in(read_text_file(file));
    std::string text, line;
    while (std::getline(in, line)) text += line.substr(0, line.find('#')) + "\n";
    in = std::istringstream(text);
    std::string magic;
    long vertices = -1, faces = -1, edges = -1;
    in >> magic >> vertices >> faces >> edges;
    if (magic != "OFF" || !in || vertices < 0) throw Error(file.string(), "is no OFF file: it does not begin with OFF and three counts", "write it again");
    std::vector<Eigen::Vector3d> points;
    for (long k = 0; k < vertices; ++k) {
        double x, y, z;
        if (!(in >> x >> y >> z)) throw Error(file.string(), "breaks off in vertex " + std::to_string(k + 1) + " of " + std::to_string(vertices), "write it again");
        points.emplace_back(unit * x, unit * y, unit * z);
    }
    return points;
}

std::shared_ptr<const dem::Shape> polyhedron_shape(const BodySpec& body, const std::filesystem::path& folder)
{
    if (body.file.empty()) return dem::Shape::polyhedron("polyhedron", dem::Polyhedron(body.vertices));
    const std::filesystem::path file = folder / body.file;
    const std::string extension = file.extension().string();
    const bool off = extension == ".off" || extension == ".OFF";
    if (off && !std::filesystem::exists(file)) throw UsageError(file.string(), "there is no such file", "name a mesh: .stl, .ply or .off");
    const std::vector<Eigen::Vector3d> points = off ? read_off(file, body.mesh_unit) : sdf::read_mesh(file, body.mesh_unit).vertices;
    return dem::Shape::polyhedron(file.filename().string(), dem::Polyhedron(points, file.string()));
}

/// Surface of a lattice shape on a lattice of about `across` cells over its diameter.
sdf::TriangleMesh thinned_mesh(const dem::Shape& shape, double across)
{
    const sdf::DistanceGrid& fine = shape.distance_grid();
    const int stride = std::max(1, static_cast<int>(std::lround(2 * shape.equivalent_radius() / (across * fine.spacing))));
    sdf::DistanceGrid coarse;
    coarse.spacing = stride * fine.spacing;
    coarse.origin = fine.origin;
    // One more node than fits: beyond the lattice all is outside.
    coarse.size = (fine.size.array() - 1) / stride + 2;
    for (int k = 0; k < coarse.size.z(); ++k)
        for (int j = 0; j < coarse.size.y(); ++j)
            for (int i = 0; i < coarse.size.x(); ++i) coarse.distance.push_back(static_cast<float>(fine.sample(coarse.node(i, j, k))));
    return sdf::extract_mesh(coarse);
}

/// Greatest area of a closed surface of the mesh: the outside, where closed voids have walls of their own.
double outer_area(const sdf::TriangleMesh& mesh)
{
    std::vector<int> root(mesh.vertices.size());
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](int v) {
        while (root[std::size_t(v)] != v) v = root[std::size_t(v)] = root[std::size_t(root[std::size_t(v)])];
        return v;
    };
    for (const Eigen::Vector3i& t : mesh.triangles)
        for (int corner = 1; corner < 3; ++corner) root[std::size_t(find(t[corner]))] = find(t[0]);
    std::vector<double> area(mesh.vertices.size(), 0.0);
    for (const Eigen::Vector3i& t : mesh.triangles)
        area[std::size_t(find(t[0]))] += sdf::triangle_area(mesh.vertices[std::size_t(t[0])], mesh.vertices[std::size_t(t[1])], mesh.vertices[std::size_t(t[2])]);
    return *std::ranges::max_element(area);
}

/// Area along the outward normal.
Eigen::Vector3d face_area(const dem::Polyhedron& body, std::size_t face)
{
    const std::vector<int>& corners = body.faces()[face];
    Eigen::Vector3d area = Eigen::Vector3d::Zero();
    for (std::size_t c = 2; c < corners.size(); ++c) {
        const Eigen::Vector3d &a = body.vertices()[std::size_t(corners[0])], &b = body.vertices()[std::size_t(corners[c - 1])], &d = body.vertices()[std::size_t(corners[c])];
        area += 0.5 * (b - a).cross(d - a);
    }
    return area;
}

}  // namespace

std::string shape_key(const BodySpec& body)
{
    std::string key = std::to_string(static_cast<int>(body.shape)) + "\n";
    if (body.shape == ShapeKind::sphere) return key;
    key += body.file.string() + "\n" + body.grid + "\n" + to_text(body.mesh_unit);
    const auto append = [&](const Eigen::Vector3d& v) { key += "\n" + to_text(v.x()) + " " + to_text(v.y()) + " " + to_text(v.z()); };
    for (const Eigen::Vector3d& v : body.vertices) append(v);
    append(body.radii);
    append({body.exponents[0], body.exponents[1], 0});
    return key;
}

std::shared_ptr<const dem::Shape> make_shape(const BodySpec& body, const std::filesystem::path& folder, double reach)
{
    switch (body.shape) {
        case ShapeKind::level_set: return level_set_shape(body, folder / body.file, reach);
        case ShapeKind::harmonics: return harmonics_shape(body, folder / body.file, reach);
        case ShapeKind::polyhedron: return polyhedron_shape(body, folder);
        case ShapeKind::superellipsoid: return dem::superellipsoid_shape({body.radii, body.exponents[0], body.exponents[1]}, reach);
        case ShapeKind::sphere: break;
    }
    return dem::Shape::sphere(0.5);
}

History shape_history(const BodySpec& body, const std::filesystem::path& folder)
{
    if (body.shape == ShapeKind::level_set) return sdf::GrainReader(folder / body.file).history();
    if (body.shape == ShapeKind::harmonics) return sh::read_shapes(folder / body.file).history;
    return {};
}

Surface viewing_surface(const dem::Shape& shape)
{
    Surface surface;
    if (shape.kind() == dem::ShapeKind::polyhedron) {
        const dem::Polyhedron& body = shape.polyhedron();
        surface.vertices.assign(body.vertices().begin(), body.vertices().end());
        surface.polygons.assign(body.faces().begin(), body.faces().end());
    }
    if (shape.kind() != dem::ShapeKind::grid) return surface;
    const sdf::TriangleMesh mesh = thinned_mesh(shape, 24);
    surface.vertices = mesh.vertices;
    for (const Eigen::Vector3i& t : mesh.triangles) surface.polygons.push_back({t[0], t[1], t[2]});
    return surface;
}

Outline::Outline(const dem::Shape& shape)
{
    if (shape.kind() == dem::ShapeKind::sphere) return;
    const double radius = shape.equivalent_radius();
    section_ = std::numbers::pi * radius * radius;
    std::optional<dem::Polyhedron> hull;
    double surface = 0;
    if (shape.kind() == dem::ShapeKind::polyhedron) {
        hull = shape.polyhedron();
        surface = hull->surface();
    } else {
        const sdf::TriangleMesh mesh = thinned_mesh(shape, 40);
        surface = outer_area(mesh);
        hull.emplace(mesh.vertices, shape.name());
    }
    sphericity_ = std::min(4 * section_ / surface, 1.0);
    for (std::size_t face = 0; face < hull->faces().size(); ++face) add_face(face_area(*hull, face));
}

/// Takes faces within about 4 degrees together: the cosine of half of that is 1 to 6e-4.
void Outline::add_face(const Eigen::Vector3d& area)
{
    for (Eigen::Vector3d& known : areas_)
        if (std::abs(known.dot(area)) > 0.9975 * known.norm() * area.norm()) {
            known += known.dot(area) > 0 ? area : (-area).eval();
            return;
        }
    areas_.push_back(area);
}

double Outline::crosswise_sphericity(const Eigen::Vector3d& direction) const
{
    if (areas_.empty()) return 1;
    double seen = 0;
    for (const Eigen::Vector3d& area : areas_) seen += std::abs(area.dot(direction));
    return section_ * direction.norm() / (0.5 * seen);
}

}  // namespace coral::suffusion
