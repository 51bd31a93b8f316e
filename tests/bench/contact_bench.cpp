// Steps of the contact solver: spheres alone, grains with lattices alone, and a mixture as in a suffusion sample.
#include <benchmark/benchmark.h>

#include <random>

#include "dem/polyhedra_for_tests.h"

namespace {

using namespace coral::dem;
using coral::dem::testing::Vec3;

void report(benchmark::State& state, const World& world, const Counters& before)
{
    const Counters& after = world.counters();
    const auto rate = [](std::int64_t count) { return benchmark::Counter(static_cast<double>(count), benchmark::Counter::kIsRate); };
    state.SetItemsProcessed((after.steps - before.steps) * world.active_count());
    state.counters["contacts/s"] = rate(after.contacts - before.contacts);
    state.counters["nodes/s"] = rate(after.node_tests - before.node_tests);
    state.counters["contacts"] = static_cast<double>(world.statistics().contacts);
}

void run(benchmark::State& state, World& world)
{
    const double dt = world.auto_time_step();
    for (int i = 0; i < 20; ++i) world.step(dt);  // lists and springs are there
    const Counters before = world.counters();
    for (auto _ : state) world.step(dt);
    report(state, world, before);
}

/// Spheres on a lattice, each a little into its neighbours, so that nearly all of them touch.
void spheres(benchmark::State& state)
{
    World world = testing::quiet_world(0.3, 0.7, Vec3(0, 0, -9.81));
    const int shape = world.add_shape(Shape::sphere());
    const int edge = static_cast<int>(state.range(0));
    const double d = 2e-3, pitch = 0.998 * d;
    world.add_box(Vec3::Zero(), Vec3::Constant(edge * pitch));
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> shift(-0.01 * d, 0.01 * d);
    for (int i = 0; i < edge * edge * edge; ++i) {
        const double dx = shift(random), dy = shift(random);
        testing::add_sphere(world, shape, d, pitch * Vec3(i % edge + 0.5, i / edge % edge + 0.5, i / edge / edge + 0.5) + Vec3(dx, dy, shift(random)));
    }
    run(state, world);
}
BENCHMARK(spheres)->ArgName("edge")->Arg(10)->Arg(16)->Arg(25)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Hollow grains of 15 mm at 200 um with 6000 nodes, 3 x 3 x 3; fines of 2 mm fill the gaps when asked for.
World grains(bool with_fines)
{
    World world = testing::quiet_world(0.3, 0.7, Vec3(0, 0, -9.81));
    const double radius = 7.5e-3, pitch = 2 * radius - 2e-5, fine = 2e-3;
    const int hollow = world.add_shape(testing::hollow_ball(radius, 4e-3, 2e-4, 6000, 0.5 * fine + 4e-4));
    const int ball = world.add_shape(Shape::sphere());
    world.add_box(Vec3::Zero(), Vec3::Constant(3 * pitch));
    std::vector<Vec3> centres;
    for (int i = 0; i < 27; ++i) {
        BodySpec body;
        body.shape = hollow;
        body.position = pitch * Vec3(i % 3 + 0.5, i / 3 % 3 + 0.5, i / 9 + 0.5);
        centres.push_back(body.position);
        world.add_body(body);
    }
    if (!with_fines) return world;
    const int edge = static_cast<int>(3 * pitch / fine);
    for (int i = 0; i < edge * edge * edge; ++i) {
        const Vec3 p = fine * Vec3(i % edge + 0.5, i / edge % edge + 0.5, i / edge / edge + 0.5);
        const bool free = std::ranges::all_of(centres, [&](const Vec3& c) { return (p - c).norm() > radius + 0.499 * fine; });
        if (free) testing::add_sphere(world, ball, fine, p);
    }
    return world;
}

void level_set_grains(benchmark::State& state)
{
    World world = grains(false);
    run(state, world);
}
BENCHMARK(level_set_grains)->Unit(benchmark::kMillisecond)->UseRealTime();

void level_set_grains_with_fines(benchmark::State& state)
{
    World world = grains(true);
    run(state, world);
}
BENCHMARK(level_set_grains_with_fines)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Stones of 26 faces on a lattice, a little into each other; 20 templates.
void polyhedra(benchmark::State& state)
{
    World world = testing::quiet_world(0.3, 0.7, Vec3(0, 0, -9.81));
    std::vector<int> shapes;
    for (unsigned k = 0; k < 20; ++k) shapes.push_back(world.add_shape(testing::polyhedron_shape(testing::stone(26, k))));
    const int edge = 10;
    const double pitch = 1.9e-3;
    world.add_box(Vec3::Zero(), Vec3::Constant(edge * pitch));
    std::mt19937_64 random(3);
    std::normal_distribution<double> n;
    for (int i = 0; i < edge * edge * edge; ++i) {
        BodySpec body;
        body.shape = shapes[static_cast<std::size_t>(i % 20)];
        body.position = pitch * Vec3(i % edge + 0.5, i / edge % edge + 0.5, i / edge / edge + 0.5);
        const double w = n(random), x = n(random), y = n(random), z = n(random);
        body.orientation = Eigen::Quaterniond(w, x, y, z).normalized();
        world.add_body(body);
    }
    run(state, world);
}
BENCHMARK(polyhedra)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Distance to a stone from points around it: for nodes (planes alone) and exact (spheres, flow).
void polyhedron_distance(benchmark::State& state)
{
    const Polyhedron stone = testing::stone(static_cast<int>(state.range(0)), 4);
    const bool exact = state.range(1) != 0;
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> u(-1.5e-3, 1.5e-3);
    std::vector<Vec3> points;
    for (int i = 0; i < 1024; ++i) {
        const double x = u(random), y = u(random);
        points.emplace_back(x, y, u(random));
    }
    for (auto _ : state)
        for (const Vec3& p : points) {
            Vec3 gradient;
            benchmark::DoNotOptimize(exact ? stone.distance_and_gradient(p, gradient) : stone.depth_and_normal(p, gradient));
        }
    state.SetItemsProcessed(state.iterations() * 1024);
}
BENCHMARK(polyhedron_distance)->ArgNames({"faces", "exact"})->ArgsProduct({{12, 26, 60}, {0, 1}});

}  // namespace
