// Force of a contact of nodes against their number: mean and scatter over poses, for level sets, harmonics and polyhedra.
#include <numbers>
#include <random>

#include "bench/table.h"
#include "core/parallel.h"
#include "dem/detail/contact_law.h"
#include "dem/polyhedra_for_tests.h"
#include "morph/apparent_shape.h"
#include "morph/components.h"
#include "phantom/grain.h"
#include "phantom/random.h"
#include "sdf/level_set.h"
#include "sdf/extend.h"
#include "sdf/mesh.h"
#include "sdf/surface_nodes.h"
#include "sh/fit.h"
#include "sh/tabulate.h"

namespace {

using namespace coral;
using dem::testing::Quat;
using dem::testing::Vec3;

/// Nodes of one shape.
struct Nodes {
    std::vector<Vec3> at;
    std::vector<double> area;
};

/// A shape as the contact of nodes sees it.
struct Body {
    std::string name;
    double radius = 0, bound = 0;  ///< of the sphere of the apparent volume; about the centre
    std::function<double(const Vec3&, Vec3&)> distance;
    std::function<Nodes(int)> nodes;
    std::vector<int> counts;
    std::vector<double> overlaps;
    Nodes reference;
};

/// Force on the slave with pose (at, turn) against the master at the origin: kn = 2e5 N/m. touching: number of nodes.
Vec3 force(const Body& body, const Nodes& nodes, const Vec3& at, const Quat& turn, int& touching)
{
    constexpr double kn = 2e5;
    const double stiffness = kn * (2 / body.radius) / (2 * std::numbers::pi), inverse_length = dem::detail::sigmoid / (2 * body.radius);
    Vec3 sum = Vec3::Zero(), gradient;
    touching = 0;
    for (std::size_t i = 0; i < nodes.at.size(); ++i) {
        const Vec3 p = at + turn * nodes.at[i];
        if (p.squaredNorm() > body.bound * body.bound) continue;
        const double depth = -body.distance(p, gradient);
        if (depth <= 0) continue;
        ++touching;
        sum += stiffness * nodes.area[i] * dem::detail::node_potential(depth, inverse_length).force * gradient;
    }
    return sum;
}

double deepest(const Body& body, const Nodes& nodes, const Vec3& at, const Quat& turn)
{
    double depth = 0;
    Vec3 ignored;
    for (const Vec3& n : nodes.at) {
        const Vec3 p = at + turn * n;
        if (p.squaredNorm() < body.bound * body.bound) depth = std::max(depth, -body.distance(p, ignored));
    }
    return depth;
}

struct Pose {
    Vec3 at;
    Quat turn;
};

/// Both bodies turned at random, the second moved against the first along a random line until the overlap is reached.
std::vector<Pose> poses(const Body& body, double overlap, int count)
{
    std::mt19937_64 random(7);
    std::normal_distribution<double> n;
    std::vector<Pose> list(static_cast<std::size_t>(count));
    for (Pose& p : list) {
        const double a = n(random), b = n(random), c = n(random), w = n(random), x = n(random), y = n(random), z = n(random);
        p = {Vec3(a, b, c).normalized(), Quat(w, x, y, z).normalized()};
    }
    parallel_blocks(list.size(), 1, [&](std::size_t k, std::size_t) {
        Pose& p = list[k];
        const Vec3 u = p.at;
        // From outside inwards: grains with voids may be apart again further in.
        double high = 2.02 * body.bound, low = high;
        while (deepest(body, body.reference, low * u, p.turn) < overlap) high = low, low -= 2e-4 * body.radius / 7.5e-3;
        for (int it = 0; it < 14; ++it) {
            const double mid = 0.5 * (low + high);
            (deepest(body, body.reference, mid * u, p.turn) > overlap ? low : high) = mid;
        }
        p.at = 0.5 * (low + high) * u;
    });
    return list;
}

struct Statistic {
    double mean = 0, square = 0, touching = 0, none = 0, direction = 0;
};

void table(Body& body, int count)
{
    std::printf("\n%s: force over that of %zu nodes, mean +- standard deviation over %d poses; touching nodes; poses in which none touches; turn of the force\n", body.name.c_str(),
                body.reference.at.size(), count);
    std::printf("%14s %8s %16s %18s %10s %8s %12s | %18s\n", "overlap [um]", "nodes", "force [N]", "ratio", "touching", "none", "turn [deg]", "ratio, two-way");
    std::vector<Nodes> sets;
    for (const int n : body.counts) sets.push_back(body.nodes(n));
    for (const double overlap : body.overlaps) {
        const std::vector<Pose> list = poses(body, overlap, count);
        const auto both = [&](const Nodes& nodes, const Pose& p, Vec3& one, int& touching) {
            one = force(body, nodes, p.at, p.turn, touching);
            int other = 0;
            const Quat back = p.turn.conjugate();
            return Vec3(0.5 * (one - p.turn * force(body, nodes, back * -p.at, back, other)));
        };
        std::vector<Vec3> exact(list.size()), exact_both(list.size());
        double newton = 0;
        parallel_blocks(list.size(), 1, [&](std::size_t k, std::size_t) {
            int ignored;
            exact_both[k] = both(body.reference, list[k], exact[k], ignored);
        });
        for (const Vec3& f : exact) newton += f.norm() / count;
        for (std::size_t s = 0; s < sets.size(); ++s) {
            Statistic one, two;
            for (std::size_t k = 0; k < list.size(); ++k) {
                int touching = 0;
                Vec3 f;
                const Vec3 b = both(sets[s], list[k], f, touching);
                const double r = f.norm() / exact[k].norm(), q = b.norm() / exact_both[k].norm();
                one.mean += r / count, one.square += r * r / count, two.mean += q / count, two.square += q * q / count;
                one.touching += double(touching) / count;
                one.none += touching == 0 ? 1.0 / count : 0;
                if (touching > 0) one.direction += std::acos(std::clamp(f.normalized().dot(exact[k].normalized()), -1.0, 1.0)) * 180 / std::numbers::pi / count;
            }
            const auto spread = [](const Statistic& v) { return std::sqrt(std::max(v.square - v.mean * v.mean, 0.0)); };
            std::printf("%14.0f %8zu %16.3g %9.3f +- %5.3f %10.1f %7.0f%% %12.2f | %9.3f +- %5.3f\n", 1e6 * overlap, sets[s].at.size(), newton, one.mean, spread(one), one.touching,
                        100 * one.none, one.direction, two.mean, spread(two));
            std::fflush(stdout);
        }
    }
}

Body lattice(std::string name, sdf::DistanceGrid grid, double apparent_volume, int reference, double ball = 0)
{
    Body body;
    body.name = std::move(name);
    auto shared = std::make_shared<const sdf::DistanceGrid>(std::move(grid));
    body.distance = [shared](const Vec3& p, Vec3& g) { return shared->sample_with_gradient(p, g); };
    body.nodes = [shared, ball](int n) {
        sdf::SurfaceNodes made = sdf::surface_nodes(*shared, n, ball);
        return Nodes{std::move(made.positions), std::move(made.areas)};
    };
    body.radius = std::cbrt(3 * apparent_volume / (4 * std::numbers::pi));
    // The reference is the same for every way to place nodes: evenly spread.
    sdf::SurfaceNodes fine = sdf::surface_nodes(*shared, reference);
    body.reference = {std::move(fine.positions), std::move(fine.areas)};
    for (const Vec3& p : body.reference.at) body.bound = std::max(body.bound, p.norm());
    body.counts = {1000, 2500, 6000, 12000, 24000};
    body.overlaps = {20e-6, 30e-6, 100e-6, 200e-6, 300e-6};
    return body;
}

/// Coral-like grain of 15 mm from voxels of 100 um, level set of 200 um.
sdf::GrainLevelSet coral_grain(double porosity, std::uint64_t number)
{
    phantom::RandomSource random(1, number);
    phantom::GrainSpec spec;
    spec.outline.equivalent_diameter = 15e-3;
    spec.outline.sphericity = 0.88;
    spec.voids.porosity = porosity;
    const phantom::GrainImage image = phantom::Grain(spec, random).image(Vec3::Constant(1e-4), 1);
    morph::Mask solid = morph::make_mask(image.size, Vec3::Constant(1e-4));
    solid.voxels = image.solid;
    morph::keep_largest_component(solid);
    const morph::ApparentShape apparent = morph::close_with_ball(solid, morph::default_closing_radius(solid));
    const auto view = [](const morph::Mask& m) { return sdf::GrainMask{m.size, m.voxel_size, 0.5 * m.voxel_size, m.voxels}; };
    sdf::LevelSetOptions options;
    options.spacing = 2e-4;
    sdf::GrainLevelSet grain = sdf::grain_from_masks(view(solid), view(apparent.apparent), options, nullptr);
    return grain;
}

}  // namespace

