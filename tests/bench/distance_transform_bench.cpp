// Exact Euclidean distance transform, per voxel.
#include <benchmark/benchmark.h>

#include "bench/grains.h"
#include "morph/distance_transform.h"

namespace {

void squared_distances(benchmark::State& state)
{
    const coral::bench::VoxelGrain grain(1.25 * coral::bench::grain_diameter / static_cast<double>(state.range(0)));
    for (auto _ : state) benchmark::DoNotOptimize(coral::morph::squared_distances(grain.voxels, grain.mask.size, 0, Eigen::Vector3d::Ones()));
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(grain.voxels.size()));
}
BENCHMARK(squared_distances)->ArgName("edge")->Arg(64)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
