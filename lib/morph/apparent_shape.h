#pragma once
/// \file morph/apparent_shape.h
/// Apparent (void-filled) shape of a grain by a ball rolled round it, and the classes of the voids it closes over.
#include <vector>

#include "morph/voids.h"
#include "morph/voxel_stack.h"

namespace coral::morph {

/// Result of closing one grain. Counts are voxels; all other solid and void of the box is outside.
struct ApparentShape {
    Mask apparent;                ///< box of the input mask; contains the solid
    double radius = 0;            ///< of the closing ball [m]
    std::size_t solid = 0;        ///< voxels of the input
    std::size_t filled = 0;       ///< voxels of `apparent`
    std::size_t open_void = 0;    ///< void inside the apparent shape that is 6-connected to the outside
    std::size_t closed_void = 0;  ///< void that is not
    std::size_t void_count = 0;   ///< 6-connected voids of at least eight voxels; open ones must take a ball of radius 1.5 c
    double largest_throat = 0;    ///< diameter of the widest constriction into a void [m]; 0 when no void lies behind one
};

/// Ball-reachable closing: a void stays outside only if a ball of `radius` rolls into it from outside.
///     d(x) = distance to the solid;   E = part of {d >= R + c/2} connected to the border;   q(x) = distance to E
///     apparent = {q > R + c/2} or solid
/// with c the geometric mean of the voxel edges. Closed voids and voids behind throats narrower than 2R fill.
/// The largest throat follows from b(x) = max over paths from outside of the least d on the path: it is 2 b, the largest
/// over voids that widen behind the constriction (d > b + c), with the ball then moved off the voxel centre (detail/throat.h). Round
/// throats of five voxels and more are met within 0.6 voxel (docs/validation/geometry.md). Voids behind throats wider than 2R are
/// outside and not seen.
/// \param radius  of the ball [m]
/// \param voids   when given: the voids one by one, largest first; as many as void_count. Costs one more distance transform.
ApparentShape close_with_ball(const Mask& solid, double radius, std::vector<Void>* voids = nullptr);

/// Equivalent diameter [m] of the solid with its closed voids filled: the size that sets the default ball.
double filled_diameter(const Mask& solid);

/// Default radius of the ball, 0.1 of filled_diameter [m].
double default_closing_radius(const Mask& solid);

/// Same closing without void classes, for a whole stack of grains: solid, or not reached by the ball. Beyond the stack is void.
Mask close_stack(const Mask& solid, double radius);

}  // namespace coral::morph
