#include "pack/spec.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/error.h"
#include "core/output_file.h"

using namespace coral::pack;

namespace {

Spec spec_of(const std::string& text)
{
    const auto file = std::filesystem::path(testing::TempDir()) / ("coral_spec_" + std::to_string(::getpid()) + ".toml");
    coral::write_text_file(file, text);
    return read_spec(file);
}

std::string error_of(const std::string& text)
{
    try {
        spec_of(text);
    } catch (const coral::UsageError& error) {
        return error.what();
    }
    return "no error";
}

const std::string box = "[box]\nsize = [\"60mm\", \"60mm\", \"80mm\"]\n";
const std::string coarse = "[[population]]\nrole = \"coarse\"\ndiameter = \"15mm\"\ncount = 50\n";
const std::string fine = "[[population]]\nrole = \"fine\"\ndiameters = [\"1.5mm\", \"3mm\"]\nmass_fraction = 0.3\n";

void expect_message(const std::string& spec, const std::string& part)
{
    const std::string message = error_of(spec);
    EXPECT_NE(message.find(part), std::string::npos) << "expected '" << part << "' in: " << message;
}

}  // namespace

TEST(PackingSpec, spheres_press_on_the_nearest_wall_or_on_all_or_as_the_place_asks)
{
    EXPECT_EQ(spec_of(box + coarse + fine).sphere_scheme, coral::dem::SphereScheme::automatic);
    EXPECT_EQ(spec_of(box + coarse + fine + "[contact]\nspheres = \"walls\"\n").sphere_scheme, coral::dem::SphereScheme::walls);
    EXPECT_EQ(spec_of(box + coarse + fine + "[contact]\nspheres = \"nearest\"\n").sphere_scheme, coral::dem::SphereScheme::nearest);
    expect_message(box + coarse + fine + "[contact]\nspheres = \"wals\"\n", "walls");
    expect_message(box + coarse + fine + "[contact]\nsphere = \"walls\"\n", "spheres");
}

TEST(PackingSpec, reads_units_and_defaults)
{
    const Spec s = spec_of(box + coarse + fine + "[compression]\npressure = \"50kPa\"\n[material.default]\nfriction = 0.5\n[time]\ndem_step = \"2e-6s\"\n");
    EXPECT_EQ(s.size, Eigen::Vector3d(0.06, 0.06, 0.08));
    ASSERT_EQ(s.populations.size(), 2u);
    EXPECT_EQ(s.populations[0].count, 50);
    EXPECT_EQ(s.populations[0].smallest, 0.015);
    EXPECT_EQ(s.populations[1].gradation, Gradation::uniform);
    EXPECT_EQ(s.populations[1].largest, 0.003);
    EXPECT_EQ(s.populations[1].mass_fraction, 0.3);
    EXPECT_EQ(s.compression.target, CompressionTarget::pressure);
    EXPECT_EQ(s.compression.pressure, 50e3);
    EXPECT_EQ(s.materials[0].friction, 0.5);
    EXPECT_EQ(s.materials[0].density, 2780);
    EXPECT_EQ(s.dem_step, 2e-6);
    EXPECT_TRUE(s.warnings.empty());
}

TEST(PackingSpec, names_every_error_at_once_with_the_nearest_key)
{
    const std::string message = error_of("[box]\nsise = [1, 1, 1]\n[[population]]\nrole = \"corse\"\ndiameter = \"15kg\"\ncount = 1\n[droping]\nlayers = 2\n");
    for (const char* part : {"did you mean 'size'", "did you mean 'coarse'", "'droping'", "did you mean 'dropping'", "15kg"})
        EXPECT_NE(message.find(part), std::string::npos) << part << " is missing in:\n" << message;
}

TEST(PackingSpec, refuses_what_cannot_be_packed)
{
    expect_message(box + fine, "every population has a mass_fraction");
    expect_message(box, "there is no [[population]]");
    expect_message(box + coarse + "[[population]]\nrole = \"fine\"\ndiameter = 0\ncount = 5\n", "must be greater than zero");
    expect_message(box + "[[population]]\nrole = \"coarse\"\nshape = \"level-set\"\ncount = 5\n", "write file = \"grains.vdb\"");
    expect_message(box + "[[population]]\nrole = \"coarse\"\nshape = \"level-set\"\nfile = \"none.vdb\"\ncount = 5\n", "does not exist");
    expect_message(box + coarse + "[[population]]\nrole = \"fine\"\ncount = 3\nmass_fraction = 0.3\ndiameter = 0.002\n", "either count or mass_fraction");
    expect_message(box + "[[population]]\nrole = \"coarse\"\ndiameter = \"70mm\"\ncount = 2\n", "do not fit a box of");
    expect_message(box + coarse + "[compression]\npressure = 1\nvoid_ratio = 1\n", "keep one of them");
    expect_message(box + "[[population]]\nrole = \"coarse\"\ncount = 2\n", "write diameter, diameters or psd");
    expect_message(box + coarse + "material = \"shel\"\n[material.shell]\ndensity = 1\n", "did you mean 'shell'");
}

TEST(PackingSpec, refuses_a_gradation_that_does_not_reach_from_zero_to_all)
{
    const std::string start = box + coarse + "[[population]]\nrole = \"fine\"\nmass_fraction = 0.3\n";
    expect_message(start + "psd = { size = [\"1mm\", \"2mm\"], passing = [0, \"90%\"] }\n", "ends at 90 %, not 100 %");
    expect_message(start + "psd = { size = [\"1mm\", \"2mm\"], passing = [0.1, 1] }\n", "starts at 10 %, not 0 %");
    expect_message(start + "psd = { size = [\"2mm\", \"1mm\"], passing = [0, 1] }\n", "must rise");
    expect_message(start + "psd = { size = [\"2mm\"], passing = [0, 1] }\n", "same length");
}

