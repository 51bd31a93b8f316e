// ls2sh against shapes whose harmonics are known: through voxels and level set, as a user's scan goes.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "core/table.h"
#include "morph/stack_io.h"
#include "sdf/vdb_io.h"
#include "sh/quadrature.h"
#include "sh/shape_file.h"
#include "sh/tabulate.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

/// Point-symmetric surface (even degrees only), so that its centroid is its centre and coefficients compare one by one.
sh::Surface symmetric_surface(double mean_radius, double roughness, unsigned seed)
{
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    sh::Surface surface;
    surface.degree = 8;
    surface.coefficients.assign(std::size_t(sh::coefficient_count(8)), 0.0);
    surface.coefficients[0] = mean_radius * std::sqrt(4 * std::numbers::pi);
    for (int l = 2; l <= 8; l += 2)
        for (int m = -l; m <= l; ++m) surface.coefficients[std::size_t(sh::coefficient_index(l, m))] = roughness * mean_radius * normal(random) / std::pow(l, 1.5);
    return surface;
}

/// Voxels whose centre lies inside the surface, placed off the voxel grid, with a margin.
morph::VoxelStack voxels_of(const sh::Surface& surface, double voxel)
{
    const sh::Evaluator evaluator(surface);
    const int n = 2 * int(std::ceil(sh::body_properties(surface).largest_radius / voxel)) + 8;
    const Eigen::Vector3d middle = voxel * (Eigen::Vector3d::Constant(0.5 * n) + Eigen::Vector3d(0.31, -0.17, 0.43));
    std::vector<std::uint32_t> values;
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const Eigen::Vector3d x = voxel * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5) - middle;
                values.push_back(x.norm() < 0.5 * surface.coefficients[0] / std::sqrt(4 * std::numbers::pi) || evaluator.radial_distance(x) < 0);
            }
    morph::VoxelStack stack;
    stack.size = {n, n, n};
    stack.voxel_size = Eigen::Vector3d::Constant(voxel);
    stack.values = values;
    return stack;
}

TEST(Ls2shAccuracy, finds_a_known_shape_again_to_a_thousandth_of_its_radius_through_voxels_of_a_hundredth_of_its_diameter)
{
    const ScratchFolder folder;
    const double mean_radius = 5e-3, voxel = 2 * mean_radius / 100;
    const sh::Surface truth = symmetric_surface(mean_radius, 0.12, 5);
    morph::write_tiff(voxels_of(truth, voxel), folder.path() / "shape.tif", 8);
    const ProgramResult grains = run_program("csct2ls shape.tif -o grains.vdb --voxel-size 100um --spacing 200um --throat 200um --quiet", folder.path());
    ASSERT_EQ(grains.exit_code, 0) << grains.err;
    const ProgramResult shapes = run_program("ls2sh grains.vdb -o shape.sh.h5 --degree 8 --quiet", folder.path());
    ASSERT_EQ(shapes.exit_code, 0) << shapes.err;
    const sh::Surface found = sh::read_shapes(folder.path() / "shape.sh.h5").shapes.at(0).surface;
    double worst = 0, squares = 0;
    for (std::size_t k = 0; k < truth.coefficients.size(); ++k) {
        const double error = (found.coefficients[k] - truth.coefficients[k]) / mean_radius;
        worst = std::max(worst, std::abs(error));
        squares += error * error;
    }
    const double rms_radius = std::sqrt(squares / (4 * std::numbers::pi));  // Parseval
    std::printf("largest error of a coefficient %.2e, RMS of the radius %.2e of the mean radius\n", worst, rms_radius);
    EXPECT_LE(worst, 1e-3);
    EXPECT_LE(rms_radius, 1e-3);
}

