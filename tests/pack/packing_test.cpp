#include "pack/pack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/output_file.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "pack/detail/phases.h"
#include "pack/populations.h"
#include "pack/sample_world.h"
#include "pack/scratch.h"
#include "sdf/mass_properties.h"
#include "sdf/vdb_io.h"

using namespace coral::pack;
using coral::pack::detail::servo_share;
using coral::pack::detail::servo_speed;

namespace {

Spec spec_of(const std::string& text)
{
    coral::write_text_file(scratch("spec.toml"), text);
    return read_spec(scratch("spec.toml"));
}

/// 60 spheres of about 2 mm in a box of 8 x 8 mm, pressed at 5 kPa.
const std::string spheres =
    "[box]\nsize = [\"8mm\", \"8mm\", \"12mm\"]\n"
    "[[population]]\nrole = \"coarse\"\ndiameters = [\"1.7mm\", \"2.3mm\"]\ncount = 60\n"
    "[material.default]\nnormal_stiffness = 2e4\ntangential_stiffness = 1e4\nfriction = 0.3\n"
    "[compression]\npressure = \"5kPa\"\n";

Sample packed(const std::string& text, std::uint64_t seed, PackReport& report)
{
    coral::Progress::set_quiet(true);
    return pack(spec_of(text), seed, report);
}

/// Capsule of radius r along z with a closed spherical void in the middle; the distance is exact near the surfaces.
coral::sdf::GrainLevelSet hollow_capsule(int id, double r, double half_length, double void_radius, double spacing)
{
    coral::sdf::GrainLevelSet grain;
    grain.id = id;
    grain.label = std::uint32_t(id);
    coral::sdf::DistanceGrid& g = grain.solid;
    const Eigen::Vector3d half(r + 6 * spacing, r + 6 * spacing, r + half_length + 6 * spacing);
    g.spacing = spacing;
    g.size = (2 * half / spacing).array().ceil().cast<int>() + 1;
    g.origin = -0.5 * spacing * (g.size.array() - 1).cast<double>();
    g.outside_limit = 5 * spacing;
    g.inside_limit = 5 * spacing;
    grain.apparent = g;
    for (int k = 0; k < g.size.z(); ++k)
        for (int j = 0; j < g.size.y(); ++j)
            for (int i = 0; i < g.size.x(); ++i) {
                const Eigen::Vector3d x = g.node(i, j, k);
                const double outer = (x - Eigen::Vector3d(0, 0, std::clamp(x.z(), -half_length, half_length))).norm() - r;
                const auto clamped = [&](double d) { return float(std::clamp(d, -5 * spacing, 5 * spacing)); };
                g.distance.push_back(clamped(std::max(outer, void_radius - x.norm())));
                grain.apparent.distance.push_back(clamped(outer));
            }
    const auto properties = coral::sdf::mass_properties(g);
    grain.volume = properties.volume;
    grain.inertia = properties.inertia;
    grain.apparent_volume = coral::sdf::solid_volume(grain.apparent);
    grain.equivalent_diameter = std::cbrt(6 * grain.apparent_volume / std::numbers::pi);
    grain.intraparticle_porosity = 1 - grain.volume / grain.apparent_volume;
    return grain;
}

}  // namespace

/// A column whose pressure answers the walls many times as strongly as contacts of spheres would.
TEST(Servo, comes_to_rest_on_sides_much_stiffer_than_it_thinks)
{
    constexpr double area = 1e-4, gap = 5e-3, stiffness = 2e4, mass = 4e-4, between_looks = 1.5e-4, wanted = 5e3;
    for (const double stiffer : {0.5, 1.0, 4.0, 30.0, 300.0}) {
        ServoGain gain;
        double pressure = 0, worst = 0;
        for (int look = 0; look < 3000; ++look) {
            const double missing = wanted - pressure;
            if (look >= 2500) worst = std::max(worst, std::abs(missing));
            const double speed = servo_share(gain, missing, 0.02 * wanted) * servo_speed(missing, area, gap, 4, stiffness, mass, 1.0);
            const double layers = gap / std::sqrt(area / 4);
            pressure = std::max(0.0, pressure + 2 * speed * between_looks * stiffer * 4 * stiffness / std::max(layers, 1.0) / area);
        }
        EXPECT_LT(worst, 0.04 * wanted) << stiffer;
    }
}

