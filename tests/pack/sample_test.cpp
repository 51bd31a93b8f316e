#include "pack/sample.h"
#include "pack/scratch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>

#include "core/error.h"
#include "core/hdf5.h"
#include "core/output_file.h"
#include "dem/superellipsoid.h"
#include "pack/sample_world.h"

using namespace coral::pack;

namespace {

/// A sample whose every number is different and awkward.
Sample awkward_sample()
{
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto vector = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
    Sample s;
    s.size = {0.1, 1.0 / 3, 0.2};
    s.gravity = {0.1, 0, -9.80665};
    s.shapes = {unit_sphere(), {}, {}, {}, {}};
    for (int k : {1, 2, 3, 4}) {
        ShapeTemplate& t = s.shapes[std::size_t(k)];
        t.kind = k == 1 ? ShapeKind::level_set : k == 2 ? ShapeKind::sh : k == 3 ? ShapeKind::polyhedron : ShapeKind::superellipsoid;
        t.name = "grains.vdb grain_" + std::to_string(k);
        t.volume = 1.0 / 7;
        t.apparent_volume = 0.3;
        t.equivalent_diameter = 0.7;
        t.inertia << 1, 0.1, 0.2, 0.1, 2, 0.3, 0.2, 0.3, 3;
        auto grid = std::make_shared<coral::sdf::DistanceGrid>();
        grid->size = {3, 2, 4};
        grid->origin = vector();
        grid->spacing = 1.0 / 9;
        for (int i = 0; i < 24; ++i) grid->distance.push_back(float(uniform(random)));
        t.grid = grid;
        if (k == 1) {
            auto filled = std::make_shared<coral::sdf::DistanceGrid>(*grid);
            filled->outside_limit = 0.3;
            t.apparent_grid = filled;
        } else if (k == 2) {
            t.degree = 1;
            t.coefficients = {uniform(random), uniform(random), 0, uniform(random)};
            t.centre = vector();
        } else if (k == 3) {
            t.grid = nullptr;
            for (int i = 0; i < 9; ++i) t.vertices.push_back(vector());
        } else {
            t.radii = {1.0 / 3, 0.2, 0.1};
            t.exponents = {0.7, 1.0 / 7};
        }
        for (int i = 0; i < 5; ++i) t.nodes.push_back(vector()), t.node_areas.push_back(uniform(random));
    }
    s.materials = {{"default", 2780, 2e5, 1e5, 0.7, 0.3}, {"shell", 2650.5, 1e5, 7e4, 0.2, 0.1}};
    for (int i = 0; i < 7; ++i)
        s.particles.push_back({vector(), Eigen::Quaterniond(Eigen::AngleAxisd(uniform(random), vector().normalized())), vector(), vector(),
                               i % 5, 1e-3 * (i + 1) / 3, i % 2 ? Role::fine : Role::coarse, i % 2});
    s.walls = {{"z-", vector(), Eigen::Vector3d::UnitZ(), 0.1, 49999.5}, {"z+", vector(), -Eigen::Vector3d::UnitZ(), 0, 1.0 / 3}};
    s.contacts = {{0, 3, vector(), vector(), vector(), vector(), 1e-7, 1}, {2, -2, vector(), vector(), vector(), vector(), 1e-9, 12}};
    s.springs = {{0, 3, 0, vector(), Eigen::Vector3d::Zero()}, {2, -2, 4711, vector(), vector()}};
    s.psd = {{1e-3, 0}, {2e-3, 1.0 / 3}, {2e-3, 1}};
    s.criteria = {{"kezdi", 5.0, 4, "unstable", "a definition"}, {"mao", std::numeric_limits<double>::quiet_NaN(), 1, "not applicable", "another"}};
    s.statistics.porosity = 0.456;
    s.statistics.gap_ratio = std::numeric_limits<double>::quiet_NaN();
    s.history = {{"csct2ls", "0.1.0", {{"spacing", "200 um"}}, {"ct.tif"}}, {"pack-sample", "0.1.0", {{"seed", "7"}}, {"spec.toml"}}};
    return s;
}

void expect_same_grid(const coral::sdf::DistanceGrid* a, const coral::sdf::DistanceGrid* b)
{
    ASSERT_EQ(a == nullptr, b == nullptr);
    if (!a) return;
    EXPECT_EQ(a->size, b->size);
    EXPECT_EQ(a->origin, b->origin);
    EXPECT_EQ(a->spacing, b->spacing);
    EXPECT_EQ(a->distance, b->distance);
    EXPECT_EQ(a->outside_limit, b->outside_limit);
    EXPECT_EQ(a->inside_limit, b->inside_limit);
}

}  // namespace

