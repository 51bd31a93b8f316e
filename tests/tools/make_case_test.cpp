// make-case on a small sample made in memory; the case it writes runs.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <numbers>

#include "core/hdf5.h"
#include "core/output_file.h"
#include "dem/polyhedron.h"
#include "pack/sample.h"
#include "suffusion/case_file.h"
#include "suffusion/plan.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

namespace fs = std::filesystem;

/// Eight coarse grains on a lattice with fines in the gaps; a box of 24 x 23.7 x 24 mm.
pack::Sample small_sample(bool with_fines)
{
    pack::Sample sample;
    sample.shapes = {pack::unit_sphere()};
    sample.materials = {{.name = "sand", .density = 2650, .normal_stiffness = 4e3, .tangential_stiffness = 2e3, .friction = 0.5, .damping = 0.3}};
    sample.size = {0.024, 0.0237, 0.024};
    const auto add = [&](double d, double x, double y, double z, pack::Role role) {
        pack::Particle p;
        p.position = {x, y, z};
        p.scale = d;
        p.role = role;
        sample.particles.push_back(p);
    };
    for (int n = 0; n < 8; ++n) add(0.0115, 0.006 + 0.012 * (n % 2), 0.0059 + 0.0118 * (n / 2 % 2), 0.00585 + 0.012 * (n / 4), pack::Role::coarse);
    if (with_fines)
        for (int n = 0; n < 5; ++n) add(0.0025, 0.012, 0.01185, 0.0015 + 0.0045 * n, pack::Role::fine);
    return sample;
}

TEST(MakeCase, sets_the_holes_as_far_apart_as_asked)
{
    const ScratchFolder folder;
    pack::write_sample(small_sample(true), folder.path() / "sample.h5");
    const double width = small_sample(true).size.x();
    const ProgramResult made = run_program("make-case sample.h5 -o case --hole 4mm --pitch 6.2mm --cell 1mm", folder.path());
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const double pitch = suffusion::read_case(folder.path() / "case").plate()->pitch;
    EXPECT_NEAR(pitch, width / std::round(width / 6.2e-3), 1e-12);
    const ProgramResult refused = run_program("make-case sample.h5 -o narrow --hole 4mm --pitch 4.5mm --cell 1mm", folder.path());
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find("--pitch"), std::string::npos) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "narrow"));
}

TEST(MakeCase, takes_the_contact_step_as_asked_and_refuses_one_above_critical)
{
    const ScratchFolder folder;
    pack::write_sample(small_sample(true), folder.path() / "sample.h5");
    const ProgramResult made = run_program("make-case sample.h5 -o case --cell 1mm --dem-step 0.5us", folder.path());
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_DOUBLE_EQ(suffusion::read_case(folder.path() / "case").time.dem_step, 0.5e-6);
    const ProgramResult refused = run_program("make-case sample.h5 -o coarse --cell 1mm --dem-step 1ms", folder.path());
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find("--dem-step"), std::string::npos) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "coarse"));
}

TEST(MakeCase, refuses_an_angle_without_its_unit)
{
    const ScratchFolder folder;
    pack::write_sample(small_sample(true), folder.path() / "sample.h5");
    const ProgramResult refused = run_program("make-case sample.h5 --explain --cell 1mm --angle 45", folder.path());
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find("--angle: is 2578 deg (a bare number is in radians)"), std::string::npos) << refused.err;
}

TEST(MakeCase, ends_with_one_error_on_a_full_disk)
{
    const ScratchFolder folder;
    pack::write_sample(small_sample(true), folder.path() / "sample.h5");
    const std::filesystem::path small = folder.path() / "small";
    std::filesystem::create_directory(small);
    if (::mount("tmpfs", small.c_str(), "tmpfs", 0, "size=8k") != 0) GTEST_SKIP() << "cannot mount a small tmpfs: " << std::strerror(errno);
    const ProgramResult full = run_program("make-case sample.h5 -o small/case --cell 1mm", folder.path());
    EXPECT_EQ(full.exit_code, 1) << full.err;
    EXPECT_NE(full.err.find("check the space left on the disk"), std::string::npos) << full.err;
    EXPECT_EQ(std::ranges::count(full.err, '\n'), 1) << full.err;
    EXPECT_FALSE(std::filesystem::exists(small / "case/sample.h5"));
    ::umount(small.c_str());
}