TEST(Populations, meet_a_mass_fraction_to_half_a_grain)
{
    const Spec spec = spec_of("[box]\nsize = [0.06, 0.06, 0.1]\n[[population]]\nrole = \"coarse\"\ndiameter = \"15mm\"\ncount = 20\n"
                              "[[population]]\nrole = \"fine\"\ndiameters = [\"1.5mm\", \"3mm\"]\nmass_fraction = 0.3\n");
    const Sample s = make_grains(spec, 5).sample;
    double fines = 0, all = 0, mean = 0, count = 0, largest = 0;
    for (const Particle& p : s.particles) {
        all += mass(s, p);
        if (p.role != Role::fine) continue;
        fines += mass(s, p);
        mean += p.scale;
        count += 1;
        largest = std::max(largest, mass(s, p));
        EXPECT_GE(p.scale, 1.5e-3);
        EXPECT_LE(p.scale, 3e-3);
    }
    EXPECT_NEAR(fines, 0.3 * all, 0.5 * largest);
    EXPECT_NEAR(mean / count, 2.25e-3, 4 * 0.433e-3 / std::sqrt(count));  // even by number: mean and deviation (b - a)/sqrt(12)
    ASSERT_EQ(s.shapes.size(), 1u);  // all spheres share the unit template
}

TEST(Populations, follow_a_gradation_by_mass)
{
    const Spec spec = spec_of("[box]\nsize = [0.5, 0.5, 0.5]\n[[population]]\nrole = \"fine\"\ncount = 20000\n"
                              "psd = { size = [\"1mm\", \"2mm\", \"4mm\"], passing = [0, \"25%\", 1] }\n");
    const Sample s = make_grains(spec, 5).sample;
    double below = 0, all = 0;
    for (const Particle& p : s.particles) {
        all += mass(s, p);
        if (p.scale <= 2e-3) below += mass(s, p);
    }
    EXPECT_NEAR(below / all, 0.25, 0.01);
}

TEST(Populations, refuse_more_grains_than_a_box_can_hold)
{
    const Spec spec = spec_of("[box]\nsize = [0.01, 0.01, 0.01]\n[[population]]\nrole = \"coarse\"\ndiameter = \"2mm\"\ncount = 200\n");
    try {
        make_grains(spec, 1);
        FAIL() << "200 grains of 2 mm in a box of 10 mm";
    } catch (const coral::UsageError& error) {
        EXPECT_NE(std::string(error.what()).find("spec.toml:2:1: key 'box.size': the grains fill 83 % of the box"), std::string::npos) << error.what();
    }
}

TEST(Populations, name_the_place_of_a_grain_that_the_file_does_not_have)
{
    coral::sdf::write_grains(scratch("one.vdb"), std::vector{hollow_capsule(1, 1.5e-3, 1e-3, 0.8e-3, 3e-4)}, {{"test", "1", {}, {}}});
    const Spec spec = spec_of("[box]\nsize = [0.02, 0.02, 0.02]\n[[population]]\nrole = \"coarse\"\nshape = \"level-set\"\nfile = \"one.vdb\"\ngrains = [1, 7]\ncount = 2\n");
    try {
        make_grains(spec, 1);
        FAIL() << "the file has no grain 7";
    } catch (const coral::UsageError& error) {
        EXPECT_NE(std::string(error.what()).find("spec.toml:6:1: population 'coarse1' asks for grain 7"), std::string::npos) << error.what();
    }
}

// A level set that is solid up to the border of its lattice has no surface there to touch.
TEST(Populations, refuse_a_grain_without_a_closed_surface)
{
    coral::sdf::GrainLevelSet grain = hollow_capsule(1, 1.5e-3, 1e-3, 0.8e-3, 3e-4);
    coral::sdf::DistanceGrid& g = grain.solid;
    const int cut = g.size.z() / 2;  // the upper half goes
    g.distance.resize(std::size_t(g.size.x()) * std::size_t(g.size.y()) * std::size_t(cut));
    g.size.z() = cut;
    coral::sdf::write_grains(scratch("open.vdb"), std::vector{grain}, {});
    const Spec spec = spec_of("[box]\nsize = [0.02, 0.02, 0.02]\n[[population]]\nrole = \"coarse\"\nshape = \"level-set\"\nfile = \"open.vdb\"\ncount = 2\n");
    try {
        make_grains(spec, 1);
        FAIL() << "the surface of the grain is open";
    } catch (const coral::UsageError& error) {
        EXPECT_NE(std::string(error.what()).find("spec.toml:6:1: grain 1 of open.vdb has no closed surface"), std::string::npos) << error.what();
    }
}

namespace {

std::string failure_of(const std::string& text)
{
    PackReport report;
    try {
        packed(text, 1, report);
    } catch (const coral::Error& error) {
        return error.what();
    }
    return "no error";
}

}  // namespace

