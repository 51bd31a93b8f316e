// swap-shapes as a user runs it: spheres become angular grains of published shapes; bad input and its messages.
#include <gtest/gtest.h>

#include "pack/sample.h"
#include "sh/shape_file.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

const std::string spec =
    "[box]\nsize = [\"8mm\", \"8mm\", \"12mm\"]\n"
    "[[population]]\nrole = \"coarse\"\ndiameter = \"3mm\"\ncount = 6\n"
    "[[population]]\nrole = \"fine\"\ndiameter = \"1mm\"\nmass_fraction = 0.2\n"
    "[material.default]\nnormal_stiffness = 2e4\ntangential_stiffness = 1e4\nfriction = 0.3\n"
    "[dropping]\ntime_limit = \"30ms\"\n[compression]\npressure = \"2kPa\"\n";

/// Two rounded blocks of about 1 mm.
void write_library(const std::filesystem::path& file)
{
    std::vector<sh::ShapeRecord> shapes(2);
    for (int k = 0; k < 2; ++k) {
        sh::Surface surface = sh::sphere_surface(5e-4);
        surface.degree = 4;
        surface.coefficients.resize(25, 0.0);
        surface.coefficients[6] = (k == 0 ? 0.05 : -0.05) * surface.coefficients[0];
        surface.coefficients[20] = 0.04 * surface.coefficients[0];
        shapes[std::size_t(k)].id = k + 1;
        shapes[std::size_t(k)].surface = surface;
        shapes[std::size_t(k)].volume = sh::body_properties(surface).volume;
        shapes[std::size_t(k)].equivalent_diameter = 1e-3;
    }
    sh::write_shapes(file, shapes, {{"ls2sh", "0.1.0", {{"degree", "4"}}, {"grains.vdb"}}});
}

TEST(SwapShapesTool, makes_the_fines_angular_and_reports_what_moved)
{
    const ScratchFolder folder;
    write_text(folder.path() / "spec.toml", spec);
    write_library(folder.path() / "blocks.sh.h5");
    ASSERT_EQ(run_program("pack-sample spec.toml -o sample.h5 --quiet", folder.path()).exit_code, 0);
    const ProgramResult result = run_program("swap-shapes sample.h5 --fine polyhedron --library blocks.sh.h5 --faces 16 --steps 2000 -o out.h5 --json --quiet", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    for (const char* key : {"\"displacement\":", "\"trapped\":", "\"overlaps\":", "\"kinetic_energy\":", "\"unbalanced_ratio\":", "\"kept\": \"volume\"", "\"swapped_coarse\": 0"})
        EXPECT_NE(result.out.find(key), std::string::npos) << key << " is missing in " << result.out;
    const pack::Sample before = pack::read_sample(folder.path() / "sample.h5"), after = pack::read_sample(folder.path() / "out.h5");
    ASSERT_EQ(after.particles.size(), before.particles.size());
    for (std::size_t i = 0; i < after.particles.size(); ++i)
        EXPECT_NEAR(pack::volume(after, after.particles[i]), pack::volume(before, before.particles[i]), 1e-9 * pack::volume(before, before.particles[i]));
    ASSERT_EQ(after.history.size(), before.history.size() + 2);  // of the library, and this run
    EXPECT_EQ(after.history.back().tool, "swap-shapes");
    EXPECT_EQ(after.history.back().options.at("library"), "blocks.sh.h5");
    EXPECT_FALSE(after.criteria.empty());

    const ProgramResult none = run_program("swap-shapes sample.h5 --coarse sphere -o none.h5", folder.path());
    EXPECT_EQ(none.exit_code, 2);
    EXPECT_NE(none.err.find("nothing to swap"), std::string::npos) << none.err;
    const ProgramResult shapeless = run_program("swap-shapes sample.h5 --fine polyhedron -o none.h5", folder.path());
    EXPECT_EQ(shapeless.exit_code, 2);
    EXPECT_NE(shapeless.err.find("--library"), std::string::npos) << shapeless.err;
    const ProgramResult refused = run_program("swap-shapes sample.h5 --fine polyhedron --library blocks.sh.h5 --limit 1e-9 --steps 200 -o none.h5 --quiet", folder.path());
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.err.find("--limit"), std::string::npos) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "none.h5"));
}

TEST(SwapShapesTool, ends_with_1_on_damaged_input_and_with_2_on_a_wrong_command_line)
{
    const ScratchFolder folder;
    write_text(folder.path() / "sample.h5", "this is no sample");
    const ProgramResult damaged = run_program("swap-shapes sample.h5 --coarse sphere -o out.h5", folder.path());
    EXPECT_EQ(damaged.exit_code, 1) << damaged.err;
    EXPECT_NE(damaged.err.find("sample.h5"), std::string::npos) << damaged.err;
    EXPECT_EQ(run_program("swap-shapes none.h5 --coarse sphere -o out.h5", folder.path()).exit_code, 2);
    EXPECT_EQ(run_program("swap-shapes sample.h5 --coarse cube -o out.h5", folder.path()).exit_code, 2);
    EXPECT_EQ(run_program("swap-shapes sample.h5 --coarse sphere -o none/out.h5", folder.path()).exit_code, 2);
    write_text(folder.path() / "shapes.sh.h5", "of no use here");
    EXPECT_EQ(run_program("swap-shapes sample.h5 --library shapes.sh.h5 -o out.h5", folder.path()).exit_code, 2);
    EXPECT_EQ(run_program("swap-shapes sample.h5 --coarse sphere --seed -1 -o out.h5", folder.path()).exit_code, 2);
    EXPECT_EQ(run_program("swap-shapes sample.h5 --coarse sh --library none.sh.h5 -o out.h5", folder.path()).exit_code, 2);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out.h5"));
}

}  // namespace
}  // namespace coral::test
