#include "pack/populations.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <random>

#include "core/error.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/units.h"
#include "dem/polyhedron.h"
#include "dem/superellipsoid.h"
#include "pack/criteria.h"
#include "pack/detail/random.h"
#include "sdf/extend.h"
#include "sdf/mass_properties.h"
#include "sdf/surface_nodes.h"
#include "sdf/vdb_io.h"
#include "sh/shape_file.h"
#include "sh/tabulate.h"

namespace coral::pack {
namespace {

using detail::Random;
using detail::uniform;

/// What a file tells about its grains before any is loaded.
struct Source {
    std::vector<std::int64_t> ids;
    std::map<std::int64_t, double> diameter, volume;  ///< equivalent diameter [m] and solid volume [m3] at the size of the file
    History history;
};

dem::Superellipsoid superellipsoid(const Population& p) { return {p.radii, p.exponents[0], p.exponents[1]}; }

Source read_source(const Population& p)
{
    Source source;
    if (p.shape == ShapeKind::level_set) {
        const sdf::GrainReader reader(p.file);
        source.history = reader.history();
        for (const int id : reader.ids()) {
            if (!p.grains.empty() && std::find(p.grains.begin(), p.grains.end(), id) == p.grains.end()) continue;
            const sdf::GrainLevelSet grain = reader.read(id);
            source.ids.push_back(id);
            source.diameter[id] = grain.equivalent_diameter;
            source.volume[id] = grain.volume;
        }
    } else if (p.shape == ShapeKind::polyhedron) {
        for (std::size_t i = 0; i < p.polyhedra.size(); ++i) {
            source.ids.push_back(std::int64_t(i));
            source.volume[std::int64_t(i)] = dem::Polyhedron(p.polyhedra[i].points, p.polyhedra[i].name).volume();
        }
    } else if (p.shape == ShapeKind::superellipsoid) {
        source.ids = {0};
        source.volume[0] = dem::volume(superellipsoid(p));
    } else {
        const sh::ShapeFile file = sh::read_shapes(p.file);
        source.history = file.history;
        for (const sh::ShapeRecord& s : file.shapes) {
            source.ids.push_back(s.id);
            source.volume[s.id] = s.volume;
        }
    }
    for (const auto& [id, volume] : source.volume) source.diameter.try_emplace(id, std::cbrt(6 * volume / std::numbers::pi));
    for (const std::int64_t id : p.grains)
        if (!source.volume.contains(id)) throw UsageError(p.location, "population '" + p.name + "' asks for grain " + std::to_string(id) + ", which " + p.file.filename().string() + " does not have", "write grains = \"all\" or ids of the file's table");
    if (!p.grains.empty()) source.ids = p.grains;
    if (source.ids.empty()) throw Error(p.file.string(), "has no grains", "make it again with csct2ls");
    for (const std::int64_t id : source.ids)
        if (!(source.volume.at(id) > 0 && source.diameter.at(id) > 0))
            throw UsageError(p.location, "grain " + std::to_string(id) + " of " + p.file.filename().string() + " has no volume", "leave it out of grains, or make the file again");
    return source;
}

/// Draws the grains of one population one after the other.
class Drawer {
public:
    Drawer(const Population& population, double density, Random& random) : p_(population), density_(density), random_(random)
    {
        if (p_.shape != ShapeKind::sphere) source_ = read_source(p_);
    }