// The lightest of the spheres weighs 7.2 mg: its critical step is sqrt(m/(2 kn)) = 13.4 us.
TEST(Packing, refuses_a_step_above_the_critical_one_unless_forced)
{
    const std::string message = failure_of(spheres + "[time]\ndem_step = \"50us\"\n");
    EXPECT_NE(message.find("spec.toml:14:1: key 'time.dem_step': 50 us is above 1.5 of the critical step, 13.4579 us of the lightest grain"), std::string::npos) << message;
    EXPECT_NE(message.find("force_step = true"), std::string::npos) << message;
    Spec spec = spec_of(spheres + "[time]\ndem_step = \"25us\"\nforce_step = true\n");
    spec.dropping.time_limit = 1e-3;
    spec.compression.target = CompressionTarget::none;
    spec.compression.relaxation_limit = 1e-3;
    PackReport report;
    EXPECT_NO_THROW(pack(spec, 1, report));
}

// Contacts ten million times too soft hold nothing: the first grain through the floor stops the packing.
TEST(Packing, stops_at_a_grain_that_left_the_box_and_names_it)
{
    const std::string message = failure_of(spheres + "[dropping]\nstiffness_factor = 1e-7\n");
    EXPECT_NE(message.find("pouring: grain "), std::string::npos) << message;
    EXPECT_NE(message.find("left the box through the wall z- at "), std::string::npos) << message;
    EXPECT_NE(message.find("(coarse, "), std::string::npos) << message;
}

// A tetrahedron with three edges a along the axes has a^3/6, an ellipsoid 4/3 pi a b c.
TEST(Populations, draw_polyhedra_and_superellipsoids)
{
    coral::write_text_file(scratch("wedge.stl"),
                           "solid wedge\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 6 0\nvertex 6 0 0\nendloop\nendfacet\n"
                           "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 6 0 0\nvertex 0 0 6\nendloop\nendfacet\n"
                           "facet normal -1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 6\nvertex 0 6 0\nendloop\nendfacet\n"
                           "facet normal 1 1 1\nouter loop\nvertex 6 0 0\nvertex 0 6 0\nvertex 0 0 6\nendloop\nendfacet\nendsolid wedge\n");
    coral::write_text_file(scratch("large.stl"), [] {
        std::string text = coral::read_text_file(scratch("wedge.stl"));
        for (auto at = text.find('6'); at != std::string::npos; at = text.find('6', at)) text[at] = '9';
        return text;
    }());
    const Spec spec = spec_of("[box]\nsize = [0.05, 0.05, 0.05]\n"
                              "[[population]]\nrole = \"coarse\"\nshape = \"polyhedron\"\nfile = [\"wedge.stl\", \"large.stl\"]\nunit = \"mm\"\nscale = 2\ncount = 10\nsurface_nodes = 500\n"
                              "[[population]]\nrole = \"fine\"\nshape = \"superellipsoid\"\nradii = [\"3mm\", \"2mm\", \"1mm\"]\ndiameter = \"2mm\"\ncount = 4\n"
                              "surface_nodes = 500\ngrid_spacing = \"0.2mm\"\n");
    const Sample s = make_grains(spec, 3).sample;
    ASSERT_EQ(s.shapes.size(), 3u);
    int large = 0;
    for (std::size_t i = 0; i < 10; ++i) {
        const double v = volume(s, s.particles[i]);
        if (v > 5e-7) ++large;
        EXPECT_NEAR(v, v > 5e-7 ? 18e-3 * 18e-3 * 18e-3 / 6 : 12e-3 * 12e-3 * 12e-3 / 6, 1e-15);
        EXPECT_EQ(s.particles[i].scale, 2);
    }
    EXPECT_EQ(large, 5);  // every shape once before any is used again
    const ShapeTemplate& ellipsoid = s.shapes[2];
    EXPECT_EQ(ellipsoid.kind, ShapeKind::superellipsoid);
    EXPECT_NEAR(ellipsoid.volume, 4.0 / 3 * std::numbers::pi * 6e-9, 1e-18);
    for (std::size_t i = 10; i < 14; ++i) EXPECT_NEAR(equivalent_diameter(s, s.particles[i]), 2e-3, 1e-12);
}

