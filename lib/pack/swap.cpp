#include "pack/swap.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numbers>
#include <random>

#include "core/error.h"
#include "core/progress.h"
#include "core/text.h"
#include "pack/detail/random.h"
#include "pack/detail/swap.h"
#include "pack/populations.h"
#include "pack/sample_world.h"
#include "sh/surface.h"

namespace coral::pack {
namespace {

using Vec3 = Eigen::Vector3d;

constexpr int level_set_nodes = 6000, harmonic_nodes = 2500;

bool same_template(const ShapeTemplate& a, const ShapeTemplate& b)
{
    return a.kind == b.kind && a.nodes == b.nodes && a.grid && b.grid && a.grid->distance == b.grid->distance && a.grid->origin == b.grid->origin &&
           a.grid->spacing == b.grid->spacing;
}

/// Whether contact treats both alike, so that a friction spring between them means the same.
bool same_kind_of_contact(ShapeKind a, ShapeKind b)
{
    const auto group = [](ShapeKind k) { return k == ShapeKind::sphere ? 0 : k == ShapeKind::polyhedron ? 1 : 2; };
    return group(a) == group(b);
}

class Swapper {
public:
    Swapper(const Sample& sample, const SwapOptions& options, std::uint64_t seed, SwapReport& report)
        : old_(sample), options_(options), report_(report), random_(seed), sample_(sample), origin_(sample.particles.size(), Vec3::Zero())
    {
    }

    Sample run()
    {
        check_kinds();
        if (!options_.library.empty() && options_.library.extension() != ".vdb") read_stones();
        sample_.shapes.clear();
        for (const Role role : {Role::coarse, Role::fine}) swap_role(role);
        keep_others();
        detail::turn_to_fit(sample_, drawn_, [&] { return detail::random_rotation(random_); });
        if (report_.swapped_coarse + report_.swapped_fine == 0)
            throw UsageError("sample", "has nothing to swap: all its grains have the shapes asked for already", "ask for other shapes");
        for (const RecordEntry& step : library_.history) {
            const std::string text = to_json({step});
            if (to_json(sample_.history).find(text.substr(1, text.size() - 2)) == std::string::npos) sample_.history.push_back(step);
        }
        keep_springs();
        return std::move(sample_);
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
            library_ = detail::read_library(options_.library);
            return;
        }
        for (std::size_t k = 0; k < old_.shapes.size(); ++k) {
            const auto wears_it = [&](const Particle& p) { return p.role == Role::coarse && std::size_t(p.shape) == k; };
            if (old_.shapes[k].kind != ShapeKind::sphere && std::any_of(old_.particles.begin(), old_.particles.end(), wears_it))
                library_.stones.push_back(detail::stone_of(old_.shapes[k]));
        }
    }

    /// The library's shape of the number that a template's name ends with; without a library what the template itself is made of.
    detail::Stone stone_for(const ShapeTemplate& shape)
    {
        if (options_.library.empty()) return detail::stone_of(shape);
        read_stones();
        const auto id = detail::id_of(shape.name);
        const auto found = std::find_if(library_.stones.begin(), library_.stones.end(), [&](const detail::Stone& s) { return id && s.id == *id; });
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

    detail::NewShape replacement(const ShapeTemplate& old, Role role, ShapeKind kind, double least)
    {
        const double volume = options_.keep_mass ? old.volume : old.apparent_volume;
        const int nodes = role == Role::fine ? options_.fine_nodes : harmonic_nodes;
        if (kind == ShapeKind::sh) return detail::harmonic_shape(stone_for(old), volume, options_.degree, reach(least), nodes, report_.warnings);
        if (kind == ShapeKind::polyhedron) return detail::polyhedral_shape(stone_for(old), volume, options_.faces, nodes);
        const auto id = detail::id_of(old.name);
        if (!id) throw UsageError(old.name, "has no number to find in " + options_.library.string(), "level sets replace grains of the same file");
        Population source;
        source.name = "library";
        source.shape = ShapeKind::level_set;
        source.file = options_.library;
        source.surface_nodes = old.kind == ShapeKind::level_set ? int(old.nodes.size()) : level_set_nodes;
        detail::NewShape made;
        made.shape = load_shape(source, *id, reach(least));
        if (old.kind != ShapeKind::level_set) {
            // harmonics sit where their fit to the level set has its centroid
            const detail::NewShape fitted = detail::harmonic_shape(detail::stone_of(made.shape), made.shape.apparent_volume,
                                                                   old.degree > 0 ? old.degree : options_.degree, 0, 500, report_.warnings);
            made.origin = -fitted.origin;
        }
        return made;
    }

    /// Grains of one template get another, their shape frames unmoved.
    void take(Role role, int from, detail::NewShape made)
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
        for (const detail::Stone& stone : library_.stones)
            drawn.push_back(add(kind == ShapeKind::sh
                                    ? detail::harmonic_shape(unit_stone(stone, old.apparent_volume), old.apparent_volume, options_.degree, reach(least), nodes, report_.warnings).shape
                                    : detail::polyhedral_shape(stone, old.apparent_volume, options_.faces, nodes).shape));
        std::vector<int> deck;
        for (std::size_t i = 0; i < old_.particles.size(); ++i) {
            const Particle& p = old_.particles[i];
            if (p.role != role || p.shape != from) continue;
            if (deck.empty()) {
                deck = drawn;
                for (std::size_t k = deck.size() - 1; k > 0; --k) std::swap(deck[k], deck[std::size_t(detail::uniform(random_) * double(k + 1))]);
            }
            sample_.particles[i].shape = deck.back();
            sample_.particles[i].orientation = detail::random_rotation(random_);
            deck.pop_back();
            count(role);
            new_.push_back(i);
            drawn_.push_back(i);
        }
    }

