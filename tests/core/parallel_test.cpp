#include "core/parallel.h"

#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace coral
