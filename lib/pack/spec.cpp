#include "pack/spec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "core/config.h"
#include "core/error.h"
#include "core/output_file.h"
#include "core/text.h"
#include "dem/polyhedron.h"
#include "sdf/mesh_reader.h"

namespace coral::pack {
namespace {

void require_positive(const ConfigTable& table, const char* key, double value)
{
    if (!(value > 0)) table.error(key, "must be greater than zero, is " + to_text(value));
}

void require_share(const ConfigTable& table, const char* key, double value, bool zero_allowed)
{
    if (!(value < 1) || value < 0 || (value == 0 && !zero_allowed))
        table.error(key, std::string("must lie between 0 and 1, is ") + to_text(value));
}

Material read_material(const ConfigTable& table, const std::string& name)
{
    Material m;
    m.name = name;
    m.density = table.quantity("density", Dimension::density, m.density);
    m.normal_stiffness = table.quantity("normal_stiffness", Dimension::stiffness, m.normal_stiffness);
    m.tangential_stiffness = table.quantity("tangential_stiffness", Dimension::stiffness, m.tangential_stiffness);
    m.friction = table.quantity("friction", Dimension::number, m.friction);
    m.damping = table.quantity("damping", Dimension::number, m.damping);
    require_positive(table, "density", m.density);
    require_positive(table, "normal_stiffness", m.normal_stiffness);
    if (m.tangential_stiffness < 0) table.error("tangential_stiffness", "is negative");
    if (m.friction < 0) table.error("friction", "is negative");
    require_share(table, "damping", m.damping, true);
    return m;
}

void read_gradation_table(const ConfigTable& table, Population& p)
{
    p.gradation = Gradation::table;
    const ConfigTable psd = table.table("psd");
    const auto sizes = psd.quantities("size", Dimension::length);
    const auto passing = psd.quantities("passing", Dimension::number);
    if (sizes.size() < 2 || sizes.size() != passing.size())
        return psd.error("passing", std::to_string(sizes.size()) + " sizes and " + std::to_string(passing.size()) + " passings",
                         "give both lists the same length, at least two");
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        if (!(sizes[i] > 0)) return psd.error("size", "size " + std::to_string(i + 1) + " is not greater than zero");
        if (i > 0 && (sizes[i] < sizes[i - 1] || passing[i] < passing[i - 1]))
            return psd.error("size", "sizes and passings must rise from point to point; point " + std::to_string(i + 1) + " falls");
        p.psd.push_back({sizes[i], passing[i]});
    }
    if (passing.front() != 0)
        psd.error("passing", "starts at " + to_text(100 * passing.front()) + " %, not 0 %", "add the size that nothing passes");
    if (std::abs(passing.back() - 1) > 1e-9)
        psd.error("passing", "ends at " + to_text(100 * passing.back()) + " %, not 100 %", "add the size that everything passes");
    p.smallest = sizes.front();
    p.largest = sizes.back();
}

void read_diameters(const ConfigTable& table, Population& p)
{
    const int given = table.has("diameter") + table.has("diameters") + table.has("psd");
    if (table.has("scale")) {
        p.scale = table.quantity("scale", Dimension::number, 1.0);
        require_positive(table, "scale", p.scale);
        if (given > 0) table.error("scale", "stands beside a diameter", "scale multiplies the size of the shape, a diameter replaces it: keep one of them");
        else if (p.shape == ShapeKind::sphere) table.error("scale", "means nothing for spheres", "write diameter");
    }
    if (given > 1) table.error("diameter", "more than one of diameter, diameters and psd is given", "keep one of them");
    if (given == 0) {
        p.own_size = true;
        if (p.shape == ShapeKind::sphere) table.error("diameter", "is missing", "write diameter, diameters or psd");
    } else if (table.has("diameter")) {
        p.smallest = p.largest = table.quantity("diameter", Dimension::length, 1.0);
        require_positive(table, "diameter", p.smallest);
    } else if (table.has("diameters")) {
        p.gradation = Gradation::uniform;
        const auto ends = table.quantities("diameters", Dimension::length);
        if (ends.size() != 2 || !(ends[0] > 0) || !(ends[1] >= ends[0]))
            return table.error("diameters", "takes two sizes greater than zero, the smaller one first");
        p.smallest = ends[0];
        p.largest = ends[1];
    } else {
        read_gradation_table(table, p);
    }
}

/// Takes corners whose hull has a volume; tried at once, so that the error has its place.
void take_corners(const ConfigTable& table, const char* key, Corners corners, Population& p)
{
    try {
        dem::Polyhedron(corners.points, corners.name);
        p.polyhedra.push_back(std::move(corners));
    } catch (const Error& error) {
        table.error(key, error.what());
    }
}

/// The hull of `vertices`, or of each mesh of `file` (one name or a list).
void read_polyhedra(const ConfigTable& table, const std::filesystem::path& folder, Population& p)
{
    static const std::array<std::string, 4> units{"m", "cm", "mm", "um"};
    static constexpr std::array lengths{1.0, 1e-2, 1e-3, 1e-6};
    if (table.has("file") == table.has("vertices")) {
        table.error(table.has("file") ? "vertices" : "file", table.has("file") ? "stands beside file" : "is missing",
                    "give file = \"stone.stl\" (or a list of files) and its unit, or vertices = [[x, y, z], ...]");
        table.keys();
        return;
    }
    if (table.has("vertices")) {
        const auto vertices = table.vectors("vertices", Dimension::length);
        if (!vertices.empty()) take_corners(table, "vertices", {"polyhedron", vertices}, p);
        return;
    }
    const std::string unit = table.choice("unit", units);
    const double length = lengths[std::size_t(std::find(units.begin(), units.end(), unit) - units.begin()) % units.size()];
    const std::vector<std::string> names = table.is_array("file") ? table.strings("file") : std::vector{table.string("file")};
    if (table.is_array("file") && names.empty()) table.error("file", "is an empty list", "write at least one mesh");
    for (const std::string& name : names) {
        const std::filesystem::path file = folder / name;
        const std::string extension = file.extension().string();
        if (extension != ".stl" && extension != ".ply") table.error("file", "'" + name + "' is no mesh that can be read", "take a .stl or .ply file");
        else if (!std::filesystem::exists(file)) table.error("file", "'" + file.string() + "' does not exist", "paths are relative to the folder of this file");
        else {
            take_corners(table, "file", {file.filename().string(), sdf::read_mesh(file, length).vertices}, p);
            p.meshes.push_back(file);
        }
    }
}

void read_superellipsoid(const ConfigTable& table, Population& p)
{
    p.radii = table.vector("radii", Dimension::length);
    if (table.has("radii") && !(p.radii.minCoeff() > 0)) table.error("radii", "has a radius that is not above zero", "give three, [a, b, c]");
    const auto e = table.quantities("exponents", Dimension::number, std::vector<double>{1, 1});
    if (e.size() != 2) return table.error("exponents", "has " + std::to_string(e.size()) + " values", "expected two, [e1, e2]");
    for (const double value : e)
        if (!(value > 0 && value <= 2))
            table.error("exponents", "has " + to_text(value) + ", outside (0, 2]", "0.1 is nearly a box, 1 an ellipsoid, 2 an octahedron");
    p.exponents = {e[0], e[1]};
}

void read_source(const ConfigTable& table, const std::filesystem::path& folder, const std::filesystem::path& grains, Population& p)
{
    static const std::array<std::string, 5> shapes{"sphere", "level-set", "sh", "polyhedron", "superellipsoid"};
    const std::string shape = table.choice("shape", shapes, "sphere");
    for (const ShapeKind kind : {ShapeKind::level_set, ShapeKind::sh, ShapeKind::polyhedron, ShapeKind::superellipsoid})
        if (shape == to_string(kind)) p.shape = kind;
    p.location = table.location(table.has("file") ? "file" : "shape");
    if (p.shape == ShapeKind::polyhedron) return read_polyhedra(table, folder, p);
    if (p.shape == ShapeKind::superellipsoid) return read_superellipsoid(table, p);
    std::string file = table.string("file", "");
    if (p.shape == ShapeKind::sphere) {
        for (const char* key : {"file", "grains"})
            if (table.has(key)) table.error(key, "spheres take no " + std::string(key), "remove it, or set shape = \"level-set\"");
        return;
    }
    if (p.shape == ShapeKind::level_set && !grains.empty()) file = std::filesystem::absolute(grains).string();
    if (file.empty())
        table.error("file", "is missing", p.shape == ShapeKind::sh ? "write file = \"grains.sh.h5\"" : "write file = \"grains.vdb\"");
    p.file = std::filesystem::path(file).is_absolute() ? std::filesystem::path(file) : folder / file;
    if (!file.empty() && !std::filesystem::exists(p.file))
        table.error("file", "'" + p.file.string() + "' does not exist", "paths are relative to the folder of this file");
    if (table.is_array("grains")) {
        p.grains = table.integers("grains");
        if (p.grains.empty()) table.error("grains", "is an empty list", "write \"all\" or at least one id");
    } else if (table.string("grains", "all") != "all") {
        table.error("grains", "must be \"all\" or a list of ids");
    }
}

Population read_population(const ConfigTable& table, const std::filesystem::path& folder, const std::filesystem::path& grains, std::size_t number)
{
    static const std::array<std::string, 2> roles{"coarse", "fine"};
    Population p;
    p.role = table.choice("role", roles) == "fine" ? Role::fine : Role::coarse;
    p.name = table.string("name", std::string(to_string(p.role)) + std::to_string(number + 1));
    read_source(table, folder, grains, p);
    read_diameters(table, p);
    if (table.has("count")) p.count = table.integer("count");
    if (table.has("mass_fraction")) p.mass_fraction = table.quantity("mass_fraction", Dimension::number);
    if (p.count.has_value() == p.mass_fraction.has_value())
        table.error("count", "give either count or mass_fraction", p.count ? "remove one" : "add one of them");
    if (p.count && *p.count <= 0) table.error("count", "must be at least 1, is " + std::to_string(*p.count));
    if (p.mass_fraction) require_share(table, "mass_fraction", *p.mass_fraction, false);
    p.material = table.string("material", "default");
    p.surface_nodes = static_cast<int>(table.integer("surface_nodes", p.shape == ShapeKind::level_set ? 6000 : 2500));
    if (p.surface_nodes < 100) table.error("surface_nodes", "must be at least 100");
    p.grid_spacing = table.quantity("grid_spacing", Dimension::length, 0.0);
    if (p.grid_spacing < 0) table.error("grid_spacing", "is negative");
    return p;
}

/// Reads a number over its default; `sign` says what it must not be.
enum class Sign { positive, not_negative };
void read_over(const ConfigTable& table, const char* key, Dimension dimension, Sign sign, double& value)
{
    const double given = table.quantity(key, dimension, value);
    if (sign == Sign::positive) require_positive(table, key, given);
    else if (table.has(key) && given < 0) table.error(key, "is negative");
    value = given;
}

Dropping read_dropping(const ConfigTable& table)
{
    Dropping d;
    d.layers = static_cast<int>(table.integer("layers", d.layers));
    if (d.layers < 0) table.error("layers", "is negative");
    read_over(table, "drop_height", Dimension::length, Sign::not_negative, d.drop_height);
    read_over(table, "friction", Dimension::number, Sign::not_negative, d.friction);
    read_over(table, "drag", Dimension::number, Sign::not_negative, d.drag);
    d.damping = table.quantity("damping", Dimension::number, d.damping);
    require_share(table, "damping", d.damping, true);
    d.stiffness_factor = table.quantity("stiffness_factor", Dimension::number, d.stiffness_factor);
    if (!(d.stiffness_factor > 0 && d.stiffness_factor <= 1))
        table.error("stiffness_factor", "must be greater than 0 and at most 1, is " + to_text(d.stiffness_factor));
    read_over(table, "unbalanced_ratio", Dimension::number, Sign::positive, d.unbalanced_ratio);
    read_over(table, "speed_ratio", Dimension::number, Sign::positive, d.speed_ratio);
    read_over(table, "time_limit", Dimension::time, Sign::positive, d.time_limit);
    return d;
}

/// Which walls close in, by default all that can.
MovingWalls read_walls(const ConfigTable& table, const Spec& spec)
{
    static const std::array<std::string, 3> names{"all", "platens", "top"};
    const bool sides = !spec.cylinder && !(spec.period.x() > 0 && spec.period.y() > 0);
    const std::string walls = table.choice("walls", names, sides ? "all" : "platens");
    if (walls == "all" && !sides)
        table.error("walls", std::string("is \"all\", and the side of ") + (spec.cylinder ? "a cylinder does not move" : "a periodic box has no walls"), "write \"platens\" (top and base) or \"top\"");
    return walls == "all" ? MovingWalls::all : walls == "top" ? MovingWalls::top : MovingWalls::platens;
}

Compression read_compression(const ConfigTable& table, const Spec& spec)
{
    Compression c;
    if (table.has("pressure") && table.has("void_ratio"))
        table.error("void_ratio", "pressure and void_ratio are both given", "keep one of them");
    if (table.has("pressure")) {
        c.target = CompressionTarget::pressure;
        read_over(table, "pressure", Dimension::pressure, Sign::positive, c.pressure);
    } else if (table.has("void_ratio")) {
        c.target = CompressionTarget::void_ratio;
        read_over(table, "void_ratio", Dimension::number, Sign::positive, c.void_ratio);
    }
    c.walls = read_walls(table, spec);
    read_over(table, "friction", Dimension::number, Sign::not_negative, c.friction);
    read_over(table, "max_velocity", Dimension::velocity, Sign::positive, c.max_velocity);
    read_over(table, "tolerance", Dimension::number, Sign::positive, c.tolerance);
    read_over(table, "unbalanced_ratio", Dimension::number, Sign::positive, c.unbalanced_ratio);
    read_over(table, "kinetic_ratio", Dimension::number, Sign::positive, c.kinetic_ratio);
    read_over(table, "time_limit", Dimension::time, Sign::positive, c.time_limit);
    read_over(table, "relaxation_limit", Dimension::time, Sign::positive, c.relaxation_limit);
    read_over(table, "drag", Dimension::number, Sign::not_negative, c.drag);
    return c;
}

/// Sides of the box where it repeats itself.
void read_periodic(const ConfigTable& box, Spec& spec)
{
    for (const std::string& side : box.strings("periodic", std::vector<std::string>{})) {
        if (side != "x" && side != "y")
            box.error("periodic", "has '" + side + "'", side == "z" ? "grains fall along z and platens press on it: take x, y or both" : "write [\"x\", \"y\"] or one of them");
        else spec.period[side == "x" ? 0 : 1] = spec.size[side == "x" ? 0 : 1];
    }
}

/// [box] or [cylinder].
void read_enclosure(const ConfigTable& root, Spec& spec)
{
    spec.cylinder = root.has("cylinder");
    if (spec.cylinder) {
        const ConfigTable cylinder = root.table("cylinder");
        if (root.has("box")) {
            cylinder.error("diameter", "stands beside a [box]", "keep one of them");
            root.table("box").keys();
        }
        double diameter = 0, height = 0;
        for (const auto& [key, value] : {std::pair{"diameter", &diameter}, {"height", &height}}) {
            *value = cylinder.quantity(key, Dimension::length);
            if (cylinder.has(key)) require_positive(cylinder, key, *value);
        }
        spec.size = {diameter, diameter, height};
        spec.box_key = "cylinder.diameter";
        spec.box_location = cylinder.location("diameter");
        return;
    }
    const ConfigTable box = root.table("box");
    spec.size = box.vector("size", Dimension::length);
    spec.box_key = "box.size";
    spec.box_location = box.location("size");
    if (box.has("size") && !(spec.size.minCoeff() > 0)) box.error("size", "every edge must be greater than zero");
    read_periodic(box, spec);
}

std::optional<DensityLimits> read_density(const ConfigTable& table)
{
    if (!table.has("e_min") && !table.has("e_max")) return {};
    const DensityLimits limits{table.quantity("e_min", Dimension::number), table.quantity("e_max", Dimension::number)};
    if (!table.has("e_min") || !table.has("e_max")) return {};
    require_positive(table, "e_min", limits.e_min);
    if (!(limits.e_max > limits.e_min))
        table.error("e_max", "is " + to_text(limits.e_max) + ", not above e_min of " + to_text(limits.e_min), "e_max is the void ratio of the loosest state");
    return limits;
}

void check_together(const std::vector<ConfigTable>& tables, const ConfigTable& root, Spec& spec)
{
    std::vector<std::string> names;
    for (const Material& m : spec.materials) names.push_back(m.name);
    double fractions = 0;
    bool counted = false, fine = false, coarse = false;
    for (std::size_t i = 0; i < spec.populations.size(); ++i) {
        const Population& p = spec.populations[i];
        (p.role == Role::fine ? fine : coarse) = true;
        counted = counted || p.count.has_value();
        fractions += p.mass_fraction.value_or(0);
        if (std::find(names.begin(), names.end(), p.material) == names.end())
            tables[i].error("material", "there is no [material." + p.material + "]" + did_you_mean(p.material, names));
        const double edge = spec.size.minCoeff();
        if (p.largest >= edge && edge > 0)
            tables[i].error(tables[i].has("psd") ? "psd" : tables[i].has("diameters") ? "diameters" : "diameter", "grains of " + format_quantity(p.largest, Dimension::length) + std::string(spec.cylinder ? " do not fit a cylinder of " : " do not fit a box of ") +
                                            format_quantity(edge, Dimension::length), "enlarge [" + spec.box_key.substr(0, spec.box_key.find('.')) + "]");
    }
    if (spec.populations.empty()) {
        root.error("population", "there is no [[population]]", "add at least one");
    } else if (!counted) {
        tables.front().error("count", "every population has a mass_fraction, so the number of grains is open", "give one a count");
    } else if (fractions >= 1) {
        tables.back().error("mass_fraction", "the fractions add up to " + to_text(fractions), "leave mass for the counted populations");
    }
    if (!fine && !spec.populations.empty()) spec.warnings.push_back("no population has role \"fine\": nothing can be eroded from this sample");
    if (!coarse && !spec.populations.empty()) spec.warnings.push_back("no population has role \"coarse\": the sample has no skeleton");
}

}  // namespace

