// Other shapes for the grains of a sample where they stand; nothing is relaxed here.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "core/error.h"
#include "dem/polyhedron.h"
#include "pack/detail/swap.h"
#include "pack/populations.h"

namespace coral::pack::detail {
namespace {

using Vec3 = Eigen::Vector3d;

constexpr int level_set_nodes = 6000, harmonic_nodes = 2500;

class Swapper {
public:
    Swapper(const Sample& sample, const SwapOptions& options, std::uint64_t seed, SwapReport& report)
        : old_(sample), options_(options), report_(report), random_(seed), sample_(sample), origin_(sample.particles.size(), Vec3::Zero())
    {
    }

    Replaced run()
    {
        check_kinds();
        if (!options_.library.empty() && options_.library.extension() != ".vdb") read_stones();
        sample_.shapes.clear();
        for (const Role role : {Role::coarse, Role::fine}) swap_role(role);
        keep_others();
        turn_to_fit(sample_, drawn_, random_);
        if (report_.swapped_coarse + report_.swapped_fine == 0)
            throw UsageError("sample", "has nothing to swap: all its grains have the shapes asked for already", "ask for other shapes");
        for (const RecordEntry& step : library_.history) {
            const std::string text = to_json({step});
            if (to_json(sample_.history).find(text.substr(1, text.size() - 2)) == std::string::npos) sample_.history.push_back(step);
        }
        keep_springs(old_, origin_, is_new_, sample_, report_);
        return {std::move(sample_), std::move(drawn_), random_};
    }

private:
    void check_kinds() const
    {
        if (!options_.coarse && !options_.fine) throw UsageError("--coarse, --fine", "neither is given", "say what grains shall become, such as --coarse sh");
        for (const auto& [role, kind] : {std::pair{"--coarse", options_.coarse}, std::pair{"--fine", options_.fine}})
            if (kind == ShapeKind::superellipsoid) throw UsageError(role, "superellipsoids have no shape to come from", "take sphere, polyhedron, sh or level-set");
        if (options_.coarse == ShapeKind::level_set && options_.library.extension() != ".vdb")
            throw UsageError("--coarse level-set", "needs the level sets", "name them with --library grains.vdb");
        if (options_.fine == ShapeKind::level_set) throw UsageError("--fine", "level sets are for coarse grains", "take sphere, polyhedron or sh");
    }

    /// The library, or what the coarse grains of the sample are made of.
    void read_stones()
    {
        if (have_stones_) return;
        have_stones_ = true;
        if (!options_.library.empty()) {
            library_ = read_library(options_.library);
            return;
        }
        for (std::size_t k = 0; k < old_.shapes.size(); ++k) {
            const auto wears_it = [&](const Particle& p) { return p.role == Role::coarse && std::size_t(p.shape) == k; };
            if (old_.shapes[k].kind != ShapeKind::sphere && std::any_of(old_.particles.begin(), old_.particles.end(), wears_it))
                library_.stones.push_back(stone_of(old_.shapes[k]));
        }
    }

    /// The library's shape of the number that a template's name ends with; without a library what the template itself is made of.
    Stone stone_for(const ShapeTemplate& shape)
    {
        if (options_.library.empty()) return stone_of(shape);
        read_stones();
        const auto id = id_of(shape.name);
        const auto found = std::find_if(library_.stones.begin(), library_.stones.end(), [&](const Stone& s) { return id && s.id == *id; });
        if (found == library_.stones.end())
            throw UsageError(options_.library.string(), "has no shape for '" + shape.name + "'", "name the file of the grains that were packed, or leave --library out");
        return *found;
    }

    /// How far outside a template of this smallest scale contact may ask: spheres that stay, their skin included.
    double reach(double smallest_scale) const
    {
        double radius = 0;
        for (const Particle& p : old_.particles) {
            const auto becomes = p.role == Role::coarse ? options_.coarse : options_.fine;
            const bool sphere = becomes ? *becomes == ShapeKind::sphere : old_.shapes[std::size_t(p.shape)].kind == ShapeKind::sphere;
            if (sphere) radius = std::max(radius, 0.5 * equivalent_diameter(old_, p));
        }
        return 1.5 * radius / smallest_scale;
    }

