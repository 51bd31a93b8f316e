// Steps of the flow solver at the size of the reference case and at half of it, with the time of each phase; the Poisson solve alone.
#include <benchmark/benchmark.h>

#include <random>

#include "fluid/drag.h"
#include "fluid/flow.h"
#include "fluid/immersed.h"
#include "fluid/poisson.h"
#include "fluid/porous.h"

namespace {

using namespace coral::fluid;
using Eigen::Vector3d;

/// The domain of the reference case (60 x 60 x 64 mm, inlet above, outlet below) with n cells along x.
GridSpec domain(int n)
{
    GridSpec grid;
    grid.cell = 60e-3 / n;
    grid.cells = {n, n, n * 16 / 15};
    grid.boundary[5] = {BoundaryKind::inlet, {0, 0, -0.1}, 0};
    grid.boundary[4] = {BoundaryKind::outlet, Vector3d::Zero(), 0};
    return grid;
}

void report(benchmark::State& state, const Flow& flow, const FlowTimes& before)
{
    const FlowTimes& now = flow.times();
    const double steps = static_cast<double>(state.iterations());
    const auto ms = [&](double after, double earlier) { return 1000 * (after - earlier) / steps; };
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(flow.grid().cell_count()));
    state.counters["predictor_ms"] = ms(now.predictor, before.predictor);
    state.counters["poisson_ms"] = ms(now.poisson, before.poisson);
    state.counters["correction_ms"] = ms(now.correction, before.correction);
    state.counters["forcing_ms"] = ms(now.forcing, before.forcing);
    state.counters["fines_ms"] = ms(now.fines, before.fines);
}

FlowOptions options(const benchmark::State& state)
{
    FlowOptions options;
    options.precision = state.range(1) == 32 ? Precision::float32 : Precision::float64;
    return options;
}

void flow_step(benchmark::State& state)
{
    Flow flow(domain(static_cast<int>(state.range(0))), options(state));
    for (int i = 0; i < 3; ++i) flow.step(flow.stable_time_step());
    const FlowTimes before = flow.times();
    for (auto _ : state) flow.step(flow.stable_time_step());
    report(state, flow, before);
}
BENCHMARK(flow_step)->ArgNames({"cells_x", "bits"})->ArgsProduct({{60, 120, 240}, {64, 32}})->Unit(benchmark::kMillisecond)->UseRealTime();

/// 48 spheres of 15 mm on a lattice, moving slowly, so that their faces are found anew.
void flow_step_with_grains(benchmark::State& state)
{
    const GridSpec grid = domain(static_cast<int>(state.range(0)));
    Flow flow(grid, options(state));
    ImmersedBodies bodies(grid);
    std::vector<RigidMotion> motions;
    for (int i = 0; i < 36; ++i) {
        RigidMotion motion;
        motion.position = Vector3d(0.011 + 0.0185 * (i % 3), 0.011 + 0.0185 * (i / 3 % 3), 0.009 + 0.0152 * (i / 9));
        motion.velocity = Vector3d(1e-3, 0, -1e-3);
        motions.push_back(motion);
        bodies.add(sphere_shape(15e-3), motion);
    }
    const auto step = [&] {
        const double dt = flow.stable_time_step();
        bodies.place(motions);
        flow.predict(dt);
        bodies.measure(flow, dt, motions);
        for (RigidMotion& motion : motions) motion.position += dt * motion.velocity;
        bodies.apply(flow, motions);
        flow.project(dt);
    };
    for (int i = 0; i < 3; ++i) step();
    const FlowTimes before = flow.times();
    for (auto _ : state) step();
    report(state, flow, before);
}
BENCHMARK(flow_step_with_grains)->ArgNames({"cells_x", "bits"})->ArgsProduct({{60, 120, 240}, {64, 32}})->Unit(benchmark::kMillisecond)->UseRealTime();

/// 3900 fines of 1.5 to 3 mm spread over the domain, held in place.
void flow_step_with_fines(benchmark::State& state)
{
    const GridSpec grid = domain(static_cast<int>(state.range(0)));
    Flow flow(grid, options(state));
    FineCoupling fines(grid);
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<Vector3d> positions, velocities(3900, Vector3d::Zero()), forces(3900, Vector3d::Zero()), lag(3900);
    std::vector<double> diameters, volumes, coefficients(3900);
    for (int i = 0; i < 3900; ++i) {
        const double x = unit(random), y = unit(random), z = unit(random);
        positions.push_back(grid.size().cwiseProduct(Vector3d(x, y, z)));
        diameters.push_back(1.5e-3 + 1.5e-3 * unit(random));
        volumes.push_back(3.14159265358979 / 6 * std::pow(diameters.back(), 3));
    }
    std::vector<FeltFlow> felt(3900);
    const auto step = [&] {
        fines.place(positions, diameters, nullptr);
        fines.deposit_volume(flow, volumes, velocities);
        fines.feel(flow, felt);
        for (std::size_t i = 0; i < felt.size(); ++i) {
            coefficients[i] = drag_coefficient(DragLaw::gidaspow, felt[i].void_fraction, felt[i].velocity.norm(), diameters[i], 1000, 1e-6);
            forces[i] = coefficients[i] * felt[i].velocity;
        }
        fines.deposit_drag(flow, coefficients, forces);
        const double dt = flow.stable_time_step();
        flow.predict(dt);
        fines.drag_lag(flow, coefficients, lag);
        flow.project(dt);
    };
    for (int i = 0; i < 3; ++i) step();
    const FlowTimes before = flow.times();
    for (auto _ : state) step();
    report(state, flow, before);
    state.counters["weights"] = static_cast<double>(fines.stored_weights());
}
BENCHMARK(flow_step_with_fines)->ArgNames({"cells_x", "bits"})->ArgsProduct({{60, 120, 240}, {64, 32}})->Unit(benchmark::kMillisecond)->UseRealTime();

void poisson_solve(benchmark::State& state)
{
    const GridSpec grid = domain(static_cast<int>(state.range(0)));
    const Poisson poisson(grid, options(state).precision);
    FlowField work = poisson.make_work(), scratch;
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> value(-1, 1);
    FlowField source = work;
    for (std::size_t at = 0; at < source.size(); ++at) source.set(at, value(random));
    for (auto _ : state) {
        state.PauseTiming();
        work = source;
        state.ResumeTiming();
        poisson.solve(work, scratch);
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(grid.cell_count()));
}
BENCHMARK(poisson_solve)->ArgNames({"cells_x", "bits"})->ArgsProduct({{60, 120, 240}, {64, 32}})->Unit(benchmark::kMillisecond)->UseRealTime();

/// a = b + s c on arrays of the size of a field: what memory gives at best. Bytes as counted by the loop: two read, one written.
void triad(benchmark::State& state)
{
    const std::size_t n = Layout(domain(static_cast<int>(state.range(0))).cells).total;
    in_precision(options(state).precision, [&]<class Real>(Real) {
        std::vector<Real, CacheAligned<Real>> a(n, Real(0)), b(n, Real(1)), c(n, Real(2));
        for (auto _ : state) {
            for (std::size_t i = 0; i < n; ++i) a[i] = b[i] + Real(3) * c[i];
            benchmark::DoNotOptimize(a.data());
            benchmark::ClobberMemory();
        }
        state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(3 * n * sizeof(Real)));
    });
}
BENCHMARK(triad)->ArgNames({"cells_x", "bits"})->ArgsProduct({{60, 120, 240}, {64, 32}})->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
