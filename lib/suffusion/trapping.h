#pragma once
/// \file suffusion/trapping.h
/// Fines in the voids of grains: which, in which grain, since when, and whether they sit in the mouth of the void or wholly inside.
#include <cstdint>
#include <vector>

#include "suffusion/scene.h"
#include "suffusion/throats.h"

namespace coral::suffusion {

/// A fine whose centre lies in the apparent shape of a grain with voids.
struct Trapped {
    std::int64_t fine = 0, grain = 0;  ///< bodies
    bool enclosed = false;             ///< the whole fine is in the apparent shape; otherwise it sticks out of the void's mouth (its throat)
    double since = 0;                  ///< time of the output that first found it in this grain [s]; 0: from the start
    double throat = 0;                 ///< width of the widest way out of the grain, see Throats [m]
};

/// Trapped fines now, by fine. `before` (the list of the last output) gives the times since when.
/// A fine is enclosed when 26 points of its surface lie in the apparent shape too (tolerance: one node of its lattice).
/// \param fines  bodies to look at; those that have left or are in no grain are not in the list
std::vector<Trapped> find_trapped(const Scene& scene, const std::vector<std::int64_t>& fines, double time, const std::vector<Trapped>& before, ThroatLibrary& throats);

}  // namespace coral::suffusion
