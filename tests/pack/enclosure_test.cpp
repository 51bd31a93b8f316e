// Packings in a cylinder and in boxes that repeat themselves: walls, pressures, porosity, balance, the seam.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/output_file.h"
#include "core/progress.h"
#include "pack/criteria.h"
#include "pack/pack.h"
#include "pack/picture.h"
#include "pack/sample_world.h"
#include "pack/scratch.h"

using namespace coral::pack;
using Vec3 = Eigen::Vector3d;

namespace {

Spec spec_of(const std::string& text)
{
    coral::Progress::set_quiet(true);
    coral::write_text_file(scratch("enclosure.toml"), text);
    return read_spec(scratch("enclosure.toml"));
}

std::string error_of(const std::string& text)
{
    try {
        const Spec spec = spec_of(text);
        PackReport report;
        pack(spec, 1, report);
    } catch (const std::exception& error) {
        return error.what();
    }
    return "no error";
}

void expect_message(const std::string& text, const std::string& part)
{
    const std::string message = error_of(text);
    EXPECT_NE(message.find(part), std::string::npos) << "expected '" << part << "' in: " << message;
}

const std::string soft = "[material.default]\nnormal_stiffness = 2e4\ntangential_stiffness = 1e4\nfriction = 0.3\n";
const std::string grains = "[[population]]\nrole = \"coarse\"\ndiameters = [\"1.7mm\", \"2.3mm\"]\ncount = 50\n"
                           "[[population]]\nrole = \"fine\"\ndiameter = \"1mm\"\nmass_fraction = 0.1\n" + soft;
const std::string pressure = "[compression]\npressure = \"5kPa\"\n";
const std::string tube = "[cylinder]\ndiameter = \"9mm\"\nheight = \"14mm\"\n";
const std::string periodic = "[box]\nsize = [\"8mm\", \"9mm\", \"14mm\"]\nperiodic = [\"x\", \"y\"]\n";

Sample packed(const std::string& text, PackReport& report) { return pack(spec_of(text), 1, report); }

double weight_of(const Sample& s)
{
    double weight = 0;
    for (const Particle& p : s.particles) weight += 9.81 * mass(s, p);
    return weight;
}

/// Sum over the contacts of force times branch over the volume: the mean stress, pressure positive [Pa].
Eigen::Matrix3d stress(const Sample& s)
{
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const Contact& c : s.contacts) {
        const Vec3 force = c.normal_force + c.tangential_force;
        sum -= force * nearest_image(s, c.point - s.particles[std::size_t(c.first)].position).transpose();
        if (c.second >= 0) sum += force * nearest_image(s, c.point - s.particles[std::size_t(c.second)].position).transpose();
    }
    return sum / enclosed_volume(s);
}

}  // namespace

TEST(Enclosure, a_specification_names_a_cylinder_or_periodic_sides)
{
    const Spec cell = spec_of(tube + grains + pressure);
    EXPECT_TRUE(cell.cylinder);
    EXPECT_LT((cell.size - Vec3(9e-3, 9e-3, 14e-3)).norm(), 1e-15);
    EXPECT_EQ(cell.compression.walls, MovingWalls::platens);
    EXPECT_NEAR(base_area(cell), std::numbers::pi / 4 * 81e-6, 1e-18);
    const Spec endless = spec_of(periodic + grains + "[compression]\npressure = 1\nwalls = \"top\"\n");
    EXPECT_LT((endless.period - Vec3(8e-3, 9e-3, 0)).norm(), 1e-15);
    EXPECT_EQ(endless.compression.walls, MovingWalls::top);
    EXPECT_EQ(spec_of("[box]\nsize = [0.01, 0.01, 0.01]\nperiodic = [\"y\"]\n" + grains + pressure).compression.walls, MovingWalls::all);
}

TEST(Enclosure, errors_have_their_place)
{
    expect_message("[cylinder]\ndiametre = 0.009\nheight = 0.014\n" + grains, ":2:1: unknown key 'cylinder.diametre'");
    expect_message("[cylinder]\ndiameter = \"9kPa\"\nheight = 0.014\n" + grains, ":2:");
    expect_message("[cylinder]\ndiameter = 0\nheight = 0.014\n" + grains, ":2:1: key 'cylinder.diameter' must be greater than zero");
    expect_message(tube + "[box]\nsize = [1, 1, 1]\n" + grains, ":2:1: key 'cylinder.diameter' stands beside a [box]");
    expect_message(tube + grains + pressure + "walls = \"all\"\n", "the side of a cylinder does not move");
    expect_message(periodic + grains + pressure + "walls = \"all\"\n", "the side of a periodic box has no walls");
    expect_message("[box]\nsize = [1, 1, 1]\nperiodic = [\"z\"]\n" + grains, ":3:1: key 'box.periodic' has 'z'; grains fall along z");
    expect_message("[cylinder]\ndiameter = \"2mm\"\nheight = 0.1\n" + grains, "do not fit a cylinder of");
    expect_message("[cylinder]\ndiameter = \"5mm\"\nheight = \"10mm\"\n" + grains, "key 'cylinder.diameter': the grains fill");
    expect_message("[box]\nsize = [\"4mm\", \"9mm\", \"30mm\"]\nperiodic = [\"x\"]\n" + grains, "need a periodic side of twice that, and x has 0.004 m");
}