TEST(Ls2shAccuracy, gives_analytic_coefficients_back_and_scales_volume_exactly)
{
    // The analytic radius, sampled where the rays of the fit are cast, and analysed as the fit does.
    const sh::Surface truth = symmetric_surface(1.0, 0.2, 9);
    const sh::Evaluator evaluator(truth);
    sh::RadialSamples samples;
    samples.max_degree = 8;
    for (const Eigen::Vector3d& u : sh::oversampled_quadrature(8).directions) samples.radii.push_back(evaluator.radius(u));
    const sh::Surface raw = sh::fit(samples, 8, 0);
    for (std::size_t k = 0; k < truth.coefficients.size(); ++k) EXPECT_NEAR(raw.coefficients[k], truth.coefficients[k], 1e-10);
    EXPECT_NEAR(sh::body_properties(sh::fit(samples, 8, 3.7)).volume / 3.7, 1.0, 1e-6);
}

/// Grain of the voxels about the origin, n per axis, that are `solid`.
sdf::GrainLevelSet drawn_grain(int id, int n, const std::function<bool(const Eigen::Vector3d&)>& solid)
{
    const double voxel = 1e-4;
    std::vector<std::uint8_t> voxels;
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) voxels.push_back(solid(Eigen::Vector3d(i, j, k) - Eigen::Vector3d::Constant(0.5 * n)));
    const sdf::GrainMask mask{Eigen::Vector3i::Constant(n), Eigen::Vector3d::Constant(voxel), Eigen::Vector3d::Zero(), voxels};
    sdf::GrainLevelSet grain = sdf::grain_from_masks(mask, mask, {.spacing = 1.5 * voxel});
    grain.id = grain.label = id;
    return grain;
}

/// A ball with a deep slot, a C from the side: not star-shaped, yet no direction misses it.
sdf::GrainLevelSet bent_grain()
{
    return drawn_grain(1, 60, [](const Eigen::Vector3d& x) {
        const bool slot = std::abs(x.z() - 6) < 3 && x.x() > -12;
        return x.norm() < 22 && !slot;
    });
}

double number(const Table& table, const std::string& column)
{
    const auto at = std::ranges::find(table.columns, column);
    return std::get<double>(table.rows.at(0).at(std::size_t(at - table.columns.begin())));
}

TEST(Ls2shForced, marks_the_shape_and_tells_its_true_errors)
{
    const ScratchFolder folder;
    sdf::write_grains(folder.path() / "grains.vdb", std::vector{bent_grain()}, {{"csct2ls", "0.1.0", {}, {"stack.tif"}}});
    const ProgramResult refused = run_program("ls2sh grains.vdb -o g.sh.h5", folder.path());
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.err.find("% of the directions"), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("--skip leaves them out"), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("--force fits the outer envelope"), std::string::npos) << refused.err;

    const ProgramResult forced = run_program("ls2sh grains.vdb -o g.sh.h5 --force --degree 8 --table t.csv --convergence c.csv --json --quiet", folder.path());
    ASSERT_EQ(forced.exit_code, 0) << forced.err;
    EXPECT_NE(forced.err.find("outer envelope"), std::string::npos) << "silent even with --quiet: " << forced.err;
    EXPECT_EQ(nlohmann::json::parse(forced.out)["forced"], 1);
    const sh::ShapeRecord shape = sh::read_shapes(folder.path() / "g.sh.h5").shapes.at(0);
    EXPECT_EQ(shape.surface.method, "outer-envelope");
    const Table table = read_table(folder.path() / "t.csv");
    EXPECT_EQ(number(table, "forced"), 1);
    EXPECT_GT(number(table, "non_star_fraction"), sh::non_star_refusal);
    // The slot is 34 of 44 voxels deep and 6 wide: the envelope closes it, so points at its end are over 10 voxels inside, and
    // points of the envelope over it about 3 from a wall. The errors must show the first: 10 voxels of a diameter of 43.
    EXPECT_GT(number(table, "max_error"), 0.2);
    EXPECT_LT(number(table, "max_error"), 0.8);
    EXPECT_GT(number(table, "rms_error"), 0.05);
    EXPECT_GT(number(table, "volume_error"), 0.05);   // before scaling: the slot counted as solid
    EXPECT_LT(number(table, "area_error"), -0.2);     // its walls are gone
    EXPECT_GT(number(table, "inertia_error"), 0.005);
    EXPECT_NEAR(number(table, "outer_volume_excess"), number(table, "volume_error"), 0.02);
    EXPECT_EQ(read_table(folder.path() / "c.csv").rows.size(), 7u) << "every degree from 2 to 8";
}