    struct Grain {
        std::int64_t id;
        double diameter, mass;
    };
    Grain next()
    {
        if (p_.shape == ShapeKind::sphere) {
            const double d = diameter();
            return {0, d, density_ * std::numbers::pi / 6 * d * d * d};
        }
        if (deck_.empty()) {
            deck_ = source_.ids;
            for (std::size_t i = deck_.size() - 1; i > 0; --i) std::swap(deck_[i], deck_[std::size_t(uniform(random_) * double(i + 1))]);
        }
        const std::int64_t id = deck_.back();
        deck_.pop_back();
        const double own = source_.diameter.at(id), d = p_.own_size ? p_.scale * own : diameter();
        return {id, d, density_ * source_.volume.at(id) * std::pow(d / own, 3)};
    }
    const Source& source() const { return source_; }

private:
    double diameter()
    {
        if (p_.gradation == Gradation::single) return p_.smallest;
        if (p_.gradation == Gradation::uniform) return p_.smallest + (p_.largest - p_.smallest) * uniform(random_);
        // the table is by mass: a size drawn by mass is kept with the number of grains that share the mass, that is with 1/d^3
        for (;;) {
            const double d = size_at(p_.psd, uniform(random_));
            if (uniform(random_) < std::pow(p_.smallest / d, 3)) return d;
        }
    }
    const Population& p_;
    double density_;
    Random& random_;
    Source source_;
    std::vector<std::int64_t> deck_;
};

using Drawn = std::vector<Drawer::Grain>;

double total_mass(const Drawn& grains)
{
    double sum = 0;
    for (const auto& g : grains) sum += g.mass;
    return sum;
}

Drawn draw_mass(Drawer& drawer, double target, const Population& p)
{
    Drawn grains;
    double sum = 0;
    while (sum < target) {
        if (grains.size() > 5'000'000) throw UsageError(p.location, "the mass fraction of population '" + p.name + "' takes more than five million grains", "enlarge its diameters");
        grains.push_back(drawer.next());
        sum += grains.back().mass;
    }
    if (grains.size() > 1 && sum - target > 0.5 * grains.back().mass) grains.pop_back();
    return grains;
}

std::vector<Drawn> draw_all(const Spec& spec, std::vector<Drawer>& drawers)
{
    std::vector<Drawn> drawn(spec.populations.size());
    double counted = 0, fractions = 0;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
        const Population& p = spec.populations[i];
        fractions += p.mass_fraction.value_or(0);
        for (std::int64_t n = 0; n < p.count.value_or(0); ++n) drawn[i].push_back(drawers[i].next());
        counted += total_mass(drawn[i]);
    }
    for (std::size_t i = 0; i < drawn.size(); ++i)
        if (const auto share = spec.populations[i].mass_fraction)
            drawn[i] = draw_mass(drawers[i], *share * counted / (1 - fractions), spec.populations[i]);
    return drawn;
}

int material_index(const Spec& spec, const std::string& name)
{
    for (std::size_t i = 0; i < spec.materials.size(); ++i)
        if (spec.materials[i].name == name) return int(i);
    return 0;
}

/// Steps of several files, each kept once (populations often share a file).
void join_history(History& all, const History& more)
{
    const std::string text = to_json(more);
    if (to_json(all).find(text.substr(1, text.size() - 2)) == std::string::npos) all.insert(all.end(), more.begin(), more.end());
}

void check_room(const Spec& spec, const Grains& grains)
{
    double apparent = 0;
    for (const Particle& p : grains.sample.particles) apparent += apparent_volume(grains.sample, p);
    const double box = base_area(spec) * spec.size.z();
    if (apparent > 0.74 * box)
        throw UsageError(spec.box_location, "key '" + spec.box_key + "': the grains fill " + std::to_string(int(100 * apparent / box)) + " % of the " + (spec.cylinder ? "cylinder" : "box") + ", no packing holds more than 74 %",
                         "enlarge the box or take fewer grains");
    for (std::size_t i = 0; i < grains.sample.particles.size(); ++i) {
        const Particle& p = grains.sample.particles[i];
        const double d = equivalent_diameter(grains.sample, p), base = spec.size.head<2>().minCoeff();
        const Population& of = spec.populations[std::size_t(grains.population[i])];
        if (d >= base) throw UsageError(of.location, "a grain of population '" + of.name + "', " + format_quantity(d, Dimension::length) + ", does not fit the base of the box, " + format_quantity(base, Dimension::length), "enlarge [box] size or [cylinder] diameter");
    }
}

/// Whether there is solid, and none of it at the outermost nodes.
bool surface_is_closed(const sdf::DistanceGrid& g)
{
    bool solid = false;
    for (int k = 0; k < g.size.z(); ++k)
        for (int j = 0; j < g.size.y(); ++j)
            for (int i = 0; i < g.size.x(); ++i) {
                if (!(g.distance[g.index(i, j, k)] <= 0)) continue;
                solid = true;
                if (i == 0 || j == 0 || k == 0 || i + 1 == g.size.x() || j + 1 == g.size.y() || k + 1 == g.size.z()) return false;
            }
    return solid;
}

ShapeTemplate polyhedron_template(const Corners& corners, int nodes)
{
    const dem::Polyhedron body(corners.points, corners.name);
    ShapeTemplate shape;
    shape.kind = ShapeKind::polyhedron;
    shape.name = corners.name;
    shape.vertices.assign(body.vertices().begin(), body.vertices().end());
    shape.volume = shape.apparent_volume = body.volume();
    shape.equivalent_diameter = std::cbrt(6 * body.volume() / std::numbers::pi);
    shape.inertia = body.inertia();
    dem::SurfaceNodes surface = dem::polyhedron_nodes(body, nodes);
    shape.nodes = std::move(surface.positions);
    shape.node_areas = std::move(surface.areas);
    return shape;
}

ShapeTemplate superellipsoid_template(const Population& p, double reach)
{
    const auto body = dem::superellipsoid_shape(superellipsoid(p), reach, "superellipsoid", p.surface_nodes, p.grid_spacing);
    ShapeTemplate shape;
    shape.kind = ShapeKind::superellipsoid;
    shape.name = body->name();
    shape.radii = p.radii;
    shape.exponents = p.exponents;
    shape.volume = shape.apparent_volume = body->volume();
    shape.equivalent_diameter = 2 * body->equivalent_radius();
    shape.inertia = body->inertia();
    shape.grid = std::make_shared<const sdf::DistanceGrid>(body->distance_grid());
    shape.nodes.assign(body->nodes().begin(), body->nodes().end());
    shape.node_areas.assign(body->node_areas().begin(), body->node_areas().end());
    return shape;
}

}  // namespace

