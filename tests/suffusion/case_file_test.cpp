#include "suffusion/case_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "suffusion/scratch.h"

namespace coral::suffusion {
namespace {

using test::Scratch;

const std::string whole = R"(
[domain]
origin = [0, 0, 0]
size = ["60mm", "60mm", "64mm"]
cell = "0.5mm"
[boundary]
"x-" = { type = "slip" }
"z+" = { type = "inlet", velocity = [0, 0, -0.1] }
"z-" = { type = "outlet", pressure = 0 }
[fluid]
density = 1000
kinematic_viscosity = 1e-6
body_acceleration = [0, 0, 0]
drag = "gidaspow"
[gravity]
vector = [0, 0, -9.81]
[contact]
spheres = "walls"
[material.default]
density = 2780
normal_stiffness = 2e5
tangential_stiffness = 1e5
friction = 0.7
damping = 0.3
[[body]]
shape = { type = "sphere", diameter = "15mm" }
position = [0.03, 0.03, 0.05]
velocity = [0, 0, 0]
role = "coarse"
motion = "fixed"
scheme = "semi-resolved"
[[wall]]
type = "plate"
z = "2mm"
hole = "6mm"
pitch = "12mm"
[time]
duration = "2s"
dem_step = "2e-6s"
cfl = 0.5
[output]
interval = "5ms"
frames = "50ms"
track = [0]
)";

std::string replaced(std::string text, const std::string& from, const std::string& to)
{
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

std::string error_of(const std::string& text)
{
    const Scratch scratch;
    scratch.write("case.toml", text);
    try {
        read_case(scratch.path());
    } catch (const UsageError& error) {
        return error.what();
    }
    return "";
}

TEST(CaseFile, reads_every_key_of_the_contract_in_si)
{
    const Scratch scratch;
    scratch.write("case.toml", whole);
    const Case c = read_case(scratch.path());
    ASSERT_TRUE(c.domain && c.fluid);
    EXPECT_EQ(c.domain->cells, Eigen::Vector3i(120, 120, 128));
    EXPECT_DOUBLE_EQ(c.domain->cell, 5e-4);
    EXPECT_EQ(c.boundary[5].kind, BoundaryKind::inlet);
    EXPECT_DOUBLE_EQ(c.boundary[5].velocity.z(), -0.1);
    EXPECT_EQ(c.boundary[4].kind, BoundaryKind::outlet);
    EXPECT_EQ(c.boundary[1].kind, BoundaryKind::slip);
    EXPECT_DOUBLE_EQ(c.fluid->kinematic_viscosity, 1e-6);
    EXPECT_TRUE(c.overrides_material);
    EXPECT_DOUBLE_EQ(c.materials.at("default").tangential_stiffness, 1e5);
    ASSERT_EQ(c.bodies.size(), 1u);
    EXPECT_DOUBLE_EQ(c.bodies[0].diameter, 0.015);
    EXPECT_EQ(c.bodies[0].motion, BodyMotion::fixed);
    EXPECT_EQ(c.bodies[0].scheme, Scheme::semi_resolved);
    ASSERT_TRUE(c.plate());
    EXPECT_DOUBLE_EQ(c.plate()->hole, 6e-3);
    EXPECT_DOUBLE_EQ(c.plate()->thickness, 1e-3);
    EXPECT_DOUBLE_EQ(c.time.dem_step, 2e-6);
    EXPECT_DOUBLE_EQ(c.output.frames, 0.05);
    EXPECT_FALSE(c.output.track_all);
    EXPECT_EQ(c.flow_axis(), 2);
    EXPECT_EQ(c.sphere_scheme, dem::SphereScheme::walls);
}

TEST(CaseFile, leaves_out_what_the_file_does_not_name)
{
    const Scratch scratch;
    scratch.write("drop.toml", "[[body]]\nshape = { type = \"sphere\", diameter = 0.01 }\nposition = [0, 0, 1]\n[time]\nduration = 1\n");
    const Case c = read_case(scratch.path() / "drop.toml");
    EXPECT_FALSE(c.fluid || c.domain || c.sample);
    EXPECT_EQ(c.sphere_scheme, dem::SphereScheme::automatic);
    EXPECT_EQ(c.time.dem_step, 0);
    EXPECT_EQ(c.output.frames, 0);
    EXPECT_TRUE(c.output.track_all);
    EXPECT_DOUBLE_EQ(c.gravity.z(), -9.81);
}

TEST(CaseFile, reports_all_errors_at_once_with_the_nearest_key)
{
    std::string text = replaced(whole, "kinematic_viscosity", "kinematic_viscocity");
    text = replaced(text, "type = \"sphere\", diameter = \"15mm\"", "type = \"polyhedra\", file = \"a.off\"");
    text = replaced(text, "duration = \"2s\"", "duration = -2");
    const std::string error = error_of(text);
    EXPECT_NE(error.find("did you mean 'kinematic_viscosity'?"), std::string::npos) << error;
    EXPECT_NE(error.find("did you mean 'polyhedron'?"), std::string::npos) << error;
    EXPECT_NE(error.find("duration"), std::string::npos) << error;
    EXPECT_NE(error.find("case.toml:12:"), std::string::npos) << error;
}

TEST(CaseFile, knows_how_far_each_flow_scheme_may_step)
{
    EXPECT_EQ(error_of(replaced(whole, "cfl = 0.5", "cfl = 0.55\nflow_scheme = \"runge-kutta\"")), "");
    EXPECT_NE(error_of(replaced(whole, "cfl = 0.5", "cfl = 0.7\nflow_scheme = \"runge-kutta\"")).find("above 0.55 the flow step is not stable"), std::string::npos);
    EXPECT_EQ(error_of(replaced(whole, "cfl = 0.5", "cfl = 0.7")), "");
    EXPECT_NE(error_of(replaced(whole, "cfl = 0.5", "flow_scheme = \"runge-kuta\"")).find("adams-bashforth"), std::string::npos);
}

TEST(CaseFile, names_the_word_that_may_stand_for_a_time)
{
    const std::string error = error_of(replaced(whole, "dem_step = \"2e-6s\"", "dem_step = \"automatic\""));
    EXPECT_NE(error.find("'automatic' is no time; give one such as \"1ms\", or \"auto\""), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
}

TEST(CaseFile, names_the_inlet_that_is_closed)
{
    for (const char* velocity : {"[0, 0, 0]", "[0, 0, 0.1]", "[0.1, 0, 0]"}) {
        const std::string error = error_of(replaced(whole, "[0, 0, -0.1]", velocity));
        EXPECT_NE(error.find("velocity"), std::string::npos) << error;
        EXPECT_NE(error.find("the inlet is closed"), std::string::npos) << error;
        EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    }
    const std::string error = error_of(replaced(whole, "type = \"outlet\", pressure = 0", "type = \"wall\""));
    EXPECT_NE(error.find("no face is an outlet"), std::string::npos) << error;
}

TEST(CaseFile, wants_periodic_faces_in_pairs_and_whole_cells)
{
    EXPECT_NE(error_of(replaced(whole, "type = \"slip\"", "type = \"periodic\"")).find("periodic faces come in pairs"), std::string::npos);
    EXPECT_NE(error_of(replaced(whole, "\"64mm\"", "\"64.2mm\"")).find("whole number of cells"), std::string::npos);
}

TEST(CaseFile, reads_how_fines_feel_the_flow)
{
    const Scratch scratch;
    scratch.write("case.toml", "[domain]\nsize = [1, 1, 1]\ncell = 0.1\n[fluid]\ndrag = \"hoelzer-sommerfeld\"\nself_disturbance = \"volume-removed\"\nprecision = \"single\"\nkernel_support = [3, 6]\n[time]\nduration = 1\n");
    const Case c = read_case(scratch.path());
    EXPECT_EQ(c.fluid->drag, "hoelzer-sommerfeld");
    EXPECT_EQ(c.fluid->self_disturbance, "volume-removed");
    EXPECT_EQ(c.fluid->precision, coral::fluid::Precision::float32);
    EXPECT_EQ(c.fluid->kernel_support[1], 6.0);
    scratch.write("case.toml", "[domain]\nsize = [1, 1, 1]\ncell = 0.1\n[fluid]\ndrag = \"di-felise\"\nself_disturbance = \"gone\"\nkernel_support = [4, 2]\n[time]\nduration = 1\n");
    try {
        read_case(scratch.path());
        FAIL() << "three bad values went through";
    } catch (const UsageError& error) {
        const std::string text = error.what();
        for (const char* part : {"case.toml:5:", "di-felice", "case.toml:6:", "volume-removed", "case.toml:7:", "is no pair of support diameters"})
            EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
    }
}

TEST(CaseFile, tells_that_a_case_is_missing)
{
    try {
        read_case("no_such_case");
        FAIL();
    } catch (const UsageError& error) {
        EXPECT_NE(std::string(error.what()).find("no_such_case"), std::string::npos);
    }
}

}  // namespace
}  // namespace coral::suffusion
