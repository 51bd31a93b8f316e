// Shapes swapped in place: what stays (frames, volumes, forces of an identical swap), what is refused.
// Cases 22 (identical replacement) and 23 (level set to harmonics) of the list of hard cases.
#include "pack/swap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/output_file.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "pack/pack.h"
#include "pack/sample_world.h"
#include "pack/scratch.h"
#include "sdf/mass_properties.h"
#include "sdf/vdb_io.h"

using namespace coral::pack;
using Vec3 = Eigen::Vector3d;

namespace {

/// Capsule along z, radius 1.5 mm, with a closed void off the middle: its centre of mass and that of its filled shape differ.
coral::sdf::GrainLevelSet lopsided_capsule(int id)
{
    constexpr double h = 1.5e-4, r = 1.5e-3, half = 5e-4, band = 6 * h;
    const Vec3 hollow(0, 0, 6e-4);
    coral::sdf::GrainLevelSet grain;
    grain.id = id;
    grain.label = std::uint32_t(id);
    coral::sdf::DistanceGrid& g = grain.solid;
    g.spacing = h;
    g.size = (2 * Vec3(r + 9 * h, r + 9 * h, r + half + 9 * h) / h).array().ceil().cast<int>() + 1;
    g.origin = -0.5 * h * (g.size.array() - 1).cast<double>();
    g.outside_limit = g.inside_limit = band;
    grain.apparent = g;
    for (int k = 0; k < g.size.z(); ++k)
        for (int j = 0; j < g.size.y(); ++j)
            for (int i = 0; i < g.size.x(); ++i) {
                const Vec3 x = g.node(i, j, k);
                const double outer = (x - Vec3(0, 0, std::clamp(x.z(), -half, half))).norm() - r;
                g.distance.push_back(float(std::clamp(std::max(outer, 7e-4 - (x - hollow).norm()), -band, band)));
                grain.apparent.distance.push_back(float(std::clamp(outer, -band, band)));
            }
    const auto solid = coral::sdf::mass_properties(g);
    g.origin -= solid.centroid;
    grain.apparent.origin -= solid.centroid;
    grain.volume = solid.volume;
    grain.inertia = solid.inertia;
    grain.apparent_volume = coral::sdf::solid_volume(grain.apparent);
    grain.equivalent_diameter = std::cbrt(6 * grain.apparent_volume / std::numbers::pi);
    grain.intraparticle_porosity = 1 - grain.volume / grain.apparent_volume;
    return grain;
}

/// Six of the capsules among about forty spheres of 1 mm, pressed at 2 kPa; packed once.
Sample packed_in(const std::string& enclosure)
{
    coral::Progress::set_quiet(true);
    const std::vector grains{lopsided_capsule(1)};
    coral::sdf::write_grains(scratch("grains.vdb"), grains, {});
    coral::write_text_file(scratch("swap.toml"),
                           enclosure + "[[population]]\nrole = \"coarse\"\nshape = \"level-set\"\nfile = \"grains.vdb\"\ncount = 6\nsurface_nodes = 1500\n"
                                       "[[population]]\nrole = \"fine\"\ndiameter = \"1mm\"\nmass_fraction = 0.15\n"
                                       "[material.default]\nnormal_stiffness = 2e4\ntangential_stiffness = 1e4\nfriction = 0.3\n"
                                       "[dropping]\ntime_limit = \"50ms\"\n[compression]\npressure = \"2kPa\"\ntime_limit = \"0.2s\"\nrelaxation_limit = \"50ms\"\n");
    PackReport report;
    return pack(read_spec(scratch("swap.toml")), 1, report);
}

const Sample& packed()
{
    static const Sample sample = packed_in("[box]\nsize = [\"8mm\", \"8mm\", \"12mm\"]\n");
    return sample;
}

coral::dem::World world_of(const Sample& sample)
{
    coral::dem::WorldOptions options;
    options.gravity = sample.gravity;
    coral::dem::World world(options);
    const SampleIds ids = add_sample(world, sample);
    restore_springs(world, sample, ids);
    world.relax(1e300, 0);
    return world;
}

SwapOptions coarse_to(ShapeKind kind)
{
    SwapOptions options;
    options.coarse = kind;
    return options;
}

}  // namespace

