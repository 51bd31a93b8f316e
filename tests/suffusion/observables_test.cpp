// Observables on scenes whose answers are known in closed form.
#include "suffusion/observables.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/error.h"
#include "core/output_file.h"
#include "sdf/vdb_io.h"
#include "suffusion/case_file.h"
#include "suffusion/fabric.h"
#include "suffusion/run.h"
#include "suffusion/scratch.h"
#include "suffusion/slices.h"
#include "suffusion/throats.h"

namespace coral::suffusion {
namespace {

using Eigen::Vector3d;
using test::Scratch;

// ---- fabric ----

/// Points of a golden spiral: as even over the sphere as n points are.
std::vector<Vector3d> even_normals(int n)
{
    std::vector<Vector3d> normals;
    for (int k = 0; k < n; ++k) {
        const double z = 1 - (2 * k + 1.0) / n, phi = k * std::numbers::pi * (3 - std::sqrt(5.0));
        normals.emplace_back(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
    }
    return normals;
}

/// Reproducible normal with density 1 + c P2(cos theta), by rejection.
std::vector<Vector3d> random_normals(int n, double c, unsigned seed)
{
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> even(-1, 1), share(0, 1);
    std::vector<Vector3d> normals;
    while (static_cast<int>(normals.size()) < n) {
        const double z = even(random), phi = std::numbers::pi * even(random);
        if (share(random) * (1 + std::abs(c)) > 1 + c * (1.5 * z * z - 0.5)) continue;
        normals.emplace_back(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
    }
    return normals;
}

TEST(Fabric, is_isotropic_for_an_even_spread_and_known_for_one_axis_and_one_plane)
{
    const Fabric even = fabric_of(even_normals(20000));
    EXPECT_NEAR(even.anisotropy, 0, 1e-3);
    EXPECT_NEAR(even.tensor.trace(), 1, 1e-12);
    // All along z: F - I/3 = diag(-1,-1,2)/3, a = 15/2 of it, A = 7.5 sqrt(3/2 * 6/9) = 7.5.
    const std::vector<Vector3d> axis(10, -Vector3d::UnitZ());
    EXPECT_NEAR(fabric_of(axis).anisotropy, 7.5, 1e-12);
    EXPECT_NEAR(fabric_of(axis).error, 0, 1e-6);
    // Even in the plane z = 0: diag(1,1,-2)/6, half of that.
    const std::vector<Vector3d> plane{Vector3d::UnitX(), Vector3d::UnitY(), -Vector3d::UnitX(), Vector3d::UnitY()};
    EXPECT_NEAR(fabric_of(plane).anisotropy, 3.75, 1e-12);
    EXPECT_EQ(fabric_of({}).anisotropy, 0);
    EXPECT_EQ(fabric_of({}).count, 0);
}

TEST(Fabric, recovers_the_coefficient_of_a_known_distribution)
{
    // E(n) = (1 + a_ij n_i n_j)/4 pi with a = c diag(-1/2,-1/2,1): A = sqrt(3/2 * 3/2) c = 1.5 c.
    const Fabric fabric = fabric_of(random_normals(200000, 0.4, 5));
    EXPECT_NEAR(fabric.anisotropy, 0.6, 4 * fabric.error);
    EXPECT_LT(fabric.error, 0.02);
}

TEST(Fabric, error_is_the_scatter_over_repeats_and_floor_that_of_random_normals)
{
    const int repeats = 400, n = 500;
    double sum = 0, squares = 0, error = 0, random_squares = 0;
    for (int k = 0; k < repeats; ++k) {
        const Fabric fabric = fabric_of(random_normals(n, 0.8, 100 + static_cast<unsigned>(k)));
        sum += fabric.anisotropy;
        squares += fabric.anisotropy * fabric.anisotropy;
        error += fabric.error / repeats;
        random_squares += std::pow(fabric_of(random_normals(n, 0, 900 + static_cast<unsigned>(k))).anisotropy, 2) / repeats;
    }
    const double scatter = std::sqrt(squares / repeats - std::pow(sum / repeats, 2));
    EXPECT_NEAR(error / scatter, 1, 0.15);  // the scatter of 400 repeats is known to 3.5 %
    EXPECT_NEAR(std::sqrt(random_squares) / fabric_of(random_normals(n, 0, 1)).floor, 1, 0.05);
}

// ---- states of fines ----

TEST(MotionState, counts_cycles_of_clogging_and_not_jitter)
{
    const double d = 2e-3;
    MotionState state;
    const auto expect = [&](double diameters_per_second, FineState expected, std::int64_t cloggings, std::int64_t uncloggings) {
        state.update(diameters_per_second * d, d, false);
        EXPECT_EQ(state.state(), expected) << diameters_per_second;
        EXPECT_EQ(state.cloggings(), cloggings);
        EXPECT_EQ(state.uncloggings(), uncloggings);
    };
    expect(0, FineState::resting, 0, 0);
    expect(3, FineState::resting, 0, 0);  // creeps, and has not set out
    expect(5, FineState::moving, 0, 0);
    expect(2, FineState::moving, 0, 0);   // slower, and not stopped
    expect(0.5, FineState::clogged, 1, 0);
    expect(3, FineState::clogged, 1, 0);
    expect(50, FineState::moving, 1, 1);
    expect(0, FineState::clogged, 2, 1);
    state.update(0, d, true);
    EXPECT_EQ(state.state(), FineState::eroded);
    EXPECT_EQ(state.cloggings(), 2);
}

// ---- scenes ----

const std::string walls = "[domain]\nsize = [0.016, 0.016, 0.024]\n";

std::string ball(double diameter, const Vector3d& x, const std::string& more)
{
    return fmt::format("[[body]]\nshape = {{ type = \"sphere\", diameter = {} }}\nposition = [{}, {}, {}]\n{}\n", diameter, x.x(), x.y(), x.z(), more);
}

Results run(const Scratch& scratch, const std::string& text)
{
    scratch.write("case.toml", text);
    Simulation simulation(build_scene(read_case(scratch.path())));
    Observer observer(simulation);
    observer.record(simulation);
    const double step = simulation.scene().description.output.interval, end = simulation.scene().description.time.duration;
    for (int k = 1; k * step <= end * (1 + 1e-9); ++k) {
        while (simulation.time() < k * step * (1 - 1e-12)) {
            simulation.step(k * step);
            observer.follow(simulation);
        }
        observer.record(simulation);
    }
    return observer.results();
}

TEST(Migration, path_and_states_of_prescribed_fines_are_those_of_their_motion)
{
    const Scratch scratch;
    // One at 20 mm/s along x for 0.1 s, one at rest; d = 1 mm, so that the first moves at 20 d/s.
    const Results r = run(scratch, "[gravity]\nvector = [0, 0, 0]\n" + ball(1e-3, {0, 0, 1e-3}, "role = \"fine\"\nmotion = \"prescribed\"\nvelocity = [0.02, 0, 0]") +
                                       ball(1e-3, {0, 0.01, 1e-3}, "role = \"fine\"\nmotion = \"fixed\"") + "[time]\nduration = 0.1\n[output]\ninterval = 0.01\n");
    EXPECT_NEAR(r.path_length[0], 2e-3, 1e-9);
    EXPECT_NEAR(r.net_displacement[0], 2e-3, 1e-9);
    EXPECT_EQ(r.path_length[1], 0);
    EXPECT_EQ(r.state[0], static_cast<std::int64_t>(FineState::moving));
    EXPECT_EQ(r.state[1], static_cast<std::int64_t>(FineState::resting));
    for (const Column& column : r.series) {
        if (column.name == "moving_count") { EXPECT_EQ(column.values.back(), 1); }
        if (column.name == "clogging_events") { EXPECT_EQ(column.values.back(), 0); }
    }
    ASSERT_EQ(r.trajectories.back().name, "state");
    EXPECT_EQ(r.trajectories.back().values.front(), 0);  // before the first move
    EXPECT_EQ(r.trajectories.back().values.back(), 0);   // the second fine, at the end
}

TEST(Migration, path_of_a_fine_that_comes_back_does_not_depend_on_the_outputs)
{
    // Thrown upwards at 0.1 m/s it is back after 2 v/g and has walked v^2/g.
    const double g = 10, v = 0.1, length = v * v / g, diameter = 0.5e-3;
    std::vector<double> found;
    for (const char* interval : {"0.02", "0.002", "0.0001"}) {
        const Scratch scratch;
        const Results r = run(scratch, "[gravity]\nvector = [0, 0, -10]\n" + ball(diameter, {0, 0, 5e-3}, "role = \"fine\"\nvelocity = [0, 0, 0.1]") +
                                           "[time]\nduration = 0.02\n[output]\ninterval = " + interval + "\n");
        EXPECT_NEAR(r.net_displacement[0], 0, 1e-3 * length);
        found.push_back(r.path_length[0]);
        EXPECT_NEAR(found.back(), length, 2 * 0.02 * diameter) << "a piece at the turning point, there and back";
    }
    EXPECT_NEAR(found[1], found[0], 2 * 0.02 * diameter) << "steps end at outputs, and pieces with them";
    EXPECT_NEAR(found[2], found[0], 2 * 0.02 * diameter);
}

TEST(Migration, trembling_fine_walks_nowhere)
{
    const Scratch scratch;
    // 5 um to and fro on a frictionless floor, a hundredth of the diameter, a hundred times.
    const Results r = run(scratch, "[gravity]\nvector = [0, 0, 0]\n" + ball(0.5e-3, {2.5e-6, 0, 1e-3}, "role = \"fine\"\nvelocity = [0.01, 0, 0]") +
                                       "[[wall]]\ntype = \"plane\"\npoint = [-252.5e-6, 0, 0]\nnormal = [1, 0, 0]\n[[wall]]\ntype = \"plane\"\npoint = [257.5e-6, 0, 0]\nnormal = [-1, 0, 0]\n"
                                       "[material.default]\ndensity = 2780\nnormal_stiffness = 2e5\ntangential_stiffness = 1e5\nfriction = 0\ndamping = 0\n" +
                                       "[time]\nduration = 0.1\n[output]\ninterval = 0.05\n");
    EXPECT_LT(r.path_length[0], 1e-5);
}

TEST(Layers, are_as_many_as_asked_for_and_hold_every_fine_once)
{
    const Scratch scratch;
    std::string text = "[gravity]\nvector = [0, 0, 0]\n";
    for (int k = 0; k < 10; ++k) text += ball(1e-3, {0, 0, 5e-4 + 1e-3 * k}, "role = \"fine\"\nmotion = \"fixed\"");
    const Results r = run(scratch, text + "[time]\nduration = 0.01\n[output]\ninterval = 0.01\nlayers = 5\n");
    for (const Column& column : r.series)
        if (column.name == "fines_count") { EXPECT_EQ(column.values, (std::vector<double>{2, 2, 2, 2, 2, 2, 2, 2, 2, 2})); }
    EXPECT_EQ(r.layer, (std::vector<std::int64_t>{0, 0, 1, 1, 2, 2, 3, 3, 4, 4}));
    scratch.write("bad/case.toml", text + "[time]\nduration = 0.01\n[output]\nlayers = 0\n");
    EXPECT_THROW(read_case(scratch.path() / "bad"), UsageError);
}

/// Spherical shell around the origin, with a bore of radius `mouth` along +z when that is above zero; written as grain 1.
void write_shell(const std::filesystem::path& file, double radius, double wall, double mouth)
{
    sdf::GrainLevelSet grain;
    grain.id = 1;
    grain.label = 1;
    const double h = 2e-4;
    const int n = static_cast<int>(std::ceil(2 * radius / h)) + 24;
    for (sdf::DistanceGrid* grid : {&grain.solid, &grain.apparent}) {
        grid->size = {n, n, n};
        grid->spacing = h;
        grid->origin = Vector3d::Constant(-0.5 * h * (n - 1));
        grid->outside_limit = 9 * h;
        grid->inside_limit = 6 * h;
    }
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const Vector3d p = grain.solid.node(i, j, k);
                double solid = std::max(p.norm() - radius, radius - wall - p.norm());
                if (mouth > 0 && p.z() > 0) solid = std::max(solid, mouth - std::hypot(p.x(), p.y()));
                grain.solid.distance.push_back(static_cast<float>(std::clamp(solid, -6 * h, 9 * h)));
                grain.apparent.distance.push_back(static_cast<float>(std::clamp(p.norm() - radius, -6 * h, 9 * h)));
            }
    const auto ball_volume = [](double r) { return 4.0 / 3 * std::numbers::pi * r * r * r; };
    grain.volume = ball_volume(radius) - ball_volume(radius - wall);
    grain.apparent_volume = ball_volume(radius);
    grain.equivalent_diameter = 2 * radius;
    grain.intraparticle_porosity = 1 - grain.volume / grain.apparent_volume;
    grain.inertia = 1e-12 * Eigen::Matrix3d::Identity();
    sdf::write_grains(file, {&grain, 1}, {});
}

std::string shell_at(const Vector3d& x)
{
    return fmt::format("[[body]]\nshape = {{ type = \"level-set\", file = \"shell.vdb\", grid = \"grain_1\" }}\nposition = [{}, {}, {}]\nmotion = \"fixed\"\n", x.x(), x.y(), x.z());
}

double last(const Results& r, const std::string& name)
{
    for (const Column& column : r.series)
        if (column.name == name) return column.values.back();
    ADD_FAILURE() << "no series " << name;
    return NAN;
}

/// Shell of 8 mm in a stream of 0.1 m/s, cells of 0.5 mm; long enough for the start from rest to die away.
Results shell_in_stream(const Scratch& scratch, double wall, double mouth)
{
    write_shell(scratch.path() / "shell.vdb", 4e-3, wall, mouth);
    return run(scratch, walls + "cell = 0.0005\n[boundary]\n\"z+\" = { type = \"inlet\", velocity = [0, 0, -0.1] }\n\"z-\" = { type = \"outlet\", pressure = 0 }\n[fluid]\n" +
                            shell_at({0.00801, 0.00797, 0.01203}) + "[time]\nduration = 0.05\n[output]\ninterval = 0.05\n");
}

TEST(FlowSplit, fluid_in_a_sealed_void_is_at_rest_and_counts_to_no_intraparticle_flow)
{
    const Scratch scratch;
    const Results r = shell_in_stream(scratch, 1.5e-3, 0);  // walls of three cells
    EXPECT_EQ(last(r, "velocity_intraparticle"), 0);      // nothing flows through a sealed void
    EXPECT_EQ(last(r, "intraparticle_volume"), 0);
    EXPECT_NEAR(last(r, "sealed_volume") / (4.0 / 3 * std::numbers::pi * 15.625e-9), 1, 0.15);
    EXPECT_LT(last(r, "velocity_sealed"), 0.2 * last(r, "velocity_interparticle"));
    EXPECT_GT(last(r, "velocity_interparticle"), 0.1);    // the stream is faster beside the grain
}

TEST(FlowSplit, tells_by_its_sealed_voids_when_walls_are_too_thin_for_the_cells)
{
    const Scratch scratch;
    const Results thin = shell_in_stream(scratch, 0.3e-3, 0);  // 0.6 cells
    EXPECT_GT(last(thin, "velocity_sealed"), 0.2 * last(thin, "velocity_interparticle"));
}

TEST(FlowSplit, flow_in_a_void_with_one_mouth_is_far_slower_than_outside)
{
    const Scratch scratch;
    const Results r = shell_in_stream(scratch, 1e-3, 0.6e-3);
    EXPECT_EQ(last(r, "sealed_volume"), 0);
    EXPECT_GT(last(r, "intraparticle_volume"), 0.8 * (4.0 / 3 * std::numbers::pi * 27e-9));
    EXPECT_GT(last(r, "velocity_intraparticle"), 0);
    EXPECT_LT(last(r, "velocity_intraparticle"), 0.2 * last(r, "velocity_interparticle"));
}

TEST(Trapping, tells_the_fine_inside_from_the_one_in_the_mouth_and_the_one_beside)
{
    const Scratch scratch;
    write_shell(scratch.path() / "shell.vdb", 4e-3, 1e-3, 0.6e-3);
    const Vector3d c(0.008, 0.008, 0.012);
    const auto fine = [&](const Vector3d& x) { return ball(1e-3, c + x, "role = \"fine\"\nmotion = \"fixed\""); };
    const Results r = run(scratch, walls + "cell = 0.0005\n[fluid]\n[gravity]\nvector = [0, 0, 0]\n" + shell_at(c) + fine({0, 0, 1e-3}) + fine({0, 0, 3.8e-3}) +
                                       fine({0, 0, 4.8e-3}) + fine({5e-3, 0, 0}) + "[time]\nduration = 0.001\n[output]\ninterval = 0.001\n");
    EXPECT_EQ(last(r, "trapped_count"), 2);
    EXPECT_EQ(last(r, "trapped_enclosed"), 1);
    EXPECT_EQ(last(r, "swallowed_count"), 0);
    EXPECT_EQ(last(r, "trapped_entered"), 0);
    ASSERT_EQ(r.trapped.size(), 2u);
    EXPECT_EQ(r.trapped[0].fine, 1);
    EXPECT_TRUE(r.trapped[0].enclosed);
    EXPECT_EQ(r.trapped[1].fine, 2);
    EXPECT_FALSE(r.trapped[1].enclosed);
    EXPECT_EQ(r.trapped[0].grain, 0);
    EXPECT_NEAR(r.trapped[0].throat, 1.2e-3, 2e-4);  // the bore, to a spacing
    EXPECT_GE(r.trapped[1].throat, r.trapped[0].throat);
}

TEST(Trapping, knows_the_way_out_of_a_void_by_its_narrowest_place)
{
    const Scratch scratch;
    const Vector3d origin = Vector3d::Zero();
    const auto throats_of = [&](double mouth) {
        write_shell(scratch.path() / "shell.vdb", 4e-3, 1e-3, mouth);
        return Throats(sdf::GrainReader(scratch.path() / "shell.vdb").read(1).solid);
    };
    EXPECT_EQ(throats_of(0).width(origin, 5e-4), 0);
    const double spacing = 2e-4;
    for (const double mouth : {0.3e-3, 0.45e-3, 0.8e-3, 1.2e-3}) {
        const Throats throats = throats_of(mouth);
        const double width = throats.width(origin, 5e-4);
        EXPECT_LT(width, 2 * mouth + 0.05 * spacing) << mouth;
        EXPECT_GT(width, 2 * mouth - 1.05 * spacing) << mouth;
        EXPECT_EQ(throats.width({0, 0, -2e-3}, 1e-3), width) << "at the wall";
        EXPECT_GT(throats.width({0, 0, 4.2e-3}, 2e-3), 2 * mouth) << "outside the mouth";
    }
}

TEST(Trapping, and_the_flow_in_voids_know_the_images_of_a_grain_at_a_periodic_face)
{
    const Scratch scratch;
    write_shell(scratch.path() / "shell.vdb", 4e-3, 1e-3, 0.6e-3);
    const auto run_at = [&](double x) {
        const Vector3d c(x, 0.008, 0.012);
        return run(scratch, walls + "cell = 0.0005\n[boundary]\n\"x-\" = { type = \"periodic\" }\n\"x+\" = { type = \"periodic\" }\n[fluid]\n" + shell_at(c) +
                                ball(1e-3, {std::fmod(x + 0.0155, 0.016), 0.008, 0.013}, "role = \"fine\"\nmotion = \"fixed\"") +
                                "[time]\nduration = 0.001\n[output]\ninterval = 0.001\n");
    };
    const Results middle = run_at(0.008);
    EXPECT_EQ(last(middle, "trapped_enclosed"), 1);
    for (const double x : {0.0, 0.0165}) {
        const Results seam = run_at(x);
        EXPECT_EQ(last(seam, "trapped_enclosed"), 1) << x;
        EXPECT_NEAR(last(seam, "intraparticle_volume"), last(middle, "intraparticle_volume"), 1e-12) << x;
    }
}

TEST(Trapping, dates_a_fine_that_comes_in_later)
{
    const Scratch scratch;
    write_shell(scratch.path() / "shell.vdb", 4e-3, 1e-3, 0.6e-3);
    // From 6 mm above the centre down at 0.1 m/s through the mouth: its centre is under 4 mm after 20 ms.
    const Results r = run(scratch, walls + "cell = 0.0005\n[fluid]\n[gravity]\nvector = [0, 0, 0]\n" + shell_at({0.008, 0.008, 0.012}) +
                                       ball(0.8e-3, {0.008, 0.008, 0.018}, "role = \"fine\"\nmotion = \"prescribed\"\nvelocity = [0, 0, -0.1]") +
                                       "[time]\nduration = 0.03\n[output]\ninterval = 0.005\n");
    EXPECT_EQ(last(r, "trapped_entered"), 1);
    ASSERT_EQ(r.trapped.size(), 1u);
    EXPECT_NEAR(r.trapped[0].since, 0.0225, 0.0026);
}

TEST(Slices, hold_the_speed_of_a_uniform_flow_and_show_the_grain)
{
    const Scratch scratch;
    write_shell(scratch.path() / "shell.vdb", 4e-3, 1e-3, 0);
    scratch.write("case.toml", walls + "cell = 0.0005\n[boundary]\n\"z+\" = { type = \"inlet\", velocity = [0, 0, -0.1] }\n\"z-\" = { type = \"outlet\", pressure = 0 }\n[fluid]\n" +
                                   shell_at({0.008, 0.0052, 0.012}) + "[time]\nduration = 0.0005\n[output]\ninterval = 0.0005\nframes = 0.0005\n");
    run_case(scratch.path(), {});
    const Simulation simulation(build_scene(read_case(scratch.path())));
    EXPECT_EQ(slice_row(simulation), 10);  // through the grain, not the middle
    EXPECT_EQ(slice_speed_scale(simulation, 10), 0.5);
    const pack::Picture picture = draw_slice(simulation, 10, 240);
    EXPECT_EQ(picture.height, 240);
    EXPECT_EQ(picture.width, 160);
    const auto red = [&](double x, double z) { return picture.rgb[3 * (static_cast<std::size_t>(240 - 10000 * z) * 160 + static_cast<std::size_t>(10000 * x))]; };
    EXPECT_NEAR(red(0.01125, 0.01222), 150, 15);  // the wall of the shell is grey
    EXPECT_LT(red(0.0005, 0.0235), 80);   // the water at a fifth of the scale, or at rest, is not
    for (const char* file : {"slice_00000.png", "slice_00001.png", "slice_00001.vti", "slice.pvd"}) EXPECT_TRUE(std::filesystem::exists(scratch.path() / "frames" / file)) << file;
    const std::string text = read_text_file(scratch.path() / "frames/slice_00001.vti");
    EXPECT_NE(text.find("WholeExtent=\"0 32 0 1 0 48\""), std::string::npos);
}

}  // namespace
}  // namespace coral::suffusion
