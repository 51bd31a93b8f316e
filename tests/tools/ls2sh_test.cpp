// ls2sh as a user runs it: files and tables it writes, degree by tolerance, shapes it refuses, what it says about bad input.
#include <gtest/gtest.h>

#include <cmath>

#include "core/output_file.h"
#include "core/table.h"
#include "sdf/vdb_io.h"
#include "sh/shape_file.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

constexpr double voxel = 1e-4;

/// Grain of the voxels where solid(x) holds, x in voxels from the middle of a cube of n; `solid` is also its apparent shape.
template <class Solid>
sdf::GrainLevelSet grain(int id, int n, const Solid& solid)
{
    std::vector<std::uint8_t> voxels;
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) voxels.push_back(solid(Eigen::Vector3d(i - 0.5 * n, j - 0.5 * n, k - 0.5 * n)));
    const sdf::GrainMask mask{Eigen::Vector3i::Constant(n), Eigen::Vector3d::Constant(voxel), Eigen::Vector3d::Zero(), voxels};
    sdf::GrainLevelSet result = sdf::grain_from_masks(mask, mask, {.spacing = 2 * voxel});
    result.id = id;
    result.label = std::uint32_t(id);
    return result;
}

bool cube(const Eigen::Vector3d& x) { return x.cwiseAbs().maxCoeff() < 14; }
bool ball(const Eigen::Vector3d& x) { return x.norm() < 14; }
/// A ball with a cavity off its middle, as if its shape had not been filled: rays through the cavity leave the solid twice.
bool hollow(const Eigen::Vector3d& x) { return x.norm() < 14 && (x - Eigen::Vector3d(6, 0, 0)).norm() > 5; }
/// Three quarters of a ring.
bool hook(const Eigen::Vector3d& x) { return std::hypot(std::hypot(x.x(), x.y()) - 13, x.z()) < 5 && !(x.x() > 0 && x.y() > 0); }

const History made = {{"csct2ls", "1", {{"spacing", "0.0002"}}, {"stack.tif"}}};

double number(const Table& table, std::size_t row, const std::string& column)
{
    for (std::size_t c = 0; c < table.columns.size(); ++c)
        if (table.columns[c] == column) return std::get<double>(table.rows.at(row).at(c));
    throw std::out_of_range(column);
}

TEST(Ls2sh, fits_every_grain_and_writes_shapes_errors_and_history)
{
    const ScratchFolder folder;
    sdf::write_grains(folder.path() / "grains.vdb", std::vector{grain(1, 36, cube), grain(2, 36, ball)}, made);
    const ProgramResult result = run_program("ls2sh grains.vdb -o grains.sh.h5 --table t.csv --convergence c.csv --json --quiet", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("\"grains\": 2"), std::string::npos) << result.out;

    const sh::ShapeFile file = sh::read_shapes(folder.path() / "grains.sh.h5");
    ASSERT_EQ(file.shapes.size(), 2u);
    ASSERT_EQ(file.history.size(), 2u);
    EXPECT_EQ(file.history[0].tool, "csct2ls");
    EXPECT_EQ(file.history[1].tool, "ls2sh");
    EXPECT_EQ(file.shapes[0].surface.degree, 10);
    EXPECT_NEAR(file.shapes[0].volume / std::pow(27 * voxel, 3), 1.0, 1e-3);

    const Table table = read_table(folder.path() / "t.csv");
    const std::vector<std::string> columns = {"id", "degree", "method", "rms_error", "max_error", "volume_error", "area_error", "inertia_error", "non_star_fraction", "seconds"};
    EXPECT_TRUE(std::equal(columns.begin(), columns.end(), table.columns.begin()));
    // A cube is off by 11.6 % of the largest radius at its corners for degree 10: 0.116 * 0.866 / 1.24 = 8 % of the diameter.
    EXPECT_GT(number(table, 0, "max_error"), 0.02);
    EXPECT_LT(number(table, 0, "max_error"), 0.10);
    EXPECT_LT(number(table, 0, "rms_error"), 0.02);
    EXPECT_LT(number(table, 1, "rms_error"), 0.004) << "a ball of 14 nodes";
    EXPECT_EQ(number(table, 1, "non_star_fraction"), 0.0);

    const Table convergence = read_table(folder.path() / "c.csv");
    ASSERT_EQ(convergence.rows.size(), 18u);  // degrees 2..10 of two grains
    EXPECT_LT(number(convergence, 8, "rms_error"), 0.6 * number(convergence, 0, "rms_error"));
}