TEST(SwapShapes, identical_level_sets_leave_forces_and_histories_unchanged)
{
    packed();
    SwapOptions options = coarse_to(ShapeKind::level_set);
    options.library = scratch("grains.vdb");
    SwapReport report;
    const Sample swapped = replace_shapes(packed(), options, 1, report);
    EXPECT_EQ(report.swapped_coarse, 6);
    ASSERT_EQ(swapped.springs.size(), packed().springs.size());
    ASSERT_GT(swapped.springs.size(), 10u);
    for (std::size_t k = 0; k < swapped.springs.size(); ++k) {
        EXPECT_EQ(swapped.springs[k].node, packed().springs[k].node);
        EXPECT_LT((swapped.springs[k].spring - packed().springs[k].spring).norm(), 1e-12 * 1e-3);
    }
    const coral::dem::World before = world_of(packed()), after = world_of(swapped);
    double largest = 0;
    for (const Vec3& f : before.contact_forces()) largest = std::max(largest, f.norm());
    ASSERT_GT(largest, 0);
    for (std::size_t i = 0; i < swapped.particles.size(); ++i)
        EXPECT_LT((before.contact_forces()[i] - after.contact_forces()[i]).norm(), 1e-12 * largest) << i;

    const Sample whole = swap_shapes(packed(), options, 1, report);
    EXPECT_TRUE(report.unchanged);
    EXPECT_EQ(report.steps, 0);
    for (std::size_t i = 0; i < whole.particles.size(); ++i) EXPECT_EQ(whole.particles[i].position, packed().particles[i].position);
}

TEST(SwapShapes, harmonics_keep_the_shape_frame_and_the_volume_and_come_to_rest)
{
    SwapReport report;
    const Sample replaced = replace_shapes(packed(), coarse_to(ShapeKind::sh), 1, report);
    const ShapeTemplate& old = packed().shapes[std::size_t(packed().particles[0].shape)];
    const Vec3 filled = coral::sdf::mass_properties(*old.apparent_grid).centroid;
    ASSERT_GT(filled.norm(), 1e-5);  // the two centres of mass differ
    Vec3 origin = Vec3::Zero();
    int seen = 0;
    for (std::size_t i = 0; i < replaced.particles.size(); ++i) {
        const Particle &p = packed().particles[i], &q = replaced.particles[i];
        EXPECT_NEAR(apparent_volume(replaced, q), apparent_volume(packed(), p), 1e-9 * apparent_volume(packed(), p));
        if (p.role == Role::fine) continue;
        EXPECT_EQ(q.orientation.coeffs(), p.orientation.coeffs());
        const Vec3 moved = p.orientation.conjugate() * (q.position - p.position) / p.scale;
        if (seen++ == 0) origin = moved;
        EXPECT_LT((moved - origin).norm(), 1e-12);  // [m]: one and the same place of the frame in every grain
    }
    EXPECT_EQ(seen, 6);
    EXPECT_LT((origin - filled).norm(), 2e-3 * old.equivalent_diameter);

    const Sample swapped = swap_shapes(packed(), coarse_to(ShapeKind::sh), 1, report);
    EXPECT_LT(report.kinetic_energy, 1e-8);
    EXPECT_LT(report.coarse.largest, 0.02);
    EXPECT_LT(report.fine.mean, 0.05);
    EXPECT_LT(report.after.largest, 0.02);
    EXPECT_GT(report.springs_kept, report.springs_before / 2);
    EXPECT_FALSE(swapped.psd.empty());
    EXPECT_GT(report.mass_after, report.mass_before);  // the voids are filled
}

TEST(SwapShapes, keep_the_mass_when_asked)
{
    SwapOptions options = coarse_to(ShapeKind::sphere);
    options.keep_mass = true;
    SwapReport report;
    const Sample replaced = replace_shapes(packed(), options, 1, report);
    for (std::size_t i = 0; i < replaced.particles.size(); ++i)
        EXPECT_NEAR(mass(replaced, replaced.particles[i]), mass(packed(), packed().particles[i]), 1e-9 * mass(packed(), packed().particles[i]));
}