    double smallest_scale(Role role, int shape) const
    {
        double least = std::numeric_limits<double>::infinity();
        for (const Particle& p : old_.particles)
            if (p.role == role && p.shape == shape) least = std::min(least, p.scale);
        return least;
    }

    void swap_role(Role role)
    {
        const auto kind = role == Role::coarse ? options_.coarse : options_.fine;
        if (!kind) return;
        for (std::size_t k = 0; k < old_.shapes.size(); ++k) {
            const double least = smallest_scale(role, int(k));
            const ShapeTemplate& shape = old_.shapes[k];
            const bool reload = *kind == ShapeKind::level_set && shape.kind == ShapeKind::level_set;
            if (!std::isfinite(least) || (shape.kind == *kind && !reload)) continue;
            if (*kind == ShapeKind::sphere) take_spheres(role, int(k));
            else if (shape.kind == ShapeKind::sphere) draw(role, int(k), *kind, least);
            else take(role, int(k), replacement(shape, role, *kind, least));
        }
    }

    int add(ShapeTemplate shape)
    {
        if (shape.kind == ShapeKind::polyhedron) {
            const dem::Polyhedron hull(shape.vertices, shape.name);
            const int faces = int(hull.faces().size());
            report_.smallest_faces = report_.smallest_faces > 0 ? std::min(report_.smallest_faces, faces) : faces;
            report_.largest_faces = std::max(report_.largest_faces, faces);
        }
        ++report_.new_shapes;
        sample_.shapes.push_back(std::move(shape));
        return int(sample_.shapes.size()) - 1;
    }

    void count(Role role) { ++(role == Role::coarse ? report_.swapped_coarse : report_.swapped_fine); }

    NewShape replacement(const ShapeTemplate& old, Role role, ShapeKind kind, double least)
    {
        const double volume = options_.keep_mass ? old.volume : old.apparent_volume;
        const int nodes = role == Role::fine ? options_.fine_nodes : harmonic_nodes;
        if (kind == ShapeKind::sh) return harmonic_shape(stone_for(old), volume, options_.degree, reach(least), nodes, report_.warnings);
        if (kind == ShapeKind::polyhedron) return polyhedral_shape(stone_for(old), volume, options_.faces, nodes);
        const auto id = id_of(old.name);
        if (!id) throw UsageError(old.name, "has no number to find in " + options_.library.string(), "level sets replace grains of the same file");
        Population source;
        source.name = "library";
        source.shape = ShapeKind::level_set;
        source.file = options_.library;
        source.surface_nodes = old.kind == ShapeKind::level_set ? int(old.nodes.size()) : level_set_nodes;
        NewShape made;
        made.shape = load_shape(source, *id, reach(least));
        if (old.kind != ShapeKind::level_set) {
            // harmonics sit where their fit to the level set has its centroid
            const NewShape fitted = harmonic_shape(stone_of(made.shape), made.shape.apparent_volume,
                                                                   old.degree > 0 ? old.degree : options_.degree, 0, 500, report_.warnings);
            made.origin = -fitted.origin;
        }
        return made;
    }

    /// Grains of one template get another, their shape frames unmoved.
    void take(Role role, int from, NewShape made)
    {
        const ShapeTemplate& old = old_.shapes[std::size_t(from)];
        // a level set from a file has the size of the file: the scale makes up for it
        const double volume = options_.keep_mass ? old.volume / made.shape.volume : old.apparent_volume / made.shape.apparent_volume;
        const double factor = std::abs(volume - 1) < 1e-12 ? 1 : std::cbrt(volume);
        const Vec3 origin = made.origin * (made.shape.kind == ShapeKind::level_set ? factor : 1.0);
        const int shape = add(std::move(made.shape));
        for (std::size_t i = 0; i < old_.particles.size(); ++i) {
            const Particle& p = old_.particles[i];
            if (p.role != role || p.shape != from) continue;
            Particle& q = sample_.particles[i];
            q.shape = shape;
            q.scale = p.scale * factor;
            origin_[i] = origin;
            q.position = p.position + p.orientation * (p.scale * origin);
            count(role);
            new_.push_back(i);
        }
    }