// Random close packing of spheres is 0.64 solid, random loose 0.55 (packing_fractions.csv); smooth walls four diameters apart leave
// extra pores, so the band reaches lower.
TEST(Packing, of_spheres_is_dense_and_in_balance_at_its_pressure)
{
    PackReport report;
    const Sample s = packed(spheres, 1, report);
    EXPECT_TRUE(report.compressed);
    EXPECT_TRUE(report.relaxed);
    EXPECT_EQ(s.particles.size(), 60u);
    EXPECT_GT(1 - s.statistics.porosity, 0.48);
    EXPECT_LT(1 - s.statistics.porosity, 0.66);
    EXPECT_LT(s.statistics.unbalanced_ratio, 0.01);
    EXPECT_LT(s.statistics.kinetic_ratio, 1e-4);
    EXPECT_GT(s.statistics.coordination, 3.0);
    EXPECT_LT(s.statistics.coordination, 6.5);
    for (const Wall& wall : s.walls) EXPECT_NEAR(wall.pressure, 5e3, 0.1 * 5e3) << wall.name;
    double weight = 0;
    for (const Particle& p : s.particles) {
        weight += 9.81 * mass(s, p);
        EXPECT_GT(p.position.minCoeff(), 0);
        EXPECT_TRUE((p.position.array() < s.size.array()).all());
    }
    const double bottom = s.walls[4].pressure * s.size.x() * s.size.y(), top = s.walls[5].pressure * s.size.x() * s.size.y();
    EXPECT_NEAR(bottom - top, weight, 0.02 * top);  // smooth side walls carry nothing
    EXPECT_EQ(s.walls[4].point.z(), 0);
    // forces times branch vectors over all grains are the mean stress: the pressure of the walls
    double work = 0;
    for (const Contact& c : s.contacts) {
        const Eigen::Vector3d force = c.normal_force + c.tangential_force;
        work -= force.dot(c.point - s.particles[std::size_t(c.first)].position);
        if (c.second >= 0) work += force.dot(c.point - s.particles[std::size_t(c.second)].position);
    }
    EXPECT_NEAR(work / (3 * s.size.prod()), s.statistics.mean_pressure, 0.02 * s.statistics.mean_pressure);
}

TEST(Packing, is_the_same_for_any_number_of_threads_and_another_for_another_seed)
{
    PackReport report;
    coral::set_thread_count(1);
    write_sample(packed(spheres, 1, report), scratch("one.h5"));
    coral::set_thread_count(2);
    write_sample(packed(spheres, 1, report), scratch("two.h5"));
    EXPECT_EQ(coral::read_text_file(scratch("one.h5")), coral::read_text_file(scratch("two.h5")));
    const auto layout = [](std::uint64_t seed) {
        Spec spec = spec_of(spheres);
        spec.dropping.time_limit = 1e-3;
        spec.compression.target = CompressionTarget::none;
        spec.compression.relaxation_limit = 1e-3;
        PackReport other;
        return pack(spec, seed, other).particles[0].position;
    };
    EXPECT_EQ(layout(1), layout(1));
    EXPECT_NE(layout(1), layout(2));
}

TEST(Packing, reaches_a_void_ratio)
{
    PackReport report;
    const Sample s = packed(spheres.substr(0, spheres.find("[compression]")) + "[compression]\nvoid_ratio = 0.8\nwalls = \"top\"\n", 1, report);
    EXPECT_TRUE(report.compressed);
    EXPECT_NEAR(s.statistics.interparticle_void_ratio, 0.8, 1e-3);
    EXPECT_NEAR(s.size.x(), 8e-3, 1e-12);
    EXPECT_NEAR(s.size.y(), 8e-3, 1e-12);
}

TEST(Packing, goes_on_in_another_world_where_it_stopped)
{
    PackReport report;
    const Sample s = packed(spheres, 1, report);
    write_sample(s, scratch("sample.h5"));
    const Sample loaded = read_sample(scratch("sample.h5"));
    coral::dem::WorldOptions options;
    options.gravity = loaded.gravity;
    coral::dem::World world(options);
    const SampleIds ids = add_sample(world, loaded);
    restore_springs(world, loaded, ids);
    const auto contacts = world.contacts();
    ASSERT_EQ(contacts.size(), s.contacts.size());
    double largest = 0;
    for (const auto& c : s.contacts) largest = std::max(largest, c.normal_force.norm());
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        EXPECT_EQ(contacts[i].first, s.contacts[i].first);
        EXPECT_EQ(contacts[i].second, s.contacts[i].second);
        EXPECT_LT((contacts[i].normal_force - s.contacts[i].normal_force).norm(), 1e-3 * largest);
        EXPECT_LT((contacts[i].tangential_force - s.contacts[i].tangential_force).norm(), 1e-2 * largest);
    }
    constexpr double time = 1e-3;
    world.advance(time);
    for (std::size_t i = 0; i < s.particles.size(); ++i) {
        const double fall = s.particles[i].velocity.norm() * time + 0.5 * 9.81 * time * time;  // of a grain that nothing holds
        EXPECT_LT((world.position(ids.bodies[i]) - s.particles[i].position).norm(), fall + 1e-3 * 2e-3);
    }
}