/// node_table [POSES [ball|shell|coral|exposed|harmonics|stone]]
int main(int argc, char** argv)
{
    const int count = argc > 1 ? std::max(1, std::atoi(argv[1])) : 120;
    const std::string only = argc > 2 ? argv[2] : "";
    const auto wanted = [&](const char* name) { return only.empty() || only == name; };
    constexpr int reference = 48000;
    if (wanted("ball")) {
        Body b = lattice("Ball of 15 mm, 200 um", *dem::testing::tabulate([](const Vec3& p) { return p.norm() - 7.5e-3; }, Vec3::Constant(8.5e-3), 2e-4),
                         4.0 / 3 * std::numbers::pi * std::pow(7.5e-3, 3), reference);
        table(b, count);
    }
    if (wanted("shell")) {
        Body b = lattice("Shell of 15 mm with a closed void of 12 mm, 200 um",
                         *dem::testing::tabulate([](const Vec3& p) { return std::max(p.norm() - 7.5e-3, 6e-3 - p.norm()); }, Vec3::Constant(8.5e-3), 2e-4),
                         4.0 / 3 * std::numbers::pi * std::pow(7.5e-3, 3), reference);
        table(b, count);
    }
    if (wanted("coral") || wanted("exposed") || wanted("harmonics")) {
        const sdf::GrainLevelSet grain = coral_grain(0.3, 2);
        if (wanted("coral")) {
            Body b = lattice("Coral-like grain of 15 mm, porosity 0.3, 200 um", sdf::extended(grain.solid, 1e-3), grain.apparent_volume, reference);
            int exposed = 0;
            for (const Vec3& p : b.reference.at) exposed += grain.apparent.sample(p) > -2e-4;
            std::printf("\nSurface %.0f mm2, apparent surface %.0f mm2; %.0f %% of the nodes within 200 um of the apparent surface\n", 1e6 * sdf::surface_area(sdf::extract_mesh(grain.solid)),
                        1e6 * sdf::surface_area(sdf::extract_mesh(grain.apparent)), 100.0 * exposed / b.reference.at.size());
            table(b, count);
        }
        if (wanted("exposed")) {
            Body b = lattice("The same, fewer nodes where a ball of a twentieth of the diameter does not touch", sdf::extended(grain.solid, 1e-3), grain.apparent_volume, reference,
                             0.05 * 15e-3);
            table(b, count);
        }
        if (wanted("harmonics")) {
            const sh::Surface surface = sh::centred(sh::fit(sh::cast_rays(grain.apparent, 10), 10, grain.apparent_volume));
            Body b = lattice("Harmonics of degree 10 of its apparent shape, 200 um", sh::tabulate(surface, 2e-4, 1e-3), grain.apparent_volume, reference);
            table(b, count);
        }
    }
    if (wanted("stone")) {
        const dem::Polyhedron stone = dem::testing::stone(26, 4);
        Body b;
        b.name = "Stone of 2 mm with 26 faces";
        b.distance = [&](const Vec3& p, Vec3& g) { return stone.depth_and_normal(p, g); };
        b.nodes = [&](int n) {
            dem::SurfaceNodes made = dem::polyhedron_nodes(stone, n);
            return Nodes{std::move(made.positions), std::move(made.areas)};
        };
        b.radius = std::cbrt(3 * stone.volume() / (4 * std::numbers::pi));
        b.reference = b.nodes(60000);
        for (const Vec3& p : b.reference.at) b.bound = std::max(b.bound, p.norm());
        b.counts = {640, 1250, 2500, 6000, 12000};
        b.overlaps = {5e-6, 20e-6, 50e-6, 100e-6};
        table(b, count);
    }
}