    /// Harmonics of a stone at about the size they will have: their coefficients times a factor; a level set is fitted once.
    detail::Stone unit_stone(const detail::Stone& stone, double volume) const
    {
        detail::Stone large = stone;
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

    const ShapeTemplate& old_shape(int particle) const { return old_.shapes[std::size_t(old_.particles[std::size_t(particle)].shape)]; }
    const ShapeTemplate& new_shape(int particle) const { return sample_.shapes[std::size_t(sample_.particles[std::size_t(particle)].shape)]; }

    void keep_springs()
    {
        std::vector<std::shared_ptr<const dem::Shape>> olds(old_.shapes.size()), news(sample_.shapes.size());
        const auto made = [](auto& list, const auto& shapes, int k) -> const dem::Shape& {
            if (!list[std::size_t(k)]) list[std::size_t(k)] = make_shape(shapes[std::size_t(k)]);
            return *list[std::size_t(k)];
        };
        report_.springs_before = int(old_.springs.size());
        sample_.springs.clear();
        for (ContactSpring s : old_.springs) {
            bool kept = true;
            for (const int body : {s.first, s.second})
                kept = kept && (body < 0 || same_kind_of_contact(old_shape(body).kind, new_shape(body).kind));
            if (!kept) continue;
            const bool nodes = new_shape(s.first).kind != ShapeKind::sphere;
            if (nodes && is_new_[std::size_t(s.first)] && !same_template(old_shape(s.first), new_shape(s.first))) {
                const Particle &p = old_.particles[std::size_t(s.first)], &q = sample_.particles[std::size_t(s.first)];
                const dem::Shape& before = made(olds, old_.shapes, p.shape);
                const dem::Shape& after = made(news, sample_.shapes, q.shape);
                if (s.node < 0 || std::size_t(s.node) >= before.nodes().size()) continue;
                const Vec3 place = (before.nodes()[std::size_t(s.node)] - origin_[std::size_t(s.first)]) * (p.scale / q.scale);
                double nearest = std::numeric_limits<double>::infinity();
                for (std::size_t n = 0; n < after.nodes().size(); ++n)
                    if (const double d = (after.nodes()[n] - place).squaredNorm(); d < nearest) nearest = d, s.node = int(n);
                const auto twin = [&](const ContactSpring& t) { return t.first == s.first && t.second == s.second && t.node == s.node; };
                if (std::any_of(sample_.springs.begin(), sample_.springs.end(), twin)) continue;
            }
            sample_.springs.push_back(s);
        }
        report_.springs_kept = int(sample_.springs.size());
    }

    const Sample& old_;
    const SwapOptions& options_;
    SwapReport& report_;
    detail::Random random_;
    Sample sample_;
    std::vector<Vec3> origin_;         ///< of the new frame in the old one, at the old scale [m]
    std::vector<std::size_t> new_;     ///< grains with a new shape
    std::vector<std::size_t> drawn_;   ///< those that were spheres: their orientation is free
    std::vector<char> is_new_;
    detail::Library library_;
    bool have_stones_ = false;
};

/// Takes grains out; contacts of the sample are left to the measurement.
void remove(Sample& sample, const std::vector<char>& out)
{
    std::vector<int> index;
    std::vector<Particle> stay;
    for (std::size_t i = 0; i < sample.particles.size(); ++i) {
        index.push_back(out[i] ? -1 : int(stay.size()));
        if (!out[i]) stay.push_back(sample.particles[i]);
    }
    sample.particles = std::move(stay);
    std::vector<ContactSpring> springs;
    for (ContactSpring s : sample.springs) {
        s.first = index[std::size_t(s.first)];
        if (s.second >= 0 && (s.second = index[std::size_t(s.second)]) < 0) continue;
        if (s.first >= 0) springs.push_back(s);
    }
    sample.springs = std::move(springs);
    sample.contacts.clear();
}

/// Fines whose centre a coarse grain with a new shape covers; where they find a place, they are moved to its surface.
std::vector<char> trapped_fines(Sample& sample, const Sample& before, bool move)
{
    std::vector<char> trapped(sample.particles.size(), 0);
    std::map<int, std::shared_ptr<const dem::Shape>> shapes;
    for (const Particle& host : sample.particles)
        if (host.role == Role::coarse && !shapes.contains(host.shape)) shapes[host.shape] = make_shape(sample.shapes[std::size_t(host.shape)]);
    for (std::size_t i = 0; i < sample.particles.size(); ++i) {
        Particle& fine = sample.particles[i];
        if (fine.role != Role::fine) continue;
        const double radius = 0.5 * equivalent_diameter(sample, fine);
        for (std::size_t c = 0; c < sample.particles.size(); ++c) {
            const Particle& host = sample.particles[c];
            if (host.role != Role::coarse || same_template(sample.shapes[std::size_t(host.shape)], before.shapes[std::size_t(before.particles[c].shape)])) continue;
            const dem::Shape& shape = *shapes[host.shape];
            Vec3 local = host.orientation.conjugate() * (fine.position - host.position) / host.scale;
            if (local.norm() > shape.bounding_radius() || shape.distance(local) >= 0) continue;
            trapped[i] = 1;
            for (int k = 0; move && k < 50; ++k) {
                Vec3 gradient;
                const double missing = radius / host.scale - shape.distance_and_gradient(local, gradient);
                if (missing < 1e-3 * radius / host.scale || gradient.norm() == 0) break;
                local += std::min(missing, radius / host.scale) * gradient.normalized();
            }
            if (move) fine.position = host.position + host.orientation * (host.scale * local);
        }
    }
    return trapped;
}

double total_mass(const Sample& sample)
{
    double sum = 0;
    for (const Particle& p : sample.particles) sum += mass(sample, p);
    return sum;
}

double seconds_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

Sample replace_shapes(const Sample& sample, const SwapOptions& options, std::uint64_t seed, SwapReport& report)
{
    return Swapper(sample, options, seed, report).run();
}

Sample swap_shapes(const Sample& sample, const SwapOptions& options, std::uint64_t seed, SwapReport& report)
{
    report = {};
    const auto clock = std::chrono::steady_clock::now();
    Sample swapped = replace_shapes(sample, options, seed, report);
    report.shapes_seconds = seconds_since(clock);
    std::vector<char> trapped = trapped_fines(swapped, sample, !options.drop_trapped);
    for (std::size_t i = 0; i < trapped.size(); ++i)
        if (trapped[i]) report.trapped.push_back(int(i));
    report.mass_before = total_mass(sample);
    if (options.drop_trapped && !report.trapped.empty()) {
        Sample rest = sample;
        rest.springs = {};
        remove(rest, trapped);
        report.mass_before = total_mass(rest);
        remove(swapped, trapped);
        trapped.assign(swapped.particles.size(), 0);
    }
    report.mass_after = total_mass(swapped);
    const auto settling = std::chrono::steady_clock::now();
    detail::relax_swapped(swapped, sample, trapped, options, report);
    report.relaxation_seconds = seconds_since(settling);
    return swapped;
}

}  // namespace coral::pack
