#include "core/parallel.h"

#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <memory>
#include <thread>

namespace coral {
namespace {

int current_count = 0;
std::unique_ptr<tbb::global_control> limit;

}  // namespace

void set_thread_count(int count)
{
    const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    current_count = count > 0 ? count : cores;
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(current_count));
}

int thread_count()
{
    if (current_count == 0) set_thread_count(0);
    return current_count;
}

}  // namespace coral
