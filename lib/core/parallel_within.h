#pragma once
/// \file core/parallel_within.h
/// Large tasks side by side, as many as a budget of memory allows.
#include <cstddef>
#include <functional>
#include <span>

namespace coral {

/// Calls task(n) once for every n < cost.size(), the costliest first, and never so many at a time that their costs exceed the budget
/// (but always one). Threads that get no task of their own help in the loops inside the tasks. The first exception ends it.
/// \param cost  of each task, in the unit of the budget
void parallel_within(double budget, std::span<const double> cost, const std::function<void(std::size_t)>& task);

}  // namespace coral
