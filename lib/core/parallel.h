#pragma once
/// \file core/parallel.h
/// Loops whose result does not depend on the number of threads.
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace coral {

/// Number of threads for the rest of the process; 0 means all cores. Call once, from main.
void set_thread_count(int count);
int thread_count();

namespace detail {
/// The one compiled copy of a loop body. Inlined into the serial and the parallel branch it could be optimised in two ways that
/// round differently, and the result would depend on the number of threads.
template <class Body>
[[gnu::noipa]] void run_block(const Body& body, std::size_t begin, std::size_t end)
{
    body(begin, end);
}
}  // namespace detail

/// body(begin, end) over blocks of at most `grain` elements. The blocks are the same for any thread count.
template <class Body>
void parallel_blocks(std::size_t count, std::size_t grain, const Body& body)
{
    if (count == 0) return;
    if (thread_count() == 1 || count <= grain) {
        for (std::size_t begin = 0; begin < count; begin += grain) detail::run_block(body, begin, std::min(begin + grain, count));
        return;
    }
    // A context of its own: when a loop around this one fails and is cancelled, this one must still run all its blocks, since TBB
    // would otherwise end it early without an exception and leave its results half made.
    tbb::task_group_context whole(tbb::task_group_context::isolated);
    tbb::parallel_for(
        std::size_t{0}, (count + grain - 1) / grain,
        [&](std::size_t b) { detail::run_block(body, b * grain, std::min((b + 1) * grain, count)); }, tbb::static_partitioner{}, whole);
}

/// Sum of body(begin, end) over blocks, added in block order: the same bits for any thread count.
template <class T, class Body>
T parallel_sum(std::size_t count, std::size_t grain, T zero, const Body& body)
{
    std::vector<T> partial((count + grain - 1) / grain, zero);
    parallel_blocks(count, grain, [&](std::size_t begin, std::size_t end) { partial[begin / grain] = body(begin, end); });
    for (const T& p : partial) zero = zero + p;
    return zero;
}

}  // namespace coral
