#include "suffusion/case_file.h"

#include <cmath>

#include "core/config.h"
#include "core/error.h"
#include "core/output_file.h"
#include "core/text.h"
#include "dem/polyhedron.h"
#include "fluid/drag.h"
#include "fluid/flow.h"

namespace coral::suffusion {

namespace {

using std::string;
using Strings = std::vector<string>;

template <class Enum>
Enum index_of(const Strings& names, const string& name)
{
    for (std::size_t i = 0; i < names.size(); ++i)
        if (names[i] == name) return static_cast<Enum>(i);
    return Enum{};
}

/// Reads one of a set of names into the enumerator of the same place.
template <class Enum>
Enum read_choice(const ConfigTable& table, const char* key, const Strings& names, const char* fallback)
{
    return index_of<Enum>(names, table.choice(key, names, fallback ? std::optional<string>(fallback) : std::nullopt));
}

const Strings boundary_names{"slip", "wall", "inlet", "outlet", "periodic"};
const Strings motion_names{"free", "fixed", "prescribed"};
const Strings scheme_names{"auto", "resolved", "semi-resolved", "unresolved"};

double positive(const ConfigTable& table, const char* key, Dimension dimension, std::optional<double> fallback = {})
{
    const double value = table.quantity(key, dimension, fallback);
    if (table.has(key) && !(value > 0)) table.error(key, "is " + to_text(value), "give a value above zero");
    return value;
}

double not_negative(const ConfigTable& table, const char* key, Dimension dimension, double fallback)
{
    const double value = table.quantity(key, dimension, fallback);
    if (table.has(key) && !(value >= 0)) table.error(key, "is " + to_text(value), "give zero or more");
    return value;
}

/// A time, or a word that stands for zero ("auto", "none").
double time_or_word(const ConfigTable& table, const char* key, const string& word, double fallback)
{
    if (!table.has(key)) return fallback;
    if (!table.is_string(key)) return positive(table, key, Dimension::time);
    const string text = table.string(key);
    if (text == word) return 0;
    if (text.find_first_of("0123456789") != string::npos) return positive(table, key, Dimension::time);
    table.error(key, "= '" + text + "' is no time", "give one such as \"1ms\", or \"" + word + "\"");
    return fallback;
}

DomainSpec read_domain(const ConfigTable& table, bool with_fluid)
{
    DomainSpec domain;
    domain.origin = table.vector("origin", Dimension::length, Eigen::Vector3d::Zero().eval());
    domain.size = table.vector("size", Dimension::length);
    if (table.has("size") && !(domain.size.minCoeff() > 0)) table.error("size", "has an edge that is not above zero");
    if (!with_fluid && !table.has("cell")) return domain;
    domain.cell = positive(table, "cell", Dimension::length);
    if (!(domain.cell > 0) || !(domain.size.minCoeff() > 0)) return domain;
    for (int axis = 0; axis < 3; ++axis) {
        const double count = domain.size[axis] / domain.cell;
        domain.cells[axis] = static_cast<int>(std::lround(count));
        if (domain.cells[axis] < 1 || std::abs(count - domain.cells[axis]) > 1e-6 * std::max(count, 1.0))
            table.error("size", "along " + string(1, "xyz"[axis]) + " is " + to_text(count) + " cells of " + to_text(domain.cell) + " m",
                        "give a whole number of cells, such as " +
                            to_text(std::max<double>(1, std::round(count)) * domain.cell));
    }
    return domain;
}

FaceCondition read_face(const ConfigTable& table, int face)
{
    FaceCondition condition;
    condition.kind = read_choice<BoundaryKind>(table, "type", boundary_names, nullptr);
    if (condition.kind == BoundaryKind::inlet) {
        condition.velocity = table.vector("velocity", Dimension::velocity);
        const double inward = condition.velocity[face / 2] * (face % 2 == 0 ? 1 : -1);
        if (table.has("velocity") && inward == 0)
            table.error("velocity", "carries no flow through the face: the inlet is closed",
                        "give a velocity along the inward normal, or type \"slip\" or \"wall\"");
        else if (inward < 0)
            table.error("velocity", "points out of the domain: the inlet is closed", "turn its sign, or make the face an outlet");
    }
    if (condition.kind == BoundaryKind::wall)
        condition.velocity = table.vector("velocity", Dimension::velocity, Eigen::Vector3d::Zero().eval());
    if (condition.kind == BoundaryKind::wall && condition.velocity[face / 2] != 0)
        table.error("velocity", "of a wall has a part along the normal", "walls may slide only along themselves");
    if (condition.kind == BoundaryKind::outlet) condition.pressure = table.quantity("pressure", Dimension::pressure, 0.0);
    return condition;
}

void read_boundary(const ConfigTable& root, Case& result)
{
    const ConfigTable boundary = root.table("boundary");
    bool has_inlet = false, has_outlet = false;
    const char* first_inlet = nullptr;
    for (int face = 0; face < 6; ++face) {
        if (!boundary.has(face_names[face])) continue;
        result.boundary[face] = read_face(boundary.table(face_names[face]), face);
        const BoundaryKind kind = result.boundary[face].kind;
        if (kind == BoundaryKind::inlet && !has_inlet) first_inlet = face_names[face];
        has_inlet |= kind == BoundaryKind::inlet;
        has_outlet |= kind == BoundaryKind::outlet;
    }
    for (int axis = 0; axis < 3; ++axis) {
        const bool low = result.boundary[2 * axis].kind == BoundaryKind::periodic;
        const bool high = result.boundary[2 * axis + 1].kind == BoundaryKind::periodic;
        if (low != high)
            boundary.error(face_names[2 * axis + (low ? 0 : 1)], string("is periodic and ") + face_names[2 * axis + (low ? 1 : 0)] + " is not",
                           "periodic faces come in pairs");
    }
    if (has_inlet && !has_outlet)
        boundary.error(first_inlet, "is an inlet and no face is an outlet: the inlet is closed", "make the face across it { type = \"outlet\", pressure = 0 }");
}

MaterialSpec read_material(const ConfigTable& table)
{
    MaterialSpec material;
    material.density = positive(table, "density", Dimension::density, material.density);
    material.normal_stiffness = positive(table, "normal_stiffness", Dimension::stiffness, material.normal_stiffness);
    material.tangential_stiffness = not_negative(table, "tangential_stiffness", Dimension::stiffness, material.tangential_stiffness);
    material.friction = not_negative(table, "friction", Dimension::number, material.friction);
    material.damping = not_negative(table, "damping", Dimension::number, material.damping);
    if (material.damping >= 1) table.error("damping", "is " + to_text(material.damping), "it is a ratio: 0 keeps all energy, 1 is critical");
    return material;
}

/// Vertices in the case or a mesh file, whose hull is taken. Vertices are tried at once, so that errors have their place.
void read_polyhedron(const ConfigTable& shape, BodySpec& spec)
{
    static const Strings units{"m", "cm", "mm", "um"};
    if (shape.has("file") == shape.has("vertices")) {
        shape.error(shape.has("file") ? "file" : "vertices", shape.has("file") ? "stands beside vertices" : "is missing",
                    "give vertices = [[x, y, z], ...], or file = \"stone.stl\" and its unit");
        shape.keys();
        return;
    }
    if (shape.has("vertices")) {
        spec.vertices = shape.vectors("vertices", Dimension::length);
        if (spec.vertices.empty()) return;
        try {
            dem::Polyhedron(spec.vertices, "");
        } catch (const Error& error) {
            const string text = error.what();
            shape.error("vertices", text.starts_with(": ") ? text.substr(2) : text);
        }
        return;
    }
    spec.file = shape.string("file");
    const string unit = shape.choice("unit", units);
    spec.mesh_unit = unit == "m" ? 1.0 : unit == "cm" ? 1e-2 : unit == "mm" ? 1e-3 : 1e-6;
}

void read_superellipsoid(const ConfigTable& shape, BodySpec& spec)
{
    spec.radii = shape.vector("radii", Dimension::length);
    if (shape.has("radii") && !(spec.radii.minCoeff() > 0)) shape.error("radii", "has a radius that is not above zero");
    const std::vector<double> e = shape.quantities("exponents", Dimension::number, std::vector<double>{1, 1});
    if (e.size() != 2) {
        shape.error("exponents", "has " + std::to_string(e.size()) + " values", "expected two, [e1, e2]");
        return;
    }
    for (const double value : e)
        if (!(value > 0 && value <= 2))
            shape.error("exponents", "has " + to_text(value) + ", outside (0, 2]", "0.1 is nearly a box, 1 an ellipsoid, 2 an octahedron; above 2 the body is hollowed");
    spec.exponents = {e[0], e[1]};
}

void read_shape(const ConfigTable& body, BodySpec& spec)
{
    static const Strings kinds{"sphere", "level-set", "sh", "polyhedron", "superellipsoid"};
    if (!body.has("shape")) {
        body.error("shape", "is missing", "give shape = { type = \"sphere\", diameter = \"15mm\" }, or another of its types");
        return;
    }
    const ConfigTable shape = body.table("shape");
    spec.shape = read_choice<ShapeKind>(shape, "type", kinds, nullptr);
    switch (spec.shape) {
        case ShapeKind::sphere: spec.diameter = positive(shape, "diameter", Dimension::length); break;
        case ShapeKind::level_set:
            spec.file = shape.string("file");
            spec.grid = shape.string("grid");
            break;
        case ShapeKind::harmonics:
            spec.file = shape.string("file");
            spec.grid = shape.is_string("id") ? shape.string("id") : std::to_string(shape.integer("id"));
            break;
        case ShapeKind::polyhedron: read_polyhedron(shape, spec); break;
        case ShapeKind::superellipsoid: read_superellipsoid(shape, spec); break;
    }
}

BodySpec read_body(const ConfigTable& table, const Case& result)
{
    BodySpec body;
    body.location = table.location("shape");
    read_shape(table, body);
    body.position = table.vector("position", Dimension::length);
    body.velocity = table.vector("velocity", Dimension::velocity, body.velocity);
    body.angular_velocity = table.vector("angular_velocity", Dimension::angular_velocity, body.angular_velocity);
    if (table.has("orientation")) {
        const std::vector<double> q = table.quantities("orientation", Dimension::number);
        if (q.size() != 4 || !(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] > 0))
            table.error("orientation", "is no quaternion", "give four numbers (w, x, y, z), not all zero");
        else
            body.orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
    }
    body.scale = positive(table, "scale", Dimension::number, 1.0);
    if (table.has("density")) body.density = positive(table, "density", Dimension::density);
    body.material = table.string("material", "default");
    if (!result.materials.contains(body.material)) {
        Strings names;
        for (const auto& [name, material] : result.materials) names.push_back(name);
        table.error("material", "\"" + body.material + "\" is not described" + did_you_mean(body.material, names),
                    "add a table [material." + body.material + "]");
    }
    body.role = table.string("role", "coarse");
    body.motion = read_choice<BodyMotion>(table, "motion", motion_names, "free");
    body.scheme = read_choice<Scheme>(table, "scheme", scheme_names, "auto");
    return body;
}

WallSpec read_wall(const ConfigTable& table, const Case& result)
{
    static const Strings kinds{"plane", "plate", "box"};
    WallSpec wall;
    wall.kind = read_choice<WallKind>(table, "type", kinds, nullptr);
    wall.material = table.string("material", "default");
    if (!result.materials.contains(wall.material)) table.error("material", "\"" + wall.material + "\" is not described");
    if (wall.kind == WallKind::plane) {
        wall.point = table.vector("point", Dimension::length);
        wall.normal = table.vector("normal", Dimension::number);
        if (table.has("normal") && !(wall.normal.norm() > 0)) table.error("normal", "has no length");
        else wall.normal.normalize();
    } else if (wall.kind == WallKind::box) {
        wall.origin = table.vector("origin", Dimension::length);
        wall.size = table.vector("size", Dimension::length);
        if (table.has("size") && !(wall.size.minCoeff() > 0)) table.error("size", "has an edge that is not above zero");
    } else {
        wall.z = table.quantity("z", Dimension::length);
        wall.hole = positive(table, "hole", Dimension::length);
        wall.pitch = positive(table, "pitch", Dimension::length);
        wall.thickness = positive(table, "thickness", Dimension::length, 1e-3);
        if (wall.hole >= wall.pitch && wall.pitch > 0)
            table.error("pitch", "is not above hole: nothing is left of the plate", "the pitch is the distance of hole centres");
    }
    return wall;
}

void read_populations(const ConfigTable& root, Case& result)
{
    result.sphere_scheme = dem::sphere_scheme_of(root.table("contact").choice("spheres", dem::sphere_scheme_words, "automatic"));
    const ConfigTable schemes = root.table("scheme"), motions = root.table("motion");
    for (const string& role : schemes.keys()) result.scheme_of_role[role] = read_choice<Scheme>(schemes, role.c_str(), scheme_names, "auto");
    for (const string& role : motions.keys()) result.motion_of_role[role] = read_choice<BodyMotion>(motions, role.c_str(), motion_names, "free");
}

void read_time_and_output(const ConfigTable& root, Case& result)
{
    const ConfigTable time = root.table("time"), output = root.table("output");
    if (!root.has("time")) root.error("time", "is missing", "give [time] with duration = \"2s\"");
    else result.time.duration = positive(time, "duration", Dimension::time);
    result.time.dem_step = time_or_word(time, "dem_step", "auto", 0);
    result.time.cfl = positive(time, "cfl", Dimension::number, result.time.cfl);
    static const Strings flow_schemes{"auto", "adams-bashforth", "runge-kutta"};
    result.time.flow_scheme = read_choice<FlowScheme>(time, "flow_scheme", flow_schemes, "auto");
    const double most = fluid::max_cfl(result.time.flow_scheme == FlowScheme::runge_kutta ? fluid::TimeScheme::runge_kutta : fluid::TimeScheme::adams_bashforth);
    if (result.time.cfl > most) time.error("cfl", "is " + to_text(result.time.cfl), "above " + to_text(most) + " the flow step is not stable");
    result.time.max_step = positive(time, "max_step", Dimension::time, result.time.max_step);
    result.output.interval = positive(output, "interval", Dimension::time, std::max(result.time.duration / 100, 1e-12));
    result.output.frames = time_or_word(output, "frames", "none", 0);
    result.output.checkpoint = positive(output, "checkpoint", Dimension::time, result.output.checkpoint);
    const std::int64_t layers = output.integer("layers", result.output.layers);
    if (layers < 1 || layers > 100) output.error("layers", "is " + std::to_string(layers), "give a whole number from 1 to 100");
    else result.output.layers = static_cast<int>(layers);
    if (!output.has("track")) return;
    if (output.is_string("track")) {
        static const Strings words{"all", "none"};
        result.output.track_all = output.choice("track", words) == "all";
    } else {
        result.output.track_all = false;
        for (const std::int64_t body : output.integers("track")) {
            if (body < 0) output.error("track", "has the body number " + std::to_string(body), "bodies are counted from 0");
            else result.output.track.push_back(static_cast<std::size_t>(body));
        }
    }
}

void read_fluid(const ConfigTable& root, Case& result)
{
    if (!root.has("fluid")) return;
    static const Strings disturbances{"removed", "volume-removed", "kept"};
    static const Strings precisions{"double", "single"};
    const ConfigTable fluid = root.table("fluid");
    FluidSpec spec;
    spec.density = positive(fluid, "density", Dimension::density, spec.density);
    spec.kinematic_viscosity = positive(fluid, "kinematic_viscosity", Dimension::kinematic_viscosity, spec.kinematic_viscosity);
    spec.body_acceleration = fluid.vector("body_acceleration", Dimension::acceleration, spec.body_acceleration);
    spec.initial_velocity = fluid.vector("initial_velocity", Dimension::velocity, spec.initial_velocity);
    spec.drag = fluid.choice("drag", fluid::drag_law_names(), "gidaspow");
    spec.self_disturbance = fluid.choice("self_disturbance", disturbances, "removed");
    spec.precision = read_choice<fluid::Precision>(fluid, "precision", precisions, "double");
    const std::vector<double> support = fluid.quantities("kernel_support", Dimension::number, std::vector<double>{2, 4});
    if (support.size() != 2 || !(support[0] >= 1 && support[1] >= support[0] && support[1] <= 12))
        fluid.error("kernel_support", "is no pair of support diameters", "give [for the void fraction, for what a grain feels] in grain diameters, such as [2, 4]");
    else
        spec.kernel_support = {support[0], support[1]};
    result.fluid = spec;
    if (!root.has("domain")) root.error("domain", "is missing", "a case with [fluid] needs origin, size and cell");
}

}  // namespace