// The porosity of loose to dense spheres, more at walls 4.5 diameters apart: as in the box test of packing_test.cpp.
TEST(Enclosure, spheres_in_a_cylinder_are_in_balance_at_the_pressure_of_its_platens)
{
    PackReport report;
    const Sample s = packed(tube + grains + pressure, report);
    EXPECT_TRUE(report.compressed);
    EXPECT_TRUE(report.relaxed);
    ASSERT_EQ(s.walls.size(), 3u);
    const Wall &side = s.walls[0], &bottom = s.walls[1], &top = s.walls[2];
    EXPECT_EQ(side.name + bottom.name + top.name, "sidez-z+");
    EXPECT_NEAR(side.radius, 4.5e-3, 1e-15);
    EXPECT_LT((side.point - Vec3(4.5e-3, 4.5e-3, 0)).norm(), 1e-15);
    const double area = std::numbers::pi * 4.5e-3 * 4.5e-3;
    EXPECT_NEAR(enclosed_volume(s), area * s.size.z(), 1e-15);
    double solid = 0;
    for (const Particle& p : s.particles) {
        solid += volume(s, p);
        EXPECT_LT((p.position - side.point).head<2>().norm() + 0.5 * p.scale, side.radius + 0.01 * p.scale);
    }
    EXPECT_NEAR(s.statistics.porosity, 1 - solid / (area * s.size.z()), 1e-12);
    EXPECT_GT(1 - s.statistics.porosity, 0.48);
    EXPECT_LT(1 - s.statistics.porosity, 0.66);
    EXPECT_NEAR(0.5 * (top.pressure + bottom.pressure), 5e3, 0.03 * 5e3);
    EXPECT_NEAR((bottom.pressure - top.pressure) * area, weight_of(s), 0.02 * top.pressure * area) << "a smooth side carries nothing along z";
    EXPECT_GT(side.pressure, 0.2 * 5e3);
    EXPECT_LT(side.pressure, 1.1 * 5e3);
    const Eigen::Matrix3d mean = stress(s);
    EXPECT_NEAR(0.5 * (mean(0, 0) + mean(1, 1)), side.pressure, 0.02 * 5e3);
    EXPECT_NEAR(mean.trace() / 3, s.statistics.mean_pressure, 0.02 * 5e3);
    EXPECT_LT(s.statistics.unbalanced_ratio, 0.01);
    EXPECT_GT(s.statistics.coordination, 2.5);

    write_sample(s, scratch("tube.h5"));
    const Sample loaded = read_sample(scratch("tube.h5"));
    ASSERT_NE(cylinder(loaded), nullptr);
    EXPECT_EQ(cylinder(loaded)->radius, side.radius);
    EXPECT_EQ(loaded.period, Vec3(Vec3::Zero()));
    coral::dem::World world(world_options(loaded));
    const SampleIds ids = add_sample(world, loaded);
    restore_springs(world, loaded, ids);
    EXPECT_EQ(world.contacts().size(), s.contacts.size());
    EXPECT_THROW(refuse_cylinder(loaded, "this test"), coral::Error);
}

TEST(Enclosure, polyhedra_in_a_cylinder_under_the_top_alone)
{
    PackReport report;
    const Sample s = packed("[cylinder]\ndiameter = \"11mm\"\nheight = \"14mm\"\n"
                            "[[population]]\nrole = \"coarse\"\nshape = \"polyhedron\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0.8]]\n"
                            "diameter = \"3mm\"\ncount = 10\nsurface_nodes = 250\n" + soft +
                            "[dropping]\ntime_limit = \"60ms\"\n[compression]\npressure = \"5kPa\"\nwalls = \"top\"\nunbalanced_ratio = 0.03\n", report);
    EXPECT_TRUE(report.compressed);
    EXPECT_NEAR(s.walls[2].pressure, 5e3, 0.1 * 5e3);
    EXPECT_EQ(s.walls[1].point.z(), 0);
    EXPECT_NEAR(s.size.x(), 11e-3, 1e-15);
    EXPECT_GT(s.walls[0].pressure, 0);
    const double area = std::numbers::pi * 5.5e-3 * 5.5e-3;
    EXPECT_NEAR((s.walls[1].pressure - s.walls[2].pressure) * area, weight_of(s), 0.05 * s.walls[2].pressure * area);
    for (const Particle& p : s.particles) EXPECT_LT((p.position - s.walls[0].point).head<2>().norm(), 5.5e-3);
}