TEST(Ls2sh, takes_the_lowest_degree_that_meets_a_tolerance)
{
    const ScratchFolder folder;
    sdf::write_grains(folder.path() / "grains.vdb", std::vector{grain(1, 36, cube), grain(2, 36, ball)}, made);
    const ProgramResult result = run_program("ls2sh grains.vdb -o grains.sh.h5 --tolerance 2% --table t.csv", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Table table = read_table(folder.path() / "t.csv");
    EXPECT_EQ(number(table, 1, "degree"), 2);
    EXPECT_GE(number(table, 0, "degree"), 4);
    EXPECT_LE(number(table, 0, "rms_error"), 0.02);
}

TEST(Ls2sh, refuses_what_is_not_star_shaped_unless_forced_or_skipped)
{
    const ScratchFolder folder;
    sdf::write_grains(folder.path() / "grains.vdb", std::vector{grain(1, 36, hollow), grain(2, 36, ball)}, made);
    const ProgramResult refused = run_program("ls2sh grains.vdb -o grains.sh.h5", folder.path());
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.err.find("grain 1"), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("--force"), std::string::npos) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "grains.sh.h5"));

    EXPECT_EQ(run_program("ls2sh grains.vdb -o skipped.sh.h5 --skip", folder.path()).exit_code, 0);
    EXPECT_EQ(sh::read_shapes(folder.path() / "skipped.sh.h5").shapes.size(), 1u);
    const ProgramResult forced = run_program("ls2sh grains.vdb -o forced.sh.h5 --force", folder.path());
    EXPECT_EQ(forced.exit_code, 0) << forced.err;
    EXPECT_NE(forced.err.find("outer envelope"), std::string::npos) << forced.err;
    EXPECT_EQ(sh::read_shapes(folder.path() / "forced.sh.h5").shapes.size(), 2u);
}

TEST(Ls2sh, refuses_a_hook_and_cannot_be_forced_where_directions_miss_it)
{
    const ScratchFolder folder;
    sdf::write_grains(folder.path() / "grains.vdb", std::vector{grain(1, 44, hook)}, made);
    const ProgramResult refused = run_program("ls2sh grains.vdb -o grains.sh.h5", folder.path());
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.err.find("centroid lies outside"), std::string::npos) << refused.err;
    const ProgramResult forced = run_program("ls2sh grains.vdb -o grains.sh.h5 --force", folder.path());
    EXPECT_EQ(forced.exit_code, 1);
    EXPECT_NE(forced.err.find("grain 1"), std::string::npos) << forced.err;
    EXPECT_NE(forced.err.find("--skip"), std::string::npos) << forced.err;
}

TEST(Ls2sh, gives_the_same_bytes_for_any_thread_count)
{
    const ScratchFolder folder;
    sdf::write_grains(folder.path() / "grains.vdb", std::vector{grain(1, 36, cube), grain(2, 36, ball)}, made);
    ASSERT_EQ(run_program("ls2sh grains.vdb -o a.sh.h5 --threads 1", folder.path()).exit_code, 0);
    ASSERT_EQ(run_program("ls2sh grains.vdb -o b.sh.h5 --threads 2", folder.path()).exit_code, 0);
    EXPECT_TRUE(read_text_file(folder.path() / "a.sh.h5") == read_text_file(folder.path() / "b.sh.h5"));
}

TEST(Ls2sh, ends_with_1_on_a_damaged_file_and_with_2_on_a_wrong_option)
{
    const ScratchFolder folder;
    write_text(folder.path() / "grains.vdb", "not a level set at all, but a text of some length to be read as a header");
    const ProgramResult damaged = run_program("ls2sh grains.vdb -o grains.sh.h5", folder.path());
    EXPECT_EQ(damaged.exit_code, 1);
    EXPECT_NE(damaged.err.find("grains.vdb"), std::string::npos) << damaged.err;
    EXPECT_EQ(run_program("ls2sh absent.vdb -o grains.sh.h5", folder.path()).exit_code, 2);
    EXPECT_EQ(run_program("ls2sh grains.vdb -o grains.sh.h5 --tolerance 3mm", folder.path()).exit_code, 2);
    EXPECT_EQ(run_program("ls2sh grains.vdb -o grains.sh.h5 --force --skip", folder.path()).exit_code, 2);
}

}  // namespace
}  // namespace coral::test
