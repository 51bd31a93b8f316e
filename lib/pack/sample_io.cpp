#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "core/error.h"
#include "core/formats.h"
#include "core/hdf5.h"
#include "pack/sample.h"

namespace coral::pack {
namespace {

constexpr const char* content = "coralsand sample";

/// Members of Statistics under their names in the file.
struct Figure {
    const char* name;
    double Statistics::*value;
};
constexpr std::array figures{
    Figure{"porosity", &Statistics::porosity},
    Figure{"interparticle_porosity", &Statistics::interparticle_porosity},
    Figure{"void_ratio", &Statistics::void_ratio},
    Figure{"interparticle_void_ratio", &Statistics::interparticle_void_ratio},
    Figure{"fines_content", &Statistics::fines_content},
    Figure{"gap_ratio", &Statistics::gap_ratio},
    Figure{"coordination", &Statistics::coordination},
    Figure{"coordination_coarse_coarse", &Statistics::coordination_coarse_coarse},
    Figure{"coordination_coarse_fine", &Statistics::coordination_coarse_fine},
    Figure{"coordination_fine_coarse", &Statistics::coordination_fine_coarse},
    Figure{"coordination_fine_fine", &Statistics::coordination_fine_fine},
    Figure{"rattler_fraction", &Statistics::rattler_fraction},
    Figure{"kinetic_ratio", &Statistics::kinetic_ratio},
    Figure{"kinetic_energy", &Statistics::kinetic_energy},
    Figure{"unbalanced_ratio", &Statistics::unbalanced_ratio},
    Figure{"mean_pressure", &Statistics::mean_pressure},
    Figure{"max_overlap", &Statistics::max_overlap},
    Figure{"max_wall_overlap", &Statistics::max_wall_overlap},
    Figure{"dem_steps", &Statistics::dem_steps},
    Figure{"dem_step", &Statistics::dem_step},
};

/// Column of numbers taken from every item of a list.
template <class T, class Items, class Get>
std::vector<T> column(const Items& items, const Get& get)
{
    std::vector<T> values;
    values.reserve(items.size());
    for (const auto& item : items) values.push_back(static_cast<T>(get(item)));
    return values;
}

/// Rows of three (or four) numbers taken from every item, one after the other.
template <class Items, class Get>
std::vector<double> rows(const Items& items, const Get& get)
{
    std::vector<double> values;
    for (const auto& item : items) {
        const auto row = get(item);
        values.insert(values.end(), row.data(), row.data() + row.size());
    }
    return values;
}

void write_column(H5File& file, const std::string& path, const std::vector<double>& values) { file.write(path, values, {values.size()}); }
void write_column(H5File& file, const std::string& path, const std::vector<std::int32_t>& values) { file.write(path, values, {values.size()}); }
void write_rows(H5File& file, const std::string& path, const std::vector<double>& values) { file.write(path, values, {values.size() / 3, 3}); }

void write_grid(H5File& file, const std::string& path, const sdf::DistanceGrid& grid)
{
    const auto n = grid.size.cast<std::size_t>();
    file.write(path, std::span<const float>(grid.distance), {n.z(), n.y(), n.x()});
    file.set_attribute(path, "origin", std::span<const double>(grid.origin.data(), 3));
    file.set_attribute(path, "spacing", grid.spacing);
    file.set_attribute(path, "outside_limit", grid.outside_limit);
    file.set_attribute(path, "inside_limit", grid.inside_limit);
}

void write_shape(H5File& file, const std::string& group, const ShapeTemplate& shape)
{
    file.make_group(group);
    file.set_attribute(group, "kind", std::string(to_string(shape.kind)));
    file.set_attribute(group, "name", shape.name);
    file.set_attribute(group, "volume", shape.volume);
    file.set_attribute(group, "apparent_volume", shape.apparent_volume);
    file.set_attribute(group, "equivalent_diameter", shape.equivalent_diameter);
    file.set_attribute(group, "inertia", std::span<const double>(shape.inertia.data(), 9));
    if (shape.kind == ShapeKind::sphere) return;
    if (shape.kind == ShapeKind::polyhedron) write_rows(file, group + "/vertices", rows(shape.vertices, [](const auto& v) { return v; }));
    else write_grid(file, group + "/distance", *shape.grid);
    if (shape.apparent_grid) write_grid(file, group + "/apparent_distance", *shape.apparent_grid);
    write_rows(file, group + "/nodes", rows(shape.nodes, [](const auto& n) { return n; }));
    write_column(file, group + "/node_areas", shape.node_areas);
    if (shape.kind == ShapeKind::superellipsoid) {
        file.set_attribute(group, "radii", std::span<const double>(shape.radii.data(), 3));
        file.set_attribute(group, "exponents", std::span<const double>(shape.exponents.data(), 2));
    }
    if (shape.kind != ShapeKind::sh) return;
    write_column(file, group + "/coefficients", shape.coefficients);
    file.set_attribute(group, "degree", std::int64_t(shape.degree));
    file.set_attribute(group, "centre", std::span<const double>(shape.centre.data(), 3));
}

void write_particles(H5File& file, const std::vector<Particle>& particles)
{
    write_rows(file, "/particles/position", rows(particles, [](const Particle& p) { return p.position; }));
    write_rows(file, "/particles/velocity", rows(particles, [](const Particle& p) { return p.velocity; }));
    write_rows(file, "/particles/angular_velocity", rows(particles, [](const Particle& p) { return p.angular_velocity; }));
    file.write("/particles/orientation", rows(particles, [](const Particle& p) {
                   const auto& q = p.orientation;
                   return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
               }), {particles.size(), 4});
    write_column(file, "/particles/shape", column<std::int32_t>(particles, [](const Particle& p) { return p.shape; }));
    write_column(file, "/particles/scale", column<double>(particles, [](const Particle& p) { return p.scale; }));
    write_column(file, "/particles/material", column<std::int32_t>(particles, [](const Particle& p) { return p.material; }));
    file.write("/particles/role", column<std::string>(particles, [](const Particle& p) { return to_string(p.role); }));
}

void write_contacts(H5File& file, const std::vector<Contact>& contacts, const std::vector<ContactSpring>& springs)
{
    write_column(file, "/contacts/first", column<std::int32_t>(contacts, [](const Contact& c) { return c.first; }));
    write_column(file, "/contacts/second", column<std::int32_t>(contacts, [](const Contact& c) { return c.second; }));
    write_column(file, "/contacts/points", column<std::int32_t>(contacts, [](const Contact& c) { return c.points; }));
    write_column(file, "/contacts/overlap", column<double>(contacts, [](const Contact& c) { return c.overlap; }));
    write_rows(file, "/contacts/point", rows(contacts, [](const Contact& c) { return c.point; }));
    write_rows(file, "/contacts/normal", rows(contacts, [](const Contact& c) { return c.normal; }));
    write_rows(file, "/contacts/normal_force", rows(contacts, [](const Contact& c) { return c.normal_force; }));
    write_rows(file, "/contacts/tangential_force", rows(contacts, [](const Contact& c) { return c.tangential_force; }));
    write_column(file, "/contacts/springs/first", column<std::int32_t>(springs, [](const ContactSpring& s) { return s.first; }));
    write_column(file, "/contacts/springs/second", column<std::int32_t>(springs, [](const ContactSpring& s) { return s.second; }));
    write_column(file, "/contacts/springs/node", column<std::int32_t>(springs, [](const ContactSpring& s) { return s.node; }));
    write_rows(file, "/contacts/springs/spring", rows(springs, [](const ContactSpring& s) { return s.spring; }));
    write_rows(file, "/contacts/springs/normal", rows(springs, [](const ContactSpring& s) { return s.normal; }));
    write_column(file, "/contacts/springs/cornered", column<std::int32_t>(springs, [](const ContactSpring& s) { return s.cornered; }));
}

/// Reads columns that must all have one length, and says which has not.
class Reader {
public:
    explicit Reader(const H5File& file) : file_(file) {}

