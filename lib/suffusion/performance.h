#pragma once
/// \file suffusion/performance.h
/// Where the time of a run went: /performance of results.h5.
#include <span>
#include <vector>

#include "suffusion/results.h"
#include "suffusion/simulation.h"

namespace coral::suffusion {

/// Seconds by phase, counts and rates. \param earlier the same of the parts of the run before it was resumed: seconds and counts add up
std::vector<Measure> performance_of(const Simulation& simulation, std::span<const Measure> earlier);

}  // namespace coral::suffusion