TEST(MakeCase, plans_the_contact_steps_that_the_run_takes_for_angular_fines_too)
{
    const ScratchFolder folder;
    std::vector<Eigen::Vector3d> corners;
    for (int n = 0; n < 8; ++n) corners.emplace_back(n & 1 ? 1e-3 : -1e-3, n & 2 ? 1e-3 : -1e-3, n & 4 ? 1e-3 : -1e-3);
    const dem::Polyhedron cube(corners);
    dem::SurfaceNodes nodes = dem::polyhedron_nodes(cube, 200);
    pack::ShapeTemplate shape;
    shape.kind = pack::ShapeKind::polyhedron;
    shape.name = "cube";
    shape.vertices = corners;
    shape.volume = shape.apparent_volume = cube.volume();
    shape.equivalent_diameter = std::cbrt(6 * cube.volume() / std::numbers::pi);
    shape.inertia = cube.inertia();
    shape.nodes = nodes.positions;
    shape.node_areas = nodes.areas;
    pack::Sample sample = small_sample(true);
    sample.shapes.push_back(shape);
    sample.materials[0].normal_stiffness = 4e5, sample.materials[0].tangential_stiffness = 2e5;  // many contact steps a flow step
    for (pack::Particle& p : sample.particles)
        if (p.role == pack::Role::fine) p.shape = 1, p.scale = 1;
    pack::write_sample(sample, folder.path() / "sample.h5");
    suffusion::PlanOptions options;
    options.cell = 1e-3;
    const double planned = suffusion::make_plan(sample, options).dem_step, duration = 4e-3;
    ASSERT_EQ(run_program("make-case sample.h5 -o case --cell 1mm --duration 4ms --quiet", folder.path()).exit_code, 0);
    const ProgramResult ran = run_program("suffuse case --quiet", folder.path());
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    const H5File results = H5File::open(folder.path() / "case/results.h5");
    const double steps = results.read_doubles("/performance/dem_steps").at(0), flow_steps = results.read_doubles("/performance/flow_steps").at(0);
    // Each flow step is cut into whole steps, none longer than planned.
    EXPECT_LE(duration / planned, steps * (1 + 1e-9));
    EXPECT_GE(duration / planned, steps - flow_steps);
    EXPECT_LT(flow_steps, 0.2 * steps);
}

