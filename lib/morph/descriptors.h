#pragma once
/// \file morph/descriptors.h
/// Size and shape of one grain, of its apparent (void-filled) shape unless said otherwise.
#include <cstddef>

#include "morph/apparent_shape.h"
#include "morph/voxel_stack.h"

namespace coral::morph {

struct Descriptors {
    std::size_t voxels = 0;              ///< solid
    double volume = 0;                   ///< of the solid, by counting voxels [m^3]
    double apparent_volume = 0;          ///< voids filled [m^3]
    double equivalent_diameter = 0;      ///< of the sphere of the apparent volume [m]
    double surface_area = 0;             ///< of the solid, walls of voids included [m^2]
    double apparent_surface_area = 0;    ///< of the apparent shape [m^2]
    double intraparticle_porosity = 0;   ///< void / apparent volume
    double open_porosity = 0;            ///< its part connected to the outside
    double closed_porosity = 0;          ///< its part that is not
    std::size_t void_count = 0;          ///< see ApparentShape
    double largest_throat = 0;           ///< diameter of the widest constriction into a void [m]
    double closing_radius = 0;           ///< of the ball that defined the apparent shape [m]
    double elongation = 0;               ///< b/a of the least oriented box a >= b >= c of the hull [Zingg 1935]
    double flatness = 0;                 ///< c/b
    double sphericity = 0;               ///< (36 pi V^2)^(1/3) / A [Wadell 1932]
    double convexity = 0;                ///< volume over that of the convex hull, of the apparent shape
    double roundness = 0;                ///< see measure()
};

/// All descriptors of one grain.
/// Areas: surface of the occupancy smoothed by 0.7 voxel. Roundness after Wadell in three dimensions: the area-weighted mean,
/// over the corners of the surface, of corner radius over inscribed radius,
///     sum_i A_i (1/k_i) / (R_in sum_i A_i),   k_i = largest principal curvature > 1/R_in,
/// with curvatures taken at the scale max(D/30, 2.5 voxels) and R_in the largest inscribed ball; 1 when there are no corners.
/// \param solid     one grain, islands removed
/// \param apparent  its closing
Descriptors measure(const Mask& solid, const ApparentShape& apparent);

}  // namespace coral::morph