    [[noreturn]] void fail(const std::string& path, const std::string& what) const
    {
        throw Error(file_.path().string() + ":" + path, what, "make the file again with pack-sample");
    }
    std::vector<double> numbers(const std::string& path, std::size_t count, std::size_t width = 1, bool finite = true) const
    {
        auto values = file_.read_doubles(path);
        expect(path, values.size() / width, count);
        if (values.size() != count * width) fail(path, "does not have rows of " + std::to_string(width));
        for (const double v : values)
            if (finite && !std::isfinite(v)) fail(path, "holds a value that is not a number");
        return values;
    }
    std::vector<std::int64_t> indices(const std::string& path, std::size_t count, std::int64_t lowest, std::int64_t end) const
    {
        auto values = file_.read_integers(path);
        expect(path, values.size(), count);
        for (const auto v : values)
            if (v < lowest || v >= end) fail(path, "index " + std::to_string(v) + " points nowhere");
        return values;
    }
    std::vector<std::string> strings(const std::string& path, std::size_t count) const
    {
        auto values = file_.read_strings(path);
        expect(path, values.size(), count);
        return values;
    }
    std::size_t count(const std::string& path) const
    {
        const auto dims = file_.dims(path);
        return dims.empty() ? 0 : dims[0];
    }
    const H5File& file() const { return file_; }

private:
    void expect(const std::string& path, std::size_t found, std::size_t wanted) const
    {
        if (found != wanted) fail(path, "has " + std::to_string(found) + " entries where " + std::to_string(wanted) + " are expected");
    }
    const H5File& file_;
};

Eigen::Vector3d row3(const std::vector<double>& values, std::size_t i) { return {values[3 * i], values[3 * i + 1], values[3 * i + 2]}; }

std::shared_ptr<const sdf::DistanceGrid> read_grid(const Reader& in, const std::string& path)
{
    auto grid = std::make_shared<sdf::DistanceGrid>();
    const auto dims = in.file().dims(path);
    const auto origin = in.file().numbers_attribute(path, "origin");
    if (dims.size() != 3 || origin.size() != 3) in.fail(path, "is not a lattice [nz, ny, nx] with an origin");
    for (int axis = 0; axis < 3; ++axis) {
        if (dims[std::size_t(2 - axis)] < 2 || dims[std::size_t(2 - axis)] > 100000) in.fail(path, "has an impossible size");
        grid->size[axis] = static_cast<int>(dims[std::size_t(2 - axis)]);
    }
    grid->origin = row3(origin, 0);
    grid->spacing = in.file().number_attribute(path, "spacing");
    grid->outside_limit = in.file().number_attribute(path, "outside_limit");
    grid->inside_limit = in.file().number_attribute(path, "inside_limit");
    if (!(grid->spacing > 0)) in.fail(path, "attribute spacing is not greater than zero");
    grid->distance = in.file().read_floats(path);
    for (const float d : grid->distance)
        if (!std::isfinite(d)) in.fail(path, "holds a distance that is not a number");
    return grid;
}

std::vector<Eigen::Vector3d> read_vertices(const Reader& in, const std::string& group)
{
    const std::string path = group + "/vertices";
    const std::size_t count = in.count(path);
    if (count < 4) in.fail(path, "has " + std::to_string(count) + " vertices, a polyhedron has at least four");
    const auto values = in.numbers(path, count, 3);
    std::vector<Eigen::Vector3d> vertices;
    for (std::size_t i = 0; i < count; ++i) vertices.push_back(row3(values, i));
    return vertices;
}

void read_superellipsoid(const Reader& in, const std::string& group, ShapeTemplate& shape)
{
    const auto radii = in.file().numbers_attribute(group, "radii"), exponents = in.file().numbers_attribute(group, "exponents");
    if (radii.size() != 3 || exponents.size() != 2) in.fail(group, "attributes radii and exponents need three and two numbers");
    shape.radii = row3(radii, 0);
    shape.exponents = {exponents[0], exponents[1]};
}

ShapeTemplate read_shape(const Reader& in, const std::string& group, SampleDetail detail)
{
    const H5File& file = in.file();
    ShapeTemplate shape;
    const std::string kind = file.string_attribute(group, "kind");
    constexpr std::array kinds{ShapeKind::sphere, ShapeKind::level_set, ShapeKind::sh, ShapeKind::polyhedron, ShapeKind::superellipsoid};
    const auto known = std::find_if(kinds.begin(), kinds.end(), [&](ShapeKind k) { return to_string(k) == kind; });
    if (known == kinds.end()) in.fail(group, "kind '" + kind + "' is unknown");
    shape.kind = *known;
    shape.name = file.string_attribute(group, "name");
    shape.volume = file.number_attribute(group, "volume");
    shape.apparent_volume = file.number_attribute(group, "apparent_volume");
    shape.equivalent_diameter = file.number_attribute(group, "equivalent_diameter");
    const auto inertia = file.numbers_attribute(group, "inertia");
    if (inertia.size() != 9) in.fail(group, "attribute inertia does not have nine numbers");
    shape.inertia = Eigen::Map<const Eigen::Matrix3d>(inertia.data());
    if (!(shape.volume > 0) || !(shape.equivalent_diameter > 0)) in.fail(group, "volume and equivalent_diameter must be greater than zero");
    if (shape.kind == ShapeKind::sphere) return shape;
    if (shape.kind == ShapeKind::polyhedron) shape.vertices = read_vertices(in, group);
    else shape.grid = read_grid(in, group + "/distance");
    if (shape.kind == ShapeKind::superellipsoid) read_superellipsoid(in, group, shape);
    if (detail == SampleDetail::all && file.exists(group + "/apparent_distance")) shape.apparent_grid = read_grid(in, group + "/apparent_distance");
    const std::size_t count = in.count(group + "/nodes");
    const auto nodes = in.numbers(group + "/nodes", count, 3);
    for (std::size_t i = 0; i < count; ++i) shape.nodes.push_back(row3(nodes, i));
    shape.node_areas = in.numbers(group + "/node_areas", count);
    if (shape.kind != ShapeKind::sh) return shape;
    shape.degree = static_cast<int>(file.integer_attribute(group, "degree"));
    shape.coefficients = in.numbers(group + "/coefficients", std::size_t(shape.degree + 1) * std::size_t(shape.degree + 1));
    if (file.has_attribute(group, "centre")) {  // samples of before lack it
        const auto centre = file.numbers_attribute(group, "centre");
        if (centre.size() != 3) in.fail(group, "attribute centre needs three numbers");
        shape.centre = row3(centre, 0);
    }
    return shape;
}

void read_particles(const Reader& in, Sample& sample)
{
    const std::size_t n = in.count("/particles/position");
    const auto position = in.numbers("/particles/position", n, 3), velocity = in.numbers("/particles/velocity", n, 3),
               spin = in.numbers("/particles/angular_velocity", n, 3), q = in.numbers("/particles/orientation", n, 4),
               scale = in.numbers("/particles/scale", n);
    const auto shape = in.indices("/particles/shape", n, 0, std::int64_t(sample.shapes.size())),
               material = in.indices("/particles/material", n, 0, std::int64_t(sample.materials.size()));
    const auto role = in.strings("/particles/role", n);
    for (std::size_t i = 0; i < n; ++i) {
        if (role[i] != "coarse" && role[i] != "fine") in.fail("/particles/role", "role '" + role[i] + "' is neither coarse nor fine");
        if (!(scale[i] > 0)) in.fail("/particles/scale", "particle " + std::to_string(i) + " has a scale that is not greater than zero");
        sample.particles.push_back({row3(position, i), Eigen::Quaterniond(q[4 * i], q[4 * i + 1], q[4 * i + 2], q[4 * i + 3]),
                                    row3(velocity, i), row3(spin, i), std::int32_t(shape[i]), scale[i],
                                    role[i] == "fine" ? Role::fine : Role::coarse, std::int32_t(material[i])});
    }
}

void read_contacts(const Reader& in, Sample& sample)
{
    const std::string c = "/contacts/", s = "/contacts/springs/";
    const auto particles = std::int64_t(sample.particles.size()), walls = std::int64_t(sample.walls.size());
    const std::size_t n = in.count(c + "first"), m = in.count(s + "first");
    const auto first = in.indices(c + "first", n, 0, particles), second = in.indices(c + "second", n, -walls, particles),
               points = in.indices(c + "points", n, 0, INT32_MAX);
    const auto overlap = in.numbers(c + "overlap", n), point = in.numbers(c + "point", n, 3), normal = in.numbers(c + "normal", n, 3),
               normal_force = in.numbers(c + "normal_force", n, 3), tangential_force = in.numbers(c + "tangential_force", n, 3);
    for (std::size_t i = 0; i < n; ++i)
        sample.contacts.push_back({int(first[i]), int(second[i]), row3(point, i), row3(normal, i), row3(normal_force, i),
                                   row3(tangential_force, i), overlap[i], int(points[i])});
    const auto a = in.indices(s + "first", m, 0, particles), b = in.indices(s + "second", m, -walls, particles),
               node = in.indices(s + "node", m, INT32_MIN, INT32_MAX);
    const auto spring = in.numbers(s + "spring", m, 3), turned = in.numbers(s + "normal", m, 3);
    const auto cornered = in.file().exists(s + "cornered") ? in.indices(s + "cornered", m, 0, 2) : std::vector<std::int64_t>(m, 0);
    for (std::size_t i = 0; i < m; ++i)
        sample.springs.push_back({int(a[i]), int(b[i]), int(node[i]), row3(spring, i), row3(turned, i), cornered[i] != 0});
}

void write_materials(H5File& file, const std::vector<Material>& materials)
{
    for (std::size_t k = 0; k < materials.size(); ++k) {
        const std::string group = "/materials/" + std::to_string(k);
        file.make_group(group);
        file.set_attribute(group, "name", materials[k].name);
        file.set_attribute(group, "density", materials[k].density);
        file.set_attribute(group, "normal_stiffness", materials[k].normal_stiffness);
        file.set_attribute(group, "tangential_stiffness", materials[k].tangential_stiffness);
        file.set_attribute(group, "friction", materials[k].friction);
        file.set_attribute(group, "damping", materials[k].damping);
    }
}

void read_materials(const H5File& file, Sample& sample)
{
    for (const std::string& k : file.members("/materials")) {
        const std::string group = "/materials/" + k;
        sample.materials.push_back({file.string_attribute(group, "name"), file.number_attribute(group, "density"),
                                    file.number_attribute(group, "normal_stiffness"), file.number_attribute(group, "tangential_stiffness"),
                                    file.number_attribute(group, "friction"), file.number_attribute(group, "damping")});
    }
}

void read_walls(const Reader& in, Sample& sample)
{
    const std::size_t n = in.count("/walls/name");
    const auto name = in.strings("/walls/name", n);
    const auto point = in.numbers("/walls/point", n, 3), normal = in.numbers("/walls/normal", n, 3),
               friction = in.numbers("/walls/friction", n), pressure = in.numbers("/walls/pressure", n);
    const auto radius = in.file().exists("/walls/radius") ? in.numbers("/walls/radius", n) : std::vector<double>(n, 0.0);
    for (std::size_t i = 0; i < n; ++i) sample.walls.push_back({name[i], row3(point, i), row3(normal, i), friction[i], pressure[i], radius[i]});
}

void check_indices(const Sample& sample, const std::filesystem::path& file)
{
    const int n = int(sample.particles.size()), walls = int(sample.walls.size());
    const auto check = [&](bool good, const char* what) {
        if (!good) throw Error(file.string(), std::string("the sample has ") + what + " that points nowhere");
    };
    for (const Particle& p : sample.particles) {
        check(p.shape >= 0 && std::size_t(p.shape) < sample.shapes.size(), "a particle's shape");
        check(p.material >= 0 && std::size_t(p.material) < sample.materials.size(), "a particle's material");
    }
    for (const Contact& c : sample.contacts) check(c.first >= 0 && c.first < n && c.second >= -walls && c.second < n, "a contact");
    for (const ContactSpring& s : sample.springs) check(s.first >= 0 && s.first < n && s.second >= -walls && s.second < n, "a spring");
    for (const ShapeTemplate& s : sample.shapes) check(s.kind == ShapeKind::sphere || s.grid || !s.vertices.empty(), "a shape's lattice or vertices");
}

}  // namespace

void write_sample(const Sample& sample, const std::filesystem::path& path)
{
    check_indices(sample, path);
    H5File file = H5File::create(path);
    file.set_attribute("/", "content", content);
    const bool periodic = !sample.period.isZero(0);
    file.set_format(periodic || cylinder(sample) ? file_format::sample : 1);
    file.set_attribute("/", "size", std::span<const double>(sample.size.data(), 3));
    file.set_attribute("/", "gravity", std::span<const double>(sample.gravity.data(), 3));
    for (std::size_t k = 0; k < sample.shapes.size(); ++k) write_shape(file, "/shapes/" + std::to_string(k), sample.shapes[k]);
    write_materials(file, sample.materials);
    write_particles(file, sample.particles);
    file.write("/walls/name", column<std::string>(sample.walls, [](const Wall& w) { return w.name; }));
    write_rows(file, "/walls/point", rows(sample.walls, [](const Wall& w) { return w.point; }));
    write_rows(file, "/walls/normal", rows(sample.walls, [](const Wall& w) { return w.normal; }));
    write_column(file, "/walls/friction", column<double>(sample.walls, [](const Wall& w) { return w.friction; }));
    write_column(file, "/walls/pressure", column<double>(sample.walls, [](const Wall& w) { return w.pressure; }));
    if (periodic) file.set_attribute("/", "period", std::span<const double>(sample.period.data(), 3));
    if (cylinder(sample)) write_column(file, "/walls/radius", column<double>(sample.walls, [](const Wall& w) { return w.radius; }));
    write_contacts(file, sample.contacts, sample.springs);
    write_column(file, "/psd/size", column<double>(sample.psd, [](const PsdPoint& p) { return p.size; }));
    write_column(file, "/psd/passing", column<double>(sample.psd, [](const PsdPoint& p) { return p.passing; }));
    file.write("/criteria/name", column<std::string>(sample.criteria, [](const Criterion& c) { return c.name; }));
    write_column(file, "/criteria/value", column<double>(sample.criteria, [](const Criterion& c) { return c.value; }));
    write_column(file, "/criteria/threshold", column<double>(sample.criteria, [](const Criterion& c) { return c.threshold; }));
    file.write("/criteria/verdict", column<std::string>(sample.criteria, [](const Criterion& c) { return c.verdict; }));
    file.write("/criteria/definition", column<std::string>(sample.criteria, [](const Criterion& c) { return c.definition; }));
    file.make_group("/statistics");
    for (const Figure& f : figures) file.set_attribute("/statistics", f.name, sample.statistics.*f.value);
    file.write("/history", std::vector<std::string>{to_json(sample.history)});
    file.commit();
}

Sample read_sample(const std::filesystem::path& path, SampleDetail detail)
{
    const H5File file = H5File::open(path);
    const Reader in(file);
    file.require_format(file_format::sample);
    if (!file.has_attribute("/", "content") && !file.exists("/particles")) in.fail("/", "is not a sample, which pack-sample and swap-shapes write");
    const char* name = file.has_attribute("/", "content") ? "content" : "format";  // the first files had it as a text in `format`
    if (!file.has_attribute("/", name) || file.string_attribute("/", name) != content) in.fail("/", "is not a sample (attribute content is not '" + std::string(content) + "')");
    Sample sample;
    const auto size = file.numbers_attribute("/", "size"), gravity = file.numbers_attribute("/", "gravity");
    if (size.size() != 3 || gravity.size() != 3) in.fail("/", "attributes size and gravity need three numbers");
    sample.size = row3(size, 0);
    sample.gravity = row3(gravity, 0);
    if (file.has_attribute("/", "period")) {
        const auto period = file.numbers_attribute("/", "period");
        if (period.size() != 3 || !(*std::min_element(period.begin(), period.end()) >= 0)) in.fail("/", "attribute period needs three lengths");
        sample.period = row3(period, 0);
    }
    for (const std::string& k : file.members("/shapes")) sample.shapes.push_back(read_shape(in, "/shapes/" + k, detail));
    read_materials(file, sample);
    read_particles(in, sample);
    read_walls(in, sample);
    read_contacts(in, sample);
    const std::size_t n = in.count("/psd/size"), m = in.count("/criteria/name");
    const auto sizes = in.numbers("/psd/size", n), passing = in.numbers("/psd/passing", n);
    for (std::size_t i = 0; i < n; ++i) sample.psd.push_back({sizes[i], passing[i]});
    const auto criterion = in.strings("/criteria/name", m), verdict = in.strings("/criteria/verdict", m),
               definition = in.strings("/criteria/definition", m);
    const auto value = in.numbers("/criteria/value", m, 1, false), threshold = in.numbers("/criteria/threshold", m);
    for (std::size_t i = 0; i < m; ++i) sample.criteria.push_back({criterion[i], value[i], threshold[i], verdict[i], definition[i]});
    for (const Figure& f : figures) sample.statistics.*f.value = file.number_attribute("/statistics", f.name);
    const auto history = file.read_strings("/history");
    if (history.size() != 1) in.fail("/history", "is not one text");
    sample.history = history_from_json(history[0], path.string() + ":/history");
    return sample;
}

}  // namespace coral::pack