const WallSpec* Case::plate() const
{
    for (const WallSpec& wall : walls)
        if (wall.kind == WallKind::plate) return &wall;
    return nullptr;
}

int Case::flow_axis() const
{
    for (int face = 0; face < 6; ++face)
        if (boundary[face].kind == BoundaryKind::inlet) return face / 2;
    if (fluid && fluid->body_acceleration.norm() > 0) {
        int axis = 0;
        fluid->body_acceleration.cwiseAbs().maxCoeff(&axis);
        return axis;
    }
    return 2;
}

Case read_case(const std::filesystem::path& path)
{
    const bool folder = std::filesystem::is_directory(path);
    const std::filesystem::path file = folder ? path / "case.toml" : path;
    if (!std::filesystem::exists(file))
        throw UsageError(file.string(), "there is no such file", "name a case folder with case.toml, or make one with make-case");
    Case result;
    result.folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
    result.text = read_text_file(file);
    const Config config = Config::from_text(result.text, file.string());
    const ConfigTable& root = config.root();

    if (root.has("sample")) result.sample = result.folder / root.string("sample");
    read_fluid(root, result);
    if (root.has("domain")) result.domain = read_domain(root.table("domain"), root.has("fluid"));
    read_boundary(root, result);
    result.gravity = root.table("gravity").vector("vector", Dimension::acceleration, Eigen::Vector3d(0, 0, -9.81));
    result.materials["default"] = {};
    const ConfigTable materials = root.table("material");
    for (const string& name : materials.keys()) {
        result.materials[name] = read_material(materials.table(name));
        result.overrides_material |= name == "default";
    }
    for (const ConfigTable& body : root.tables("body")) result.bodies.push_back(read_body(body, result));
    for (const ConfigTable& wall : root.tables("wall")) result.walls.push_back(read_wall(wall, result));
    read_populations(root, result);
    read_time_and_output(root, result);
    config.finish();
    return result;
}

}  // namespace coral::suffusion