    void take_spheres(Role role, int from)
    {
        int sphere = -1;
        for (std::size_t k = 0; k < sample_.shapes.size(); ++k)
            if (sample_.shapes[k].kind == ShapeKind::sphere) sphere = int(k);
        if (sphere < 0) sphere = add(unit_sphere());
        for (std::size_t i = 0; i < old_.particles.size(); ++i) {
            const Particle& p = old_.particles[i];
            if (p.role != role || p.shape != from) continue;
            sample_.particles[i].shape = sphere;
            sample_.particles[i].scale = std::cbrt(6 / std::numbers::pi * (options_.keep_mass ? volume(old_, p) : apparent_volume(old_, p)));
            count(role);
            new_.push_back(i);
        }
    }

    /// Spheres become shapes drawn from the stones, all of diameter 1 m as the sphere is, turned at random.
    void draw(Role role, int from, ShapeKind kind, double least)
    {
        read_stones();
        if (kind == ShapeKind::level_set) throw UsageError("--coarse level-set", "spheres have no level sets", "take sh or polyhedron shapes");
        if (library_.stones.empty())
            throw UsageError(role == Role::coarse ? "--coarse" : "--fine", "the sample has spheres only, no shapes to take", "name a file of shapes with --library grains.sh.h5");
        const ShapeTemplate& old = old_.shapes[std::size_t(from)];
        const int nodes = role == Role::fine ? options_.fine_nodes : harmonic_nodes;
        std::vector<int> drawn;
        for (const Stone& stone : library_.stones)
            drawn.push_back(add(kind == ShapeKind::sh
                                    ? harmonic_shape(unit_stone(stone, old.apparent_volume), old.apparent_volume, options_.degree, reach(least), nodes, report_.warnings).shape
                                    : polyhedral_shape(stone, old.apparent_volume, options_.faces, nodes).shape));
        std::vector<int> deck;
        for (std::size_t i = 0; i < old_.particles.size(); ++i) {
            const Particle& p = old_.particles[i];
            if (p.role != role || p.shape != from) continue;
            if (deck.empty()) {
                deck = drawn;
                for (std::size_t k = deck.size() - 1; k > 0; --k) std::swap(deck[k], deck[std::size_t(uniform(random_) * double(k + 1))]);
            }
            sample_.particles[i].shape = deck.back();
            sample_.particles[i].orientation = random_rotation(random_);
            deck.pop_back();
            count(role);
            new_.push_back(i);
            drawn_.push_back(i);
        }
    }

    /// Harmonics of a stone at about the size they will have: their coefficients times a factor; a level set is fitted once.
    Stone unit_stone(const Stone& stone, double volume) const
    {
        Stone large = stone;
        const double factor = std::cbrt(volume / stone.volume);
        large.centre *= factor;
        for (double& c : large.coefficients) c *= factor;
        return large;
    }

    /// Templates that grains keep go behind the new ones.
    void keep_others()
    {
        std::vector<char> is_new(old_.particles.size(), 0);
        for (const std::size_t i : new_) is_new[i] = 1;
        std::map<int, int> index;
        for (std::size_t i = 0; i < old_.particles.size(); ++i) {
            if (is_new[i]) continue;
            const int from = old_.particles[i].shape;
            const auto [at, added] = index.try_emplace(from, int(sample_.shapes.size()));
            if (added) sample_.shapes.push_back(old_.shapes[std::size_t(from)]);
            sample_.particles[i].shape = at->second;
        }
        is_new_ = std::move(is_new);
    }

    const Sample& old_;
    const SwapOptions& options_;
    SwapReport& report_;
    Random random_;
    Sample sample_;
    std::vector<Vec3> origin_;         ///< of the new frame in the old one, at the old scale [m]
    std::vector<std::size_t> new_;     ///< grains with a new shape
    std::vector<std::size_t> drawn_;   ///< those that were spheres: their orientation is free
    std::vector<char> is_new_;
    Library library_;
    bool have_stones_ = false;
};

}  // namespace

Replaced replace(const Sample& sample, const SwapOptions& options, std::uint64_t seed, SwapReport& report)
{
    return Swapper(sample, options, seed, report).run();
}

}  // namespace coral::pack::detail
