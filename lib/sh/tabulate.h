#pragma once
/// \file sh/tabulate.h
/// Harmonic surface -> dense grid of true distances, so that contact and flow treat it as a level set.
#include "sdf/distance_grid.h"
#include "sh/surface.h"

namespace coral::sh {

/// Distance to the closest point of the surface (not the radial r - |x|, which errs by 20 % at one fine's radius), sign from
/// the radius, on nodes origin + spacing*(i,j,k) with a node at the frame's origin.
/// \param spacing           [m]
/// \param outside_distance  the box holds every point this near to the surface [m]; all nodes outside hold distances
/// \param inside_distance   deeper nodes are clamped to it (limits say so); infinity keeps all [m]
/// \note The frame is that of the surface; use centred() first where the centre of mass must be the origin.
/// \throws Error when a radius is not positive
sdf::DistanceGrid tabulate(const Surface& surface, double spacing, double outside_distance,
                           double inside_distance = std::numeric_limits<double>::infinity());

}  // namespace coral::sh
