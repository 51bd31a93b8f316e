#include "core/parallel_within.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "core/parallel.h"

namespace coral {
namespace {

double sum_of_sines(int threads)
{
    set_thread_count(threads);
    return parallel_sum(std::size_t{100001}, std::size_t{128}, 0.0, [](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += std::sin(double(i)) * 1e-3;
        return sum;
    });
}

TEST(Parallel, sums_have_the_same_bits_for_any_thread_count)
{
    const double one = sum_of_sines(1);
    EXPECT_EQ(sum_of_sines(2), one);
    EXPECT_EQ(sum_of_sines(5), one);
    set_thread_count(0);
}

TEST(Parallel, blocks_cover_every_element_once)
{
    std::vector<int> visits(1000);
    set_thread_count(2);
    parallel_blocks(visits.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++visits[i];
    });
    EXPECT_EQ(visits, std::vector<int>(1000, 1));
    set_thread_count(0);
}

TEST(ParallelWithin, runs_every_task_once_and_never_too_many_at_a_time)
{
    std::vector<double> cost;
    for (int n = 0; n < 300; ++n) cost.push_back(1.0 + n * 37 % 100);
    std::mutex lock;
    double busy = 0, most = 0;
    std::vector<int> runs(cost.size(), 0);
    parallel_within(150.0, cost, [&](std::size_t n) {
        {
            const std::lock_guard guard(lock);
            most = std::max(most, busy += cost[n]);
            ++runs[n];
        }
        std::this_thread::yield();
        const std::lock_guard guard(lock);
        busy -= cost[n];
    });
    EXPECT_EQ(runs, std::vector<int>(cost.size(), 1));
    EXPECT_LE(most, 150.0);
}

TEST(ParallelWithin, runs_what_exceeds_the_budget_alone)
{
    std::atomic<int> busy = 0, done = 0;
    parallel_within(1.0, std::vector<double>(20, 5.0), [&](std::size_t) {
        EXPECT_EQ(++busy, 1);
        --busy;
        ++done;
    });
    EXPECT_EQ(done, 20);
    parallel_within(1.0, {}, [](std::size_t) { FAIL(); });
}

TEST(ParallelWithin, ends_with_the_first_exception)
{
    std::atomic<int> started = 0;
    const auto fail = [&](std::size_t) {
        ++started;
        throw std::runtime_error("one");
    };
    EXPECT_THROW(parallel_within(1e9, std::vector<double>(1000, 1.0), fail), std::runtime_error);
    EXPECT_LE(started, 64);
}

}  // namespace
}  // namespace coral