ShapeTemplate load_shape(const Population& p, std::int64_t id, double reach)
{
    const auto closed = [&](const sdf::DistanceGrid& grid, const char* what) {
        if (!surface_is_closed(grid))
            throw UsageError(p.location, std::string("grain ") + std::to_string(id) + " of " + p.file.filename().string() + " has no closed surface: " + what,
                             "leave it out of grains, or make the file again with csct2ls");
    };
    ShapeTemplate shape;
    shape.kind = p.shape;
    shape.name = p.file.filename().string() + (p.shape == ShapeKind::sh ? " shape " : " grain_") + std::to_string(id);
    if (p.shape == ShapeKind::level_set) {
        sdf::GrainLevelSet grain = sdf::GrainReader(p.file).read(int(id));
        closed(grain.solid, "its level set is solid at the border of its lattice, or nowhere");
        closed(grain.apparent, "its filled level set is solid at the border of its lattice, or nowhere");
        shape.grid = std::make_shared<sdf::DistanceGrid>(sdf::extended(grain.solid, reach));
        constexpr int margin = 2;  // it tells inside from outside: distances out there are half of its memory
        shape.apparent_grid = std::make_shared<sdf::DistanceGrid>(sdf::trimmed(grain.apparent, margin));
        shape.volume = grain.volume;
        shape.apparent_volume = grain.apparent_volume;
        shape.equivalent_diameter = grain.equivalent_diameter;
        shape.inertia = grain.inertia;
    } else if (p.shape == ShapeKind::polyhedron) {
        return polyhedron_template(p.polyhedra.at(std::size_t(id)), p.surface_nodes);
    } else if (p.shape == ShapeKind::superellipsoid) {
        return superellipsoid_template(p, reach);
    } else {
        const sh::ShapeFile file = sh::read_shapes(p.file);
        const auto found = std::find_if(file.shapes.begin(), file.shapes.end(), [&](const sh::ShapeRecord& s) { return s.id == id; });
        if (found == file.shapes.end()) throw UsageError(p.file.string(), "has no shape " + std::to_string(id), "");
        const sh::Surface surface = sh::centred(found->surface);
        const sh::BodyProperties body = sh::body_properties(surface);
        shape.volume = shape.apparent_volume = body.volume;
        shape.equivalent_diameter = std::cbrt(6 * body.volume / std::numbers::pi);
        shape.inertia = body.inertia;
        shape.grid = std::make_shared<sdf::DistanceGrid>(
            sh::tabulate(surface, p.grid_spacing > 0 ? p.grid_spacing : shape.equivalent_diameter / 60, reach));
        shape.degree = surface.degree;
        shape.coefficients = surface.coefficients;
        shape.centre = surface.centre;
    }
    sdf::SurfaceNodes nodes = sdf::surface_nodes(*shape.grid, p.surface_nodes);
    shape.nodes = std::move(nodes.positions);
    shape.node_areas = std::move(nodes.areas);
    return shape;
}

