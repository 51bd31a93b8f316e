#pragma once
/// \file suffusion/flow_region.h
/// Which flow cells lie between the grains and which in their voids.
#include <cstdint>
#include <map>
#include <vector>

#include "suffusion/simulation.h"

namespace coral::suffusion {

enum class Region : std::uint8_t {
    between,  ///< outside the apparent shape of every grain
    surface,  ///< in an apparent shape, within one cell of its surface: mouths of voids, dimples, cut cells; and its solid
    open,     ///< deeper in an apparent shape, in a void that is linked to the outside
    sealed,   ///< in a void without any way out, where the fluid moves with the grain
};

/// Finds the region of every flow cell from the poses of the grains with voids.
class RegionFinder {
public:
    /// Finds the sealed voids of each shape: nodes of its lattice outside the solid that no 6-connected path links to the border.
    explicit RegionFinder(const Scene& scene);

    /// Region of every cell, x fastest, solid or not. A cell counts by its centre, and as deep when the six points one cell off
    /// its centre along the axes lie in the apparent shape of the same grain as well. Cells that are open by less than `least_open`
    /// of their volume are not looked at and count as between. \pre simulation.has_flow()
    std::vector<Region> find(const Simulation& simulation, double least_open = 0) const;

private:
    /// Sealed nodes of the lattice of a shape.
    struct SealedVoids {
        Eigen::Vector3i size;
        Eigen::Vector3d origin;
        double spacing;
        std::vector<std::uint8_t> sealed;
        bool contains(const Eigen::Vector3d& point) const;
    };
    struct Placed;
    std::vector<Placed> place(const Simulation& simulation) const;
    void mark_plane(const Simulation& simulation, const Placed& grain, int k, double least_open, std::vector<Region>& regions) const;

    std::map<int, SealedVoids> voids_;  ///< by shape of the world
};

}  // namespace coral::suffusion