TEST(Packing, of_polyhedra_and_ellipsoids_is_in_balance_and_is_read_back)
{
    PackReport report;
    const Sample s = packed(
        "[box]\nsize = [\"10mm\", \"10mm\", \"14mm\"]\n"
        "[[population]]\nrole = \"coarse\"\nshape = \"polyhedron\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0.8]]\ndiameter = \"3mm\"\ncount = 5\nsurface_nodes = 250\n"
        "[[population]]\nrole = \"fine\"\nshape = \"superellipsoid\"\nradii = [1, 0.8, 0.7]\nexponents = [0.8, 0.9]\ndiameter = \"1.8mm\"\nmass_fraction = 0.3\nsurface_nodes = 250\ngrid_spacing = 0.06\n"
        "[material.default]\nnormal_stiffness = 2e4\ntangential_stiffness = 1e4\n[density]\ne_min = 0.1\ne_max = 3\n"
        "[dropping]\ntime_limit = \"60ms\"\n[compression]\npressure = \"5kPa\"\nwalls = \"top\"\nunbalanced_ratio = 0.03\n", 2, report);
    EXPECT_TRUE(report.compressed);
    EXPECT_NEAR(s.statistics.fines_content, 0.3, 0.05);
    EXPECT_LT(s.statistics.unbalanced_ratio, 0.03);
    EXPECT_NEAR(s.walls[5].pressure, 5e3, 0.1 * 5e3);
    EXPECT_NEAR(report.relative_density, (3 - s.statistics.void_ratio) / 2.9, 1e-12);
    write_sample(s, scratch("angular.h5"));
    const Sample loaded = read_sample(scratch("angular.h5"));
    EXPECT_EQ(loaded.shapes[0].vertices, s.shapes[0].vertices);
    EXPECT_EQ(loaded.shapes[1].radii, s.shapes[1].radii);
    EXPECT_EQ(loaded.criteria.back().name, "skempton-brogan");
    EXPECT_GT(loaded.criteria.back().value, 0);
}

// Hollow capsules with fines: the level-set path from .vdb to a sample in balance.
TEST(Packing, of_hollow_level_set_grains_and_fines_is_in_balance)
{
    const auto grain = hollow_capsule(1, 1.5e-3, 1e-3, 0.8e-3, 1.5e-4);
    coral::sdf::write_grains(scratch("capsule.vdb"), std::vector{grain}, {{"test", "1", {}, {}}});
    PackReport report;
    const Sample s = packed(
        "[box]\nsize = [\"10mm\", \"10mm\", \"14mm\"]\n"
        "[[population]]\nrole = \"coarse\"\nshape = \"level-set\"\nfile = \"capsule.vdb\"\ndiameter = \"3.6mm\"\ncount = 6\nsurface_nodes = 800\n"
        "[[population]]\nrole = \"fine\"\ndiameter = \"1.1mm\"\nmass_fraction = 0.3\n"
        "[material.default]\nnormal_stiffness = 2e4\ntangential_stiffness = 1e4\n"
        "[dropping]\ntime_limit = \"60ms\"\n[compression]\npressure = \"5kPa\"\nwalls = \"top\"\nunbalanced_ratio = 0.03\n", 2, report);
    EXPECT_TRUE(report.compressed);
    EXPECT_TRUE(report.relaxed);
    EXPECT_NEAR(s.statistics.fines_content, 0.3, 0.01);
    EXPECT_LT(s.statistics.unbalanced_ratio, 0.03);
    EXPECT_NEAR(s.walls[5].pressure, 5e3, 0.1 * 5e3);
    EXPECT_GT(s.statistics.porosity, s.statistics.interparticle_porosity);
    EXPECT_GT(s.statistics.porosity, 0.35);
    EXPECT_LT(s.statistics.porosity, 0.70);
    EXPECT_GT(s.statistics.coordination_coarse_fine, 1);
    EXPECT_LT(s.statistics.max_overlap, 0.02);
    EXPECT_NEAR(equivalent_diameter(s, s.particles[0]), 3.6e-3, 1e-9);
    EXPECT_EQ(s.history.size(), 1u);
    // pores between the apparent shapes plus voids inside give all pores
    double voids = 0;
    for (const Particle& p : s.particles) voids += apparent_volume(s, p) - volume(s, p);
    EXPECT_NEAR(s.statistics.porosity - s.statistics.interparticle_porosity, voids / s.size.prod(), 1e-12);
}
