#pragma once
/// \file fluid/detail/raster.h
/// Solid fraction of control volumes from a signed distance: which faces (or cells) a body touches, and by how much.
#include <cstdint>
#include <vector>

#include "fluid/immersed.h"

namespace coral::fluid::detail {

/// Neighbouring control volumes along x that are all solid.
struct SolidRun {
    std::uint32_t at = 0;              ///< linear index of the first
    std::int16_t i = 0, j = 0, k = 0;  ///< of the first, not wrapped across periodic sides
    std::int16_t length = 0;
};

/// A control volume cut by the surface.
struct CutFace {
    std::uint32_t at = 0;
    std::int16_t i = 0, j = 0, k = 0;
    float fraction = 0.0F;             ///< at least 1e-6
};

struct SolidSet {
    std::vector<SolidRun> runs;
    std::vector<CutFace> cuts;
    Eigen::Vector3i low = Eigen::Vector3i::Zero(), high = Eigen::Vector3i::Zero();  ///< box around them, [low, high)
};

inline constexpr int cells_component = 3;

/// Control volumes of component 0..2 (faces the flow advances) or of the cells (3) that the body at `motion` covers.
/// phi = sum max(-d, 0) / sum |d| over the eight corners [Huang et al., section 2.3.2, on each staggered volume], the
/// distances lowered for the curvature of the surface unless `rule` is the paper's  [docs/numerics.md, eq. 9].
SolidSet find_solid(const GridSpec& grid, const Layout& layout, int component, const BodyShape& shape,
                    const RigidMotion& motion, FractionRule rule);

}  // namespace coral::fluid::detail