Grains make_grains(const Spec& spec, std::uint64_t seed, const std::function<void()>& visit)
{
    Random random(seed);
    Grains grains;
    Sample& sample = grains.sample;
    sample.materials = spec.materials;
    sample.gravity = spec.gravity;
    std::vector<Drawer> drawers;
    for (const Population& p : spec.populations)
        drawers.emplace_back(p, spec.materials[std::size_t(material_index(spec, p.material))].density, random);
    const std::vector<Drawn> drawn = draw_all(spec, drawers);

    // one template per population and id; the unit sphere is shared by all
    struct Wanted {
        std::size_t population;
        std::int64_t id;
        double smallest_scale;
    };
    std::vector<Wanted> wanted;
    std::map<std::pair<std::size_t, std::int64_t>, int> index;
    double largest_sphere = 0;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
        const Population& p = spec.populations[i];
        const bool sphere = p.shape == ShapeKind::sphere;
        if (!sphere) join_history(sample.history, drawers[i].source().history);
        for (const auto& g : drawn[i]) {
            const auto key = sphere ? std::pair<std::size_t, std::int64_t>{std::size_t(-1), 0} : std::pair{i, g.id};
            const double scale = sphere ? g.diameter : g.diameter / drawers[i].source().diameter.at(g.id);
            const auto [at, added] = index.try_emplace(key, int(wanted.size()));
            if (added) wanted.push_back({i, g.id, scale});
            if (sphere) largest_sphere = std::max(largest_sphere, 0.5 * g.diameter);
            Wanted& w = wanted[std::size_t(at->second)];
            w.smallest_scale = std::min(w.smallest_scale, scale);
            Particle particle;
            particle.shape = at->second;
            particle.scale = scale;
            particle.role = p.role;
            particle.material = material_index(spec, p.material);
            sample.particles.push_back(particle);
            grains.population.push_back(int(i));
        }
    }
    sample.shapes.resize(wanted.size());
    Progress progress("loading shapes", double(wanted.size()));
    std::mutex progress_lock;
    std::size_t done = 0;
    const auto load = [&](std::size_t k) {
        const Population& p = spec.populations[wanted[k].population];
        // lists see spheres a skin (half a radius is ample) before they touch
        const double reach = 1.5 * largest_sphere / wanted[k].smallest_scale;
        sample.shapes[k] = p.shape == ShapeKind::sphere ? unit_sphere() : load_shape(p, wanted[k].id, reach);
        const std::lock_guard lock(progress_lock);
        progress.update(double(++done));
        visit();
    };
    const auto is_sh = [&](std::size_t k) { return spec.populations[wanted[k].population].shape == ShapeKind::sh; };
    parallel_blocks(wanted.size(), 1, [&](std::size_t k, std::size_t) {
        if (!is_sh(k)) load(k);
    });
    for (std::size_t k = 0; k < wanted.size(); ++k)
        if (is_sh(k)) load(k);  // from HDF5, which is not thread-safe
    progress.finish();
    check_room(spec, grains);
    return grains;
}

}  // namespace coral::pack