TEST(SampleFile, comes_back_bit_for_bit)
{
    const Sample s = awkward_sample();
    const auto file = scratch("sample.h5");
    write_sample(s, file);
    const Sample t = read_sample(file);
    for (const ShapeTemplate& shape : read_sample(file, SampleDetail::without_apparent_grids).shapes) EXPECT_FALSE(shape.apparent_grid);
    EXPECT_EQ(t.size, s.size);
    EXPECT_EQ(t.gravity, s.gravity);
    ASSERT_EQ(t.shapes.size(), s.shapes.size());
    for (std::size_t k = 0; k < s.shapes.size(); ++k) {
        EXPECT_EQ(t.shapes[k].kind, s.shapes[k].kind);
        EXPECT_EQ(t.shapes[k].name, s.shapes[k].name);
        EXPECT_EQ(t.shapes[k].volume, s.shapes[k].volume);
        EXPECT_EQ(t.shapes[k].apparent_volume, s.shapes[k].apparent_volume);
        EXPECT_EQ(t.shapes[k].equivalent_diameter, s.shapes[k].equivalent_diameter);
        EXPECT_EQ(t.shapes[k].inertia, s.shapes[k].inertia);
        EXPECT_EQ(t.shapes[k].nodes, s.shapes[k].nodes);
        EXPECT_EQ(t.shapes[k].node_areas, s.shapes[k].node_areas);
        EXPECT_EQ(t.shapes[k].coefficients, s.shapes[k].coefficients);
        EXPECT_EQ(t.shapes[k].centre, s.shapes[k].centre);
        EXPECT_EQ(t.shapes[k].vertices, s.shapes[k].vertices);
        EXPECT_EQ(t.shapes[k].radii, s.shapes[k].radii);
        EXPECT_EQ(t.shapes[k].exponents, s.shapes[k].exponents);
        expect_same_grid(t.shapes[k].grid.get(), s.shapes[k].grid.get());
        expect_same_grid(t.shapes[k].apparent_grid.get(), s.shapes[k].apparent_grid.get());
    }
    ASSERT_EQ(t.particles.size(), s.particles.size());
    for (std::size_t i = 0; i < s.particles.size(); ++i) {
        EXPECT_EQ(t.particles[i].position, s.particles[i].position);
        EXPECT_EQ(t.particles[i].orientation.coeffs(), s.particles[i].orientation.coeffs());
        EXPECT_EQ(t.particles[i].velocity, s.particles[i].velocity);
        EXPECT_EQ(t.particles[i].angular_velocity, s.particles[i].angular_velocity);
        EXPECT_EQ(t.particles[i].shape, s.particles[i].shape);
        EXPECT_EQ(t.particles[i].scale, s.particles[i].scale);
        EXPECT_EQ(t.particles[i].role, s.particles[i].role);
        EXPECT_EQ(t.particles[i].material, s.particles[i].material);
    }
    ASSERT_EQ(t.contacts.size(), 2u);
    EXPECT_EQ(t.contacts[1].second, -2);
    EXPECT_EQ(t.contacts[1].tangential_force, s.contacts[1].tangential_force);
    EXPECT_EQ(t.contacts[1].points, 12);
    ASSERT_EQ(t.springs.size(), 2u);
    EXPECT_EQ(t.springs[1].node, 4711);
    EXPECT_EQ(t.springs[1].spring, s.springs[1].spring);
    EXPECT_EQ(t.walls[0].pressure, s.walls[0].pressure);
    EXPECT_EQ(t.walls[0].friction, s.walls[0].friction);
    EXPECT_EQ(t.materials[1].density, 2650.5);
    EXPECT_EQ(t.psd[1].passing, 1.0 / 3);
    EXPECT_TRUE(std::isnan(t.criteria[1].value));
    EXPECT_EQ(t.criteria[0].definition, "a definition");
    EXPECT_EQ(t.statistics.porosity, 0.456);
    EXPECT_EQ(t.history.size(), 2u);
    EXPECT_EQ(t.history[1].options.at("seed"), "7");
}