TEST(MakeCase, writes_a_case_that_reads_back_and_runs)
{
    const ScratchFolder folder;
    pack::write_sample(small_sample(true), folder.path() / "sample.h5");
    const ProgramResult made = run_program("make-case sample.h5 -o case --velocity 0.05m/s --angle 45deg --cell 1mm --duration 4ms", folder.path());
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_NE(made.out.find("resolved"), std::string::npos) << made.out;
    EXPECT_NE(made.out.find("semi-resolved"), std::string::npos) << made.out;
    const suffusion::Case c = suffusion::read_case(folder.path() / "case");
    ASSERT_TRUE(c.domain && c.fluid && c.plate() && c.sample);
    EXPECT_DOUBLE_EQ(c.boundary[5].velocity.z(), -0.05);
    EXPECT_NEAR(c.gravity.x(), 9.81 * std::numbers::sqrt2 / 2, 1e-12);
    EXPECT_NEAR(c.gravity.z(), -9.81 * std::numbers::sqrt2 / 2, 1e-12);
    EXPECT_NEAR(c.plate()->hole, 0.4 * 0.0115, 1e-12);
    EXPECT_DOUBLE_EQ(c.materials.at("default").density, 2650);
    EXPECT_GT(c.domain->size.z(), 0.024);
    // The lid of the packing stays, for grains only.
    const auto is_lid = [&](const suffusion::WallSpec& w) { return w.kind == suffusion::WallKind::plane && w.normal.z() == -1; };
    const auto lid = std::find_if(c.walls.begin(), c.walls.end(), is_lid);
    ASSERT_NE(lid, c.walls.end());
    EXPECT_DOUBLE_EQ(lid->point.z(), small_sample(true).size.z());
    EXPECT_LT(lid->point.z(), c.domain->origin.z() + c.domain->size.z());
    const ProgramResult open = run_program("make-case sample.h5 -o open --lid remove --quiet", folder.path());
    ASSERT_EQ(open.exit_code, 0) << open.err;
    const suffusion::Case without = suffusion::read_case(folder.path() / "open");
    EXPECT_EQ(std::count_if(without.walls.begin(), without.walls.end(), is_lid), 0);
    // The faces of the plate lie off the faces of the cells.
    const double offset = -c.domain->origin.z() / c.domain->cell;
    EXPECT_NEAR(offset - std::floor(offset), 0.75, 1e-9);
    const ProgramResult run = run_program("suffuse case --quiet", folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const H5File results = H5File::open(folder.path() / "case/results.h5");
    EXPECT_NEAR(results.read_doubles("/series/time").back(), 0.004, 1e-15);
    EXPECT_NE(results.string_attribute("/", "history").find("make-case"), std::string::npos);
}

TEST(MakeCase, a_periodic_sample_makes_a_periodic_case_that_runs)
{
    const ScratchFolder folder;
    pack::Sample sample = small_sample(true);
    sample.size.y() = 0.024;
    sample.period = {0.024, 0.024, 0};
    for (pack::Particle& p : sample.particles) p.position.x() = std::fmod(p.position.x() + 0.005, 0.024);  // some reach across the seam
    pack::write_sample(sample, folder.path() / "sample.h5");
    const ProgramResult made = run_program("make-case sample.h5 -o case --velocity 0.05m/s --cell 1mm --duration 4ms", folder.path());
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_NE(made.out.find("periodic sides"), std::string::npos) << made.out;
    const suffusion::Case c = suffusion::read_case(folder.path() / "case");
    for (int face = 0; face < 4; ++face) EXPECT_EQ(c.boundary[std::size_t(face)].kind, suffusion::BoundaryKind::periodic) << face;
    EXPECT_NEAR(c.domain->size.x(), 0.024, 1e-15);
    EXPECT_NEAR(c.domain->size.y(), 0.024, 1e-15);
    const ProgramResult run = run_program("suffuse case --quiet", folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const H5File results = H5File::open(folder.path() / "case/results.h5");
    EXPECT_NEAR(results.read_doubles("/series/time").back(), 0.004, 1e-15);
    for (const double error : results.read_doubles("/series/mass_balance_error")) EXPECT_LT(std::abs(error), 1e-6);

    // the same in a domain with slip sides is refused, and so are cells or holes that do not repeat themselves
    std::string text = read_text_file(folder.path() / "case/case.toml");
    while (text.find("periodic\" }") != std::string::npos) text.replace(text.find("periodic\" }"), 8, "slip");
    write_text_file(folder.path() / "case/case.toml", text);
    const ProgramResult slip = run_program("suffuse case --quiet", folder.path());
    EXPECT_EQ(slip.exit_code, 1);
    EXPECT_NE(slip.err.find("repeats itself along x after 0.024 m"), std::string::npos) << slip.err;
    sample.size.y() = sample.period.y() = 0.0236;
    pack::write_sample(sample, folder.path() / "odd.h5");
    EXPECT_EQ(run_program("make-case odd.h5 -o odd --cell 1mm", folder.path()).exit_code, 2);
}

TEST(MakeCase, a_cylinder_is_refused_by_it_and_by_suffuse)
{
    const ScratchFolder folder;
    pack::Sample sample = small_sample(true);
    pack::write_sample(sample, folder.path() / "sample.h5");
    ASSERT_EQ(run_program("make-case sample.h5 -o case --cell 1mm --duration 1ms", folder.path()).exit_code, 0);
    sample.walls = {{"side", {0.012, 0.012, 0}, Eigen::Vector3d::UnitZ(), 0, 0, 0.02}};
    pack::write_sample(sample, folder.path() / "case/sample.h5");
    for (const char* command : {"make-case case/sample.h5 -o other", "suffuse case --quiet"}) {
        const ProgramResult refused = run_program(command, folder.path());
        EXPECT_EQ(refused.exit_code, 1) << command;
        EXPECT_NE(refused.err.find("lies in a cylinder"), std::string::npos) << refused.err;
        EXPECT_NE(refused.err.find("pack it with [box]"), std::string::npos) << refused.err;
    }
    const ProgramResult info = run_program("grain-info case/sample.h5", folder.path());
    EXPECT_EQ(info.exit_code, 0) << info.err;
    EXPECT_NE(info.out.find("a cylinder of 40"), std::string::npos) << info.out;
}

TEST(MakeCase, takes_cells_over_which_transforms_are_fast)
{
    // Nearest to 0.39 mm are 62 = 2 x 31 cells; y would fit 58 = 2 x 29 best.
    const suffusion::Plan plan = suffusion::make_plan(small_sample(true), {.cell = 0.39e-3});
    for (const int axis : {0, 1}) {
        int cells = plan.domain.cells[axis];
        for (const int prime : {2, 3, 5, 7})
            while (cells % prime == 0) cells /= prime;
        EXPECT_EQ(cells, 1) << plan.domain.cells[axis];
    }
    EXPECT_NEAR(plan.domain.cell, 0.39e-3, 0.05 * 0.39e-3);
}

TEST(MakeCase, explain_prints_the_plan_and_writes_nothing)
{
    const ScratchFolder folder;
    pack::write_sample(small_sample(true), folder.path() / "sample.h5");
    const ProgramResult plan = run_program("make-case sample.h5 -o case --explain", folder.path());
    ASSERT_EQ(plan.exit_code, 0) << plan.err;
    for (const char* word : {"domain", "coarse", "fine", "steps", "memory", "time", "expected errors"}) EXPECT_NE(plan.out.find(word), std::string::npos) << word;
    EXPECT_FALSE(fs::exists(folder.path() / "case"));
}

TEST(MakeCase, refuses_a_sample_without_fines_with_1)
{
    const ScratchFolder folder;
    pack::write_sample(small_sample(false), folder.path() / "sample.h5");
    const ProgramResult made = run_program("make-case sample.h5 -o case", folder.path());
    EXPECT_EQ(made.exit_code, 1);
    EXPECT_NE(made.err.find("no fines"), std::string::npos) << made.err;
    EXPECT_FALSE(fs::exists(folder.path() / "case"));
}

TEST(MakeCase, refuses_what_it_cannot_do_with_2)
{
    const ScratchFolder folder;
    pack::write_sample(small_sample(true), folder.path() / "sample.h5");
    EXPECT_EQ(run_program("make-case missing.h5 -o case", folder.path()).exit_code, 2);
    EXPECT_EQ(run_program("make-case sample.h5", folder.path()).exit_code, 2);
    EXPECT_EQ(run_program("make-case sample.h5 -o case --velocity 0", folder.path()).exit_code, 2);
    const ProgramResult engine = run_program("make-case sample.h5 -o case --engine openfoam", folder.path());
    EXPECT_EQ(engine.exit_code, 2);
    EXPECT_NE(engine.err.find("not supported yet"), std::string::npos) << engine.err;
}

TEST(MakeCase, refuses_a_damaged_sample_with_1)
{
    const ScratchFolder folder;
    write_text(folder.path() / "sample.h5", "not HDF5");
    EXPECT_EQ(run_program("make-case sample.h5 -o case", folder.path()).exit_code, 1);
}

}  // namespace
}  // namespace coral::test
