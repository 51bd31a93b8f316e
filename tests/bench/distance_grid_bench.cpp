// Distances out of a dense lattice: what contact and the solid fraction of cells spend their time in.
#include <benchmark/benchmark.h>

#include <random>

#include "sdf/distance_grid.h"

namespace {

using Eigen::Vector3d;

coral::sdf::DistanceGrid ball(int nodes)
{
    coral::sdf::DistanceGrid grid;
    grid.size.setConstant(nodes);
    grid.spacing = 2e-4;
    grid.origin.setConstant(-0.5 * grid.spacing * (nodes - 1));
    const double radius = 0.35 * grid.spacing * nodes;
    for (int k = 0; k < nodes; ++k)
        for (int j = 0; j < nodes; ++j)
            for (int i = 0; i < nodes; ++i) grid.distance.push_back(static_cast<float>(grid.node(i, j, k).norm() - radius));
    return grid;
}

/// Points in the box: at random, or in the order of neighbours as contact nodes lie.
std::vector<Vector3d> points(const coral::sdf::DistanceGrid& grid, bool ordered)
{
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<Vector3d> list;
    for (int i = 0; i < 4096; ++i) {
        Vector3d t(unit(random), unit(random), unit(random));
        if (ordered) t = Vector3d(i % 16, i / 16 % 16, i / 256) / 16.0 + 0.02 * t;
        list.push_back(grid.origin + t.cwiseProduct(grid.upper() - grid.origin));
    }
    return list;
}

void sample(benchmark::State& state)
{
    const auto grid = ball(static_cast<int>(state.range(0)));
    const auto list = points(grid, state.range(1) != 0);
    for (auto _ : state) {
        double sum = 0;
        for (const Vector3d& p : list) sum += grid.sample(p);
        benchmark::DoNotOptimize(sum);
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(list.size()));
}
BENCHMARK(sample)->ArgNames({"nodes", "ordered"})->Args({64, 1})->Args({64, 0})->Args({160, 1})->Args({160, 0});

void sample_with_gradient(benchmark::State& state)
{
    const auto grid = ball(static_cast<int>(state.range(0)));
    const auto list = points(grid, state.range(1) != 0);
    for (auto _ : state) {
        Vector3d sum = Vector3d::Zero(), gradient;
        for (const Vector3d& p : list) sum += grid.sample_with_gradient(p, gradient) * gradient;
        benchmark::DoNotOptimize(sum);
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(list.size()));
}
BENCHMARK(sample_with_gradient)->ArgNames({"nodes", "ordered"})->Args({64, 1})->Args({64, 0})->Args({160, 1})->Args({160, 0});

}  // namespace
