#include "core/parallel_within.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <vector>

#include "core/parallel.h"

namespace coral {
namespace {

/// Each lane takes the next task when it is done with one.
void run_in_lanes(std::size_t lanes, std::span<const std::size_t> tasks, const std::function<void(std::size_t)>& task)
{
    std::atomic<std::size_t> next = 0;
    tbb::parallel_for(std::size_t{0}, std::min(lanes, tasks.size()), [&](std::size_t) {
        for (std::size_t n = next++; n < tasks.size(); n = next++) {
            try {
                // Isolated: a thread that waits for the inner loops must not start another task and its memory.
                tbb::this_task_arena::isolate([&] { task(tasks[n]); });
            } catch (...) {
                next = tasks.size();
                throw;
            }
        }
    }, tbb::simple_partitioner{});
}

}  // namespace

void parallel_within(double budget, std::span<const double> cost, const std::function<void(std::size_t)>& task)
{
    std::vector<std::size_t> order(cost.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return cost[a] > cost[b]; });
    const auto threads = std::size_t(thread_count());
    const auto lanes = [&](std::size_t n) {
        const double fit = budget / std::max(cost[n], 1e-300);
        return fit < double(threads) ? std::max(std::size_t(fit), std::size_t{1}) : threads;
    };
    // Tasks of about one size together: the few giants do not hold the many small ones back.
    for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
        while (end < order.size() && lanes(order[end]) == lanes(order[begin])) ++end;
        run_in_lanes(lanes(order[begin]), std::span(order).subspan(begin, end - begin), task);
    }
}

}  // namespace coral
