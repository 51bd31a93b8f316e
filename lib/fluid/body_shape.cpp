// Shapes in closed form.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "fluid/immersed.h"

namespace coral::fluid {

using Eigen::Vector3d;

BodyShape sphere_shape(double diameter)
{
    const double radius = 0.5 * diameter;
    BodyShape shape;
    shape.box_min.setConstant(-radius);
    shape.box_max.setConstant(radius);
    shape.distance = [radius](std::span<const Vector3d> points, std::span<double> distances) {
        for (std::size_t p = 0; p < points.size(); ++p) distances[p] = points[p].norm() - radius;
    };
    return shape;
}

BodyShape plate_shape(double thickness, double hole, double pitch, const Eigen::Vector2d& half_size,
                      bool holes_off_centre)
{
    if (!(thickness > 0.0))
        throw UsageError("wall.thickness", "is not positive", "give the plate's thickness, such as \"2mm\"");
    if (!(hole > 0.0 && hole < pitch))
        throw UsageError("wall.hole", "does not leave a web between holes",
                         "choose hole smaller than pitch, both positive");
    BodyShape shape;
    shape.box_max = Vector3d(half_size.x(), half_size.y(), 0.5 * thickness);
    shape.box_min = -shape.box_max;
    const double shift = holes_off_centre ? 0.5 * pitch : 0.0;
    shape.distance = [=](std::span<const Vector3d> points, std::span<double> distances) {
        const auto inside_hole = [&](double x) {  // depth inside the nearest hole along one axis, negative in the web
            const double y = x - shift;
            return 0.5 * hole - std::abs(y - pitch * std::round(y / pitch));
        };
        for (std::size_t p = 0; p < points.size(); ++p) {
            const double in_plate = std::abs(points[p].z()) - 0.5 * thickness;
            distances[p] = std::max(in_plate, std::min(inside_hole(points[p].x()), inside_hole(points[p].y())));
        }
    };
    return shape;
}

}  // namespace coral::fluid
