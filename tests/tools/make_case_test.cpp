// make-case on a small sample made in memory; the case it writes runs.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/hdf5.h"
#include "core/output_file.h"
#include "pack/sample.h"
#include "suffusion/case_file.h"
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
    // The faces of the plate lie off the faces of the cells.
    const double offset = -c.domain->origin.z() / c.domain->cell;
    EXPECT_NEAR(offset - std::floor(offset), 0.75, 1e-9);
    const ProgramResult run = run_program("suffuse case --quiet", folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const H5File results = H5File::open(folder.path() / "case/results.h5");
    EXPECT_NEAR(results.read_doubles("/series/time").back(), 0.004, 1e-15);
    EXPECT_NE(results.string_attribute("/", "history").find("make-case"), std::string::npos);
}

TEST(MakeCase, explain_prints_the_plan_and_writes_nothing)
{
    const ScratchFolder folder;
    pack::write_sample(small_sample(true), folder.path() / "sample.h5");
    const ProgramResult plan = run_program("make-case sample.h5 -o case --explain", folder.path());
    ASSERT_EQ(plan.exit_code, 0) << plan.err;
    for (const char* word : {"domain", "coarse", "fine", "steps", "memory", "time"}) EXPECT_NE(plan.out.find(word), std::string::npos) << word;
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