TEST(Enclosure, a_periodic_sample_has_no_sides_and_is_the_same_wherever_it_is_cut)
{
    PackReport report;
    const Sample s = packed(periodic + grains + pressure, report);
    EXPECT_TRUE(report.compressed);
    EXPECT_TRUE(report.relaxed);
    ASSERT_EQ(s.walls.size(), 2u);
    EXPECT_LT((s.period - Vec3(8e-3, 9e-3, 0)).norm(), 1e-15);
    EXPECT_EQ(s.size.head<2>(), s.period.head<2>());
    EXPECT_GT(1 - s.statistics.porosity, 0.5) << "no pores at side walls";
    EXPECT_LT(1 - s.statistics.porosity, 0.66);
    EXPECT_NEAR((s.walls[0].pressure - s.walls[1].pressure) * 72e-6, weight_of(s), 0.02 * 5e3 * 72e-6);
    EXPECT_NEAR(stress(s)(2, 2), 0.5 * (s.walls[0].pressure + s.walls[1].pressure), 0.02 * 5e3);
    int seam = 0;
    for (const Contact& c : s.contacts) {
        if (c.second < 0) continue;
        const Particle &a = s.particles[std::size_t(c.first)], &b = s.particles[std::size_t(c.second)];
        seam += (a.position - b.position).norm() > 4e-3;
        EXPECT_LT(nearest_image(s, a.position - b.position).norm(), 0.5 * (a.scale + b.scale));
        EXPECT_LT(nearest_image(s, c.point - a.position).norm(), 0.51 * a.scale);
        EXPECT_LT((c.point - a.position).norm(), 0.51 * a.scale) << "the point lies beside the first grain";
    }
    EXPECT_GT(seam, 5);
    for (const Particle& p : s.particles) {
        EXPECT_TRUE((p.position.head<2>().array() >= 0).all());
        EXPECT_TRUE((p.position.head<2>().array() < s.size.head<2>().array()).all());
    }

    // cut elsewhere: the same neighbours, forces and criteria
    write_sample(s, scratch("endless.h5"));
    Sample moved = read_sample(scratch("endless.h5"));
    EXPECT_EQ(moved.period, s.period);
    for (Particle& p : moved.particles)
        for (int axis = 0; axis < 2; ++axis) p.position[axis] = std::fmod(p.position[axis] + (axis == 0 ? 3.1e-3 : 5.7e-3), s.period[axis]);
    const auto contacts_of = [](const Sample& sample) {
        coral::dem::World world(world_options(sample));
        restore_springs(world, sample, add_sample(world, sample));
        return world.contacts();
    };
    const auto here = contacts_of(s), there = contacts_of(moved);
    ASSERT_EQ(here.size(), there.size());
    ASSERT_EQ(here.size(), s.contacts.size());
    double largest = 0;
    for (const Contact& c : here) largest = std::max(largest, c.normal_force.norm());
    for (std::size_t i = 0; i < here.size(); ++i) {
        EXPECT_EQ(std::pair(here[i].first, here[i].second), std::pair(there[i].first, there[i].second));
        EXPECT_LT((here[i].normal_force - there[i].normal_force).norm(), 1e-9 * largest);
    }
    moved.contacts = there;
    Sample again = s;
    again.contacts = here;
    EXPECT_NEAR(fines_stress_ratio(moved), fines_stress_ratio(again), 1e-9);
}

TEST(Enclosure, a_periodic_sample_asks_for_a_world_that_repeats_itself_alike)
{
    Sample sample;
    sample.shapes = {unit_sphere()};
    sample.materials.resize(1);
    sample.size = sample.period = {0.01, 0.02, 0};
    coral::dem::WorldOptions options;
    coral::dem::World without(options);
    EXPECT_THROW(add_sample(without, sample), coral::Error);
    options.period = {0.01, 0.03, 0};
    coral::dem::World other(options);
    try {
        add_sample(other, sample);
        FAIL() << "another length was taken";
    } catch (const coral::Error& error) {
        EXPECT_NE(std::string(error.what()).find("repeats itself along y after 0.02 m"), std::string::npos) << error.what();
    }
    coral::dem::World same(world_options(sample));
    EXPECT_NO_THROW(add_sample(same, sample));
}

TEST(Enclosure, a_grain_across_the_seam_is_drawn_at_both_ends)
{
    Sample sample;
    sample.size = {0.02, 0.02, 0.02};
    sample.shapes = {unit_sphere()};
    sample.materials.resize(1);
    Particle p;
    p.position = {0.0, 0.015, 0.01};
    p.scale = 0.005;
    p.role = Role::fine;
    sample.particles = {p};
    const auto coloured = [&] {
        const Picture picture = draw_sample(sample, 200);
        int count = 0;
        for (std::size_t i = 0; i < picture.rgb.size(); i += 3) count += picture.rgb[i] < 250;
        return double(count) / picture.width / picture.width;
    };
    const double one = coloured();
    sample.period.x() = 0.02;
    const double two = coloured();  // the frame is wider by the half that reaches out
    EXPECT_GT(two, 1.6 * one);
    EXPECT_LT(two, 2.1 * one);
}