TEST(SwapShapes, fines_become_angular_at_the_same_places_for_any_number_of_threads)
{
    SwapOptions options;
    options.fine = ShapeKind::polyhedron;
    options.faces = 20;
    options.max_steps = 3000;
    SwapReport report;
    coral::set_thread_count(1);
    const Sample one = swap_shapes(packed(), options, 7, report);
    coral::set_thread_count(2);
    SwapReport again;
    const Sample two = swap_shapes(packed(), options, 7, again);
    coral::set_thread_count(0);
    EXPECT_LE(report.largest_faces, 20);
    EXPECT_GE(report.smallest_faces, 12);
    EXPECT_LT(report.fine.mean, 0.1);
    EXPECT_LT(report.coarse.largest, 0.1);
    EXPECT_LT(report.kinetic_energy, 1e-8);
    write_sample(one, scratch("one.h5"));
    write_sample(two, scratch("two.h5"));
    EXPECT_EQ(coral::read_text_file(scratch("one.h5")), coral::read_text_file(scratch("two.h5")));
    for (std::size_t i = 0; i < one.particles.size(); ++i) {
        if (one.particles[i].role == Role::coarse) continue;
        EXPECT_EQ(one.shapes[std::size_t(one.particles[i].shape)].kind, ShapeKind::polyhedron);
        EXPECT_NEAR(volume(one, one.particles[i]), volume(packed(), packed().particles[i]), 1e-9 * volume(one, one.particles[i]));
    }
}

TEST(SwapShapes, a_cylinder_and_periodic_sides_stay_what_they_are)
{
    for (const char* enclosure : {"[cylinder]\ndiameter = \"9mm\"\nheight = \"12mm\"\n", "[box]\nsize = [\"11mm\", \"11mm\", \"12mm\"]\nperiodic = [\"x\", \"y\"]\n"}) {
        const Sample before = packed_in(enclosure);
        SwapOptions options;
        options.fine = ShapeKind::polyhedron;
        options.faces = 20;
        options.max_steps = 3000;
        SwapReport report;
        const Sample after = swap_shapes(before, options, 7, report);
        EXPECT_LT(report.fine.mean, 0.1) << enclosure;
        EXPECT_LT(report.coarse.largest, 0.1) << enclosure;
        EXPECT_LT(report.kinetic_energy, 1e-8) << enclosure;
        EXPECT_EQ(after.period, before.period);
        EXPECT_EQ(after.size.head<2>(), before.size.head<2>());
        EXPECT_EQ(after.walls.size(), before.walls.size());
        EXPECT_EQ(cylinder(after) != nullptr, cylinder(before) != nullptr);
        for (std::size_t i = 0; i < after.particles.size(); ++i) {
            const Vec3 way = nearest_image(before, after.particles[i].position - before.particles[i].position);
            EXPECT_LT(way.norm(), 1e-3) << i;
            if (const Wall* side = cylinder(after)) {
                EXPECT_LT((after.particles[i].position - side->point).head<2>().norm(), side->radius) << i;
            }
        }
    }
}

TEST(SwapShapes, a_fine_in_a_filled_void_is_listed_and_moved_out_or_taken_out)
{
    Sample sample = packed();
    const auto host = std::find_if(sample.particles.begin(), sample.particles.end(), [](const Particle& p) { return p.role == Role::coarse; });
    Particle inside = sample.particles.back();
    inside.scale = 4e-4;
    inside.position = host->position + host->orientation * (host->scale * Vec3(0, 0, 6e-4));
    const auto fit = [&](bool drop) {
        Sample s = sample;
        s.particles.push_back(inside);
        SwapOptions options = coarse_to(ShapeKind::sh);
        options.drop_trapped = drop;
        SwapReport report;
        const Sample swapped = swap_shapes(s, options, 1, report);
        EXPECT_EQ(report.trapped, std::vector<int>{int(s.particles.size()) - 1});
        EXPECT_LT(report.kinetic_energy, 1e-8);
        return swapped;
    };
    EXPECT_EQ(fit(true).particles.size(), sample.particles.size());
    const Sample moved = fit(false);
    ASSERT_EQ(moved.particles.size(), sample.particles.size() + 1);
    EXPECT_GT((moved.particles.back().position - inside.position).norm(), 3e-4);
}