TEST(SampleFile, polyhedra_and_superellipsoids_become_shapes_of_contact)
{
    ShapeTemplate t;
    t.kind = ShapeKind::polyhedron;
    t.name = "chip";
    t.vertices = {{1e-3, 0, 0}, {-1e-3, 0, 0}, {0, 1e-3, 0}, {0, -1e-3, 0}, {0, 0, 1e-3}, {0, 0, -1e-3}};
    const coral::dem::SurfaceNodes nodes = coral::dem::polyhedron_nodes(coral::dem::Polyhedron(t.vertices), 300);
    t.nodes = nodes.positions;
    t.node_areas = nodes.areas;
    const auto chip = make_shape(t);
    EXPECT_EQ(chip->polyhedron().faces().size(), 8u);
    EXPECT_EQ(chip->nodes().size(), t.nodes.size());
    EXPECT_NEAR(chip->volume() / (4.0 / 3.0 * 1e-9), 1.0, 1e-12);
    t.vertices.resize(3);
    EXPECT_THROW(make_shape(t), coral::Error);

    ShapeTemplate s;
    s.kind = ShapeKind::superellipsoid;
    s.radii = {1.2e-3, 1e-3, 0.8e-3};
    s.exponents = {0.7, 0.9};
    const coral::dem::Superellipsoid body{s.radii, 0.7, 0.9};
    s.grid = std::make_shared<const coral::sdf::DistanceGrid>(coral::dem::tabulate(body, 1e-4, 5e-4));
    s.nodes = {{1.2e-3, 0, 0}};
    s.node_areas = {1e-6};
    EXPECT_NEAR(make_shape(s)->volume() / coral::dem::volume(body), 1.0, 1e-12);
}

TEST(SampleFile, has_the_same_bytes_when_written_twice)
{
    const Sample s = awkward_sample();
    write_sample(s, scratch("a.h5"));
    write_sample(s, scratch("b.h5"));
    EXPECT_EQ(coral::read_text_file(scratch("a.h5")), coral::read_text_file(scratch("b.h5")));
}

TEST(SampleFile, is_refused_when_damaged)
{
    EXPECT_THROW(read_sample(scratch("missing.h5")), coral::Error);
    const auto foreign = scratch("foreign.h5");
    {
        auto file = coral::H5File::create(foreign);
        file.set_attribute("/", "content", "something else");
        file.commit();
    }
    try {
        read_sample(foreign);
        FAIL() << "a foreign file was read";
    } catch (const coral::Error& error) {
        EXPECT_NE(std::string(error.what()).find("is not a sample"), std::string::npos) << error.what();
    }
    const auto cut = scratch("cut.h5");
    write_sample(awkward_sample(), cut);
    std::filesystem::resize_file(cut, std::filesystem::file_size(cut) / 2);
    EXPECT_THROW(read_sample(cut), coral::Error);
}

TEST(SampleFile, is_not_written_with_an_index_that_points_nowhere)
{
    Sample s = awkward_sample();
    s.particles[0].shape = 9;
    EXPECT_THROW(write_sample(s, scratch("bad.h5")), coral::Error);
    EXPECT_FALSE(std::filesystem::exists(scratch("bad.h5")));
}

TEST(Sample, scales_volumes_with_the_cube)
{
    Sample s = awkward_sample();
    Particle sphere = s.particles[0];
    sphere.scale = 0.002;
    EXPECT_NEAR(volume(s, sphere), std::numbers::pi / 6 * 8e-9, 1e-22);
    EXPECT_DOUBLE_EQ(equivalent_diameter(s, sphere), 0.002);
    EXPECT_NEAR(mass(s, sphere), 2780 * std::numbers::pi / 6 * 8e-9, 1e-18);
}
