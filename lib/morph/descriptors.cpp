#include "morph/descriptors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "morph/distance_transform.h"
#include "morph/hull.h"
#include "morph/oriented_box.h"
#include "morph/surface.h"

namespace coral::morph {
namespace {

/// Radius of the largest ball inside the mask [m].
double inscribed_radius(const Mask& mask)
{
    const double c = std::cbrt(mask.voxel_volume());
    const Mask box = padded(mask, 1);
    const std::vector<float> d2 = squared_distances(box.voxels, box.size, 0, mask.voxel_size / c);
    return c * (std::sqrt(double(*std::max_element(d2.begin(), d2.end()))) - 0.5);
}

double wadell_roundness(const Mask& mask, double diameter)
{
    const double inscribed = inscribed_radius(mask);
    double area = 0, sum = 0;
    for (const CurvatureSample& s : surface_curvature(mask, std::max(diameter / 30.0, 2.5 * mask.voxel_size.maxCoeff()))) {
        if (s.largest_curvature * inscribed <= 1.0) continue;
        area += s.area;
        sum += s.area / (s.largest_curvature * inscribed);
    }
    return area > 0 ? sum / area : 1.0;
}

}  // namespace

Descriptors measure(const Mask& solid, const ApparentShape& apparent)
{
    Descriptors d;
    const double voxel = solid.voxel_volume(), filled = double(apparent.filled);
    d.voxels = apparent.solid;
    d.volume = double(apparent.solid) * voxel;
    d.apparent_volume = filled * voxel;
    d.equivalent_diameter = std::cbrt(6.0 / std::numbers::pi * d.apparent_volume);
    d.open_porosity = double(apparent.open_void) / filled;
    d.closed_porosity = double(apparent.closed_void) / filled;
    d.intraparticle_porosity = double(apparent.filled - apparent.solid) / filled;
    d.void_count = apparent.void_count;
    d.largest_throat = apparent.largest_throat;
    d.closing_radius = apparent.radius;

    const SurfaceMesh hide = extract_surface(apparent.apparent);
    d.surface_area = surface_area(extract_surface(solid));
    d.apparent_surface_area = surface_area(hide);
    const double volume = enclosed_volume(hide);
    d.sphericity = std::cbrt(36.0 * std::numbers::pi * volume * volume) / d.apparent_surface_area;
    const HullProperties hull = hull_properties(hide.vertices);
    d.convexity = std::min(volume / hull.volume, 1.0);
    const Eigen::Vector3d box = least_box(hull.corners);
    d.elongation = box[1] / box[0];
    d.flatness = box[2] / box[1];
    d.roundness = wadell_roundness(apparent.apparent, d.equivalent_diameter);
    return d;
}

}  // namespace coral::morph