TEST(SwapShapes, a_fine_without_a_place_is_taken_out_or_refused)
{
    Sample sample = packed();
    Particle huge = sample.particles.back();
    ASSERT_EQ(huge.role, Role::fine);
    huge.scale *= 0.7 * sample.size.minCoeff() / equivalent_diameter(sample, huge);  // wherever it goes, coarse grains are in its way
    huge.position = 0.5 * sample.size;
    SwapOptions options = coarse_to(ShapeKind::sh);
    options.limit = 10;
    options.overlap_limit = 0.05;
    options.max_steps = 300;
    sample.particles.push_back(huge);
    SwapReport report;
    EXPECT_THROW(swap_shapes(sample, options, 1, report), coral::Error);
    options.drop_trapped = true;
    const Sample swapped = swap_shapes(sample, options, 1, report);
    std::vector<int> out = report.wedged;
    out.insert(out.end(), report.trapped.begin(), report.trapped.end());
    EXPECT_TRUE(std::ranges::find(out, int(sample.particles.size()) - 1) != out.end());
    EXPECT_EQ(swapped.particles.size(), sample.particles.size() - out.size());
    EXPECT_LE(report.after.largest, 0.05);
}

TEST(SwapShapes, a_fine_pushed_against_a_new_shape_does_not_end_inside_it)
{
    // A fine whose centre is just outside the new surface, and a larger one that overlaps it from outside.
    Sample sample = packed();
    const std::size_t host = std::size_t(std::ranges::find(sample.particles, Role::coarse, &Particle::role) - sample.particles.begin());
    SwapOptions options = coarse_to(ShapeKind::sh);
    options.limit = options.overlap_limit = 10;
    SwapReport report;
    const Sample replaced = replace_shapes(sample, options, 1, report);
    const Particle& grain = replaced.particles[host];
    const auto shape = make_shape(replaced.shapes[std::size_t(grain.shape)]);
    double out = 1e-3;
    while (grain.scale * shape->distance(Vec3(out, 0, 0)) < 2e-5) out += 1e-6;
    const Vec3 normal = grain.orientation * Vec3::UnitX(), surface = grain.position + grain.scale * out * normal;
    Particle small = sample.particles.back(), large = small;
    ASSERT_EQ(small.role, Role::fine);
    const double unit = equivalent_diameter(sample, small) / small.scale;
    small.scale = 0.4e-3 / unit;
    small.position = surface;
    large.scale = 1e-3 / unit;
    large.position = surface + 0.33e-3 * normal;
    sample.particles.insert(sample.particles.end(), {small, large});

    for (const bool drop : {false, true}) {
        options.drop_trapped = drop;
        const Sample swapped = swap_shapes(sample, options, 1, report);
        EXPECT_EQ(swapped.particles.size() + (drop ? report.trapped.size() : 0), sample.particles.size());
        int pressed = 0;
        for (const Particle& fine : swapped.particles) {
            if (fine.role != Role::fine) continue;
            for (const Particle& c : swapped.particles) {
                if (c.role != Role::coarse) continue;
                const double distance = c.scale * make_shape(swapped.shapes[std::size_t(c.shape)])->distance(c.orientation.conjugate() * (fine.position - c.position) / c.scale);
                EXPECT_GT(distance, 0);
                pressed += distance < 0.5 * equivalent_diameter(swapped, fine);
            }
        }
        EXPECT_GT(pressed, 0);
    }
}

TEST(SwapShapes, refuse_what_moves_the_skeleton_or_cannot_be_made)
{
    SwapReport report;
    SwapOptions options = coarse_to(ShapeKind::sphere);
    options.limit = 1e-6;
    EXPECT_THROW(swap_shapes(packed(), options, 1, report), coral::Error);
    EXPECT_THROW(swap_shapes(packed(), SwapOptions{}, 1, report), coral::UsageError);
    options = {};
    options.fine = ShapeKind::sphere;  // they are spheres
    EXPECT_THROW(swap_shapes(packed(), options, 1, report), coral::UsageError);
    EXPECT_THROW(swap_shapes(packed(), coarse_to(ShapeKind::level_set), 1, report), coral::UsageError);  // without a library
    const std::vector others{lopsided_capsule(5)};
    coral::sdf::write_grains(scratch("others.vdb"), others, {});
    options = coarse_to(ShapeKind::sh);
    options.library = scratch("others.vdb");
    EXPECT_THROW(swap_shapes(packed(), options, 1, report), coral::UsageError);
}
