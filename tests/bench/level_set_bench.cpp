// From voxels to what contact needs: level set, exact extension, surface nodes; and the harmonic shape of the same grain.
#include <benchmark/benchmark.h>

#include "bench/grains.h"
#include "sdf/extend.h"
#include "sdf/level_set.h"
#include "sdf/surface_nodes.h"
#include "sh/fit.h"
#include "sh/tabulate.h"

namespace {

using namespace coral;

constexpr double spacing = 2e-4;  ///< the paper's for grains of 15 mm [m]

const sdf::DistanceGrid& grain_grid()
{
    static const bench::VoxelGrain grain(spacing);
    static const sdf::DistanceGrid grid = sdf::level_set_from_mask(grain.mask, {});
    return grid;
}

void level_set_from_mask(benchmark::State& state)
{
    const bench::VoxelGrain grain(1e-6 * static_cast<double>(state.range(0)));
    for (auto _ : state) benchmark::DoNotOptimize(sdf::level_set_from_mask(grain.mask, {}));
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(grain.voxels.size()));
}
BENCHMARK(level_set_from_mask)->ArgName("voxel_um")->Arg(200)->Arg(100)->Unit(benchmark::kMillisecond)->UseRealTime();

void extended(benchmark::State& state)
{
    std::size_t nodes = 0;
    for (auto _ : state) nodes = sdf::extended(grain_grid(), 1e-6 * static_cast<double>(state.range(0))).node_count();
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(nodes));
}
BENCHMARK(extended)->ArgName("outside_um")->Arg(1500)->Unit(benchmark::kMillisecond)->UseRealTime();

void surface_nodes(benchmark::State& state)
{
    for (auto _ : state) benchmark::DoNotOptimize(sdf::surface_nodes(grain_grid(), static_cast<int>(state.range(0))));
    state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(surface_nodes)->ArgName("nodes")->Arg(2500)->Arg(6000)->Unit(benchmark::kMillisecond)->UseRealTime();

void harmonic_fit(benchmark::State& state)
{
    const int degree = static_cast<int>(state.range(0));
    for (auto _ : state) {
        const sh::RadialSamples samples = sh::cast_rays(grain_grid(), degree);
        benchmark::DoNotOptimize(sh::fit(samples, degree, samples.outer_volume));
    }
    state.SetItemsProcessed(state.iterations() * 32 * (degree + 1) * (degree + 1));  // rays
}
BENCHMARK(harmonic_fit)->ArgName("degree")->Arg(5)->Arg(10)->Arg(20)->Unit(benchmark::kMillisecond)->UseRealTime();

void harmonic_tabulate(benchmark::State& state)
{
    const sh::RadialSamples samples = sh::cast_rays(grain_grid(), 10);
    const sh::Surface surface = sh::centred(sh::fit(samples, 10, samples.outer_volume));
    std::size_t nodes = 0;
    for (auto _ : state) nodes = sh::tabulate(surface, 2.5e-4, 1.5e-3).node_count();
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(nodes));
}
BENCHMARK(harmonic_tabulate)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