TEST(Ls2shForced, cannot_make_a_surface_where_the_radius_is_not_positive)
{
    const ScratchFolder folder;
    const sdf::GrainLevelSet plate = drawn_grain(1, 100, [](const Eigen::Vector3d& x) { return std::abs(x.z()) < 3 && std::hypot(x.x(), x.y()) < 45; });
    const sdf::GrainLevelSet ball = drawn_grain(2, 40, [](const Eigen::Vector3d& x) { return x.norm() < 15; });
    sdf::write_grains(folder.path() / "grains.vdb", std::vector{plate, ball}, {{"csct2ls", "0.1.0", {}, {"stack.tif"}}});
    for (const char* option : {"", " --force"}) {
        const ProgramResult refused = run_program(std::string("ls2sh grains.vdb -o g.sh.h5 --degree 8") + option, folder.path());
        EXPECT_EQ(refused.exit_code, 1) << option;
        EXPECT_NE(refused.err.find("grain 1: degree 8 gives a radius that is not positive"), std::string::npos) << refused.err;
        EXPECT_FALSE(std::filesystem::exists(folder.path() / "g.sh.h5"));
    }
    const ProgramResult skipped = run_program("ls2sh grains.vdb -o g.sh.h5 --degree 8 --skip --json --quiet", folder.path());
    ASSERT_EQ(skipped.exit_code, 0) << skipped.err;
    EXPECT_EQ(nlohmann::json::parse(skipped.out)["left_out"], 1);
    EXPECT_EQ(sh::read_shapes(folder.path() / "g.sh.h5").shapes.at(0).id, 2);
}

TEST(Ls2shAccuracy, fits_a_file_of_many_grains_alike)
{
    const ScratchFolder folder;
    std::vector<sdf::GrainLevelSet> grains;
    std::vector<sh::Surface> truth;
    for (int id = 1; id <= 24; ++id) {
        if (id > 3) {  // tabulating is the slow part of this test: three shapes, eight times each
            grains.push_back(grains[std::size_t(id - 4)]);
            grains.back().id = id;
            continue;
        }
        const sh::Surface surface = sh::centred(symmetric_surface(7.5e-3, 0.12, unsigned(id)));
        truth.push_back(surface);
        const double spacing = 2e-4;  // D/75, as for a 15 mm grain of the paper
        sdf::GrainLevelSet grain;
        grain.id = id;
        grain.label = std::uint32_t(id);
        grain.solid = sh::tabulate(surface, spacing, 9 * spacing, 6 * spacing);
        for (float& d : grain.solid.distance) d = std::min(d, float(9 * spacing));
        grain.solid.outside_limit = 9 * spacing;
        grain.apparent = grain.solid;
        grain.volume = grain.apparent_volume = sh::body_properties(surface).volume;
        grain.equivalent_diameter = std::cbrt(6 * grain.volume / std::numbers::pi);
        grains.push_back(std::move(grain));
    }
    sdf::write_grains(folder.path() / "grains.vdb", grains, {{"csct2ls", "0.1.0", {}, {"stack.tif"}}});
    const ProgramResult result = run_program("ls2sh grains.vdb -o g.sh.h5 --threads 2 --quiet", folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const std::vector<sh::ShapeRecord> shapes = sh::read_shapes(folder.path() / "g.sh.h5").shapes;
    ASSERT_EQ(shapes.size(), grains.size());
    for (std::size_t g = 0; g < shapes.size(); ++g) {
        const sh::Surface& fitted = shapes[g].surface;
        ASSERT_EQ(fitted.degree, 10);
        for (std::size_t k = 0; k < truth[g % 3].coefficients.size(); ++k)
            EXPECT_NEAR(fitted.coefficients[k], truth[g % 3].coefficients[k], 2e-3 * 7.5e-3) << g << " " << k;
        EXPECT_EQ(fitted.coefficients, shapes[g % 3].surface.coefficients) << "the place in the file does not matter";
    }
}

}  // namespace
}  // namespace coral::test