namespace {

/// A population of 5 coarse grains whose shape is given by `keys`; the population begins at line 3.
std::string shaped(const std::string& keys) { return box + "[[population]]\nrole = \"coarse\"\ncount = 5\n" + keys; }
const std::string tetrahedron = "shape = \"polyhedron\"\nvertices = [[0, 0, 0], [\"6mm\", 0, 0], [0, \"6mm\", 0], [0, 0, \"6mm\"]]\n";

}  // namespace

TEST(PackingSpec, reads_polyhedra_and_superellipsoids)
{
    Population p = spec_of(shaped(tetrahedron + "scale = 2\n")).populations[0];
    EXPECT_EQ(p.shape, ShapeKind::polyhedron);
    ASSERT_EQ(p.polyhedra.size(), 1u);
    EXPECT_EQ(p.polyhedra[0].points[1], Eigen::Vector3d(6e-3, 0, 0));
    EXPECT_TRUE(p.own_size);
    EXPECT_EQ(p.scale, 2);
    EXPECT_EQ(p.surface_nodes, 2500);
    p = spec_of(shaped("shape = \"superellipsoid\"\nradii = [\"3mm\", \"2mm\", \"1mm\"]\nexponents = [0.5, 1]\ndiameters = [\"1mm\", \"2mm\"]\n")).populations[0];
    EXPECT_EQ(p.shape, ShapeKind::superellipsoid);
    EXPECT_EQ(p.radii, Eigen::Vector3d(3e-3, 2e-3, 1e-3));
    EXPECT_EQ(p.exponents, Eigen::Vector2d(0.5, 1));
    EXPECT_FALSE(p.own_size);
}

TEST(PackingSpec, refuses_shapes_without_size_at_their_place)
{
    expect_message(shaped("shape = \"superellipsoid\"\nradii = [\"3mm\", 0, \"1mm\"]\n"), ".toml:7:1: key 'population.radii' has a radius that is not above zero");
    expect_message(shaped("shape = \"superellipsoid\"\nradii = [1, 1, 1]\nexponents = [3, 1]\n"), ".toml:8:1: key 'population.exponents' has 3, outside (0, 2]");
    expect_message(shaped("shape = \"superellipsoid\"\n"), "radii' is missing");
    expect_message(shaped("shape = \"polyhedron\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]\n"), ".toml:7:1: key 'population.vertices'");
    expect_message(shaped("shape = \"polyhedron\"\nvertices = [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]\n"), "vertices'");
    expect_message(shaped("shape = \"polyhedron\"\n"), "give file = \"stone.stl\"");
    expect_message(shaped("shape = \"polyhedron\"\nfile = \"none.stl\"\nunit = \"mm\"\n"), "does not exist");
    expect_message(shaped("shape = \"polyhedron\"\nfile = \"stone.obj\"\nunit = \"mm\"\n"), "take a .stl or .ply file");
    expect_message(shaped("shape = \"polyhedron\"\nfile = []\nunit = \"mm\"\n"), "is an empty list");
    expect_message(shaped(tetrahedron + "scale = 0\n"), "scale' must be greater than zero");
    expect_message(shaped(tetrahedron + "scale = 2\ndiameter = \"5mm\"\n"), "keep one of them");
    expect_message(shaped("scale = 2\n"), "write diameter");
    expect_message(box + coarse + "[[population]]\nrole = \"fine\"\nmass_fraction = 0.3\npsd = { size = [0, \"2mm\"], passing = [0, 1] }\n", ".toml:10:");
    expect_message(box + coarse + "material = \"shell\"\n", ".toml:7:1: key 'population.material' there is no [material.shell]");
}

TEST(PackingSpec, scales_only_grains_that_keep_the_size_of_their_file)
{
    Spec s = spec_of(shaped(tetrahedron + "scale = 2\n") + fine);
    scale_grains(s, 1.5);
    EXPECT_EQ(s.populations[0].scale, 3);
    EXPECT_EQ(s.populations[1].scale, 1);
    s = spec_of(box + coarse);
    EXPECT_THROW(scale_grains(s, 1.5), coral::UsageError);
}

TEST(PackingSpec, takes_both_limits_of_the_void_ratio_or_none)
{
    const Spec s = spec_of(box + coarse + "[density]\ne_min = 0.8\ne_max = \"140%\"\n");
    ASSERT_TRUE(s.density.has_value());
    EXPECT_EQ(s.density->e_min, 0.8);
    EXPECT_DOUBLE_EQ(s.density->e_max, 1.4);
    EXPECT_FALSE(spec_of(box + coarse).density.has_value());
    expect_message(box + coarse + "[density]\ne_min = 0.8\n", "e_max' is missing");
    expect_message(box + coarse + "[density]\ne_min = 0.8\ne_max = 0.7\n", ".toml:9:1: key 'density.e_max' is 0.7, not above e_min of 0.8");
    expect_message(box + coarse + "[density]\ne_min = 0\ne_max = 0.7\n", "must be greater than zero");
}

TEST(PackingSpec, warns_of_a_sample_without_fines)
{
    const Spec s = spec_of(box + coarse);
    ASSERT_EQ(s.warnings.size(), 1u);
    EXPECT_NE(s.warnings[0].find("fine"), std::string::npos);
}