double base_area(const Spec& spec) { return (spec.cylinder ? std::numbers::pi / 4 : 1.0) * spec.size.x() * spec.size.y(); }

Spec read_spec(const std::filesystem::path& file, const std::filesystem::path& grains)
{
    const Config config = Config::from_file(file);
    const ConfigTable root = config.root();
    Spec spec;
    spec.text = read_text_file(file);
    read_enclosure(root, spec);
    const ConfigTable materials = root.table("material");
    for (const std::string& name : materials.keys()) spec.materials.push_back(read_material(materials.table(name), name));
    if (spec.materials.empty()) spec.materials.push_back({});
    const auto tables = root.tables("population");
    for (std::size_t i = 0; i < tables.size(); ++i)
        spec.populations.push_back(read_population(tables[i], file.parent_path(), grains, i));
    spec.dropping = read_dropping(root.table("dropping"));
    spec.compression = read_compression(root.table("compression"), spec);
    spec.density = read_density(root.table("density"));
    spec.gravity = root.table("gravity").vector("vector", Dimension::acceleration, spec.gravity);
    if (!(spec.gravity.z() < 0)) root.table("gravity").error("vector", "grains are dropped along -z, so z must be negative");
    const ConfigTable time = root.table("time");
    if (!time.is_string("dem_step") || time.string("dem_step", "auto") != "auto") {
        spec.dem_step = time.quantity("dem_step", Dimension::time, 0.0);
        if (time.has("dem_step")) require_positive(time, "dem_step", spec.dem_step);
    }
    spec.sphere_scheme = dem::sphere_scheme_of(root.table("contact").choice("spheres", dem::sphere_scheme_words, "automatic"));
    spec.force_step = time.boolean("force_step", false);
    spec.step_location = time.location("dem_step");
    check_together(tables, root, spec);
    config.finish();
    return spec;
}

void scale_grains(Spec& spec, double factor)
{
    bool any = false;
    for (Population& p : spec.populations) {
        if (!p.own_size) continue;
        p.scale *= factor;
        any = true;
    }
    if (!any) throw UsageError("--scale", "every population of the specification has diameters of its own", "remove --scale, or the diameters of a population");
}

}  // namespace coral::pack
