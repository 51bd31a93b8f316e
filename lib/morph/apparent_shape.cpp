#include "morph/apparent_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "morph/components.h"
#include "morph/detail/closing.h"
#include "morph/detail/throat.h"

namespace coral::morph {
namespace {

using detail::Closing;

Mask crop_margin(const Mask& like, std::span<const std::uint8_t> boxed, const Eigen::Vector3i& boxed_size, const Eigen::Vector3i& margin)
{
    Mask out = make_mask(like.size, like.voxel_size);
    out.offset = like.offset;
    for (int k = 0; k < like.size.z(); ++k)
        for (int j = 0; j < like.size.y(); ++j) {
            const std::size_t from = (std::size_t(k + margin.z()) * std::size_t(boxed_size.y()) + std::size_t(j + margin.y())) *
                                         std::size_t(boxed_size.x()) + std::size_t(margin.x());
            std::copy_n(boxed.begin() + std::ptrdiff_t(from), like.size.x(), out.voxels.begin() + std::ptrdiff_t(out.index(0, j, k)));
        }
    return out;
}

/// Diameter of the widest constriction in front of a void that is wider by more than c [m]; 0 without one.
double widest_constriction(const Closing& closing, const std::vector<std::uint8_t>& open, const detail::Bottlenecks& paths)
{
    float widest = 0;
    std::size_t saddle = 0;
    for (std::size_t v = 0; v < open.size(); ++v)
        if (open[v] && paths.radius[v] > widest && detail::behind_constriction(closing.squared[v], paths.radius[v])) {
            widest = paths.radius[v];
            saddle = paths.saddle[v];
        }
    return widest > 0 ? detail::throat_diameter(closing, saddle, widest) : 0.0;
}

}  // namespace

ApparentShape close_with_ball(const Mask& solid, double radius, std::vector<Void>* list)
{
    const Closing closing = detail::roll_ball(solid, radius);
    const std::vector<std::uint8_t> apparent = detail::unreached(closing);
    const std::vector<std::uint8_t> reached = connected_to_border(closing.box.voxels, closing.box.size, 0);
    ApparentShape out;
    out.radius = radius;
    std::vector<std::uint8_t> voids(apparent.size()), open(apparent.size());
    for (std::size_t v = 0; v < apparent.size(); ++v) {
        out.solid += closing.box.voxels[v];
        out.filled += apparent[v];
        voids[v] = apparent[v] && !closing.box.voxels[v];
        open[v] = voids[v] && reached[v];
        out.open_void += open[v];
    }
    out.closed_void = out.filled - out.solid - out.open_void;
    if (list) list->clear();
    if (out.filled > out.solid) {
        const detail::VoidParts parts = detail::void_parts(closing, voids, std::move(open));
        out.void_count = std::size_t(std::ranges::count(parts.counts, 1));
        detail::Bottlenecks paths;
        if (out.open_void > 0) {
            paths = detail::bottlenecks(closing);
            out.largest_throat = widest_constriction(closing, parts.open, paths);
        }
        if (list) *list = detail::describe_voids(closing, apparent, parts, paths);
    }
    out.apparent = crop_margin(solid, apparent, closing.box.size, closing.margin);
    return out;
}

double filled_diameter(const Mask& solid)
{
    const Mask box = padded(solid, 1);
    const std::vector<std::uint8_t> reached = connected_to_border(box.voxels, box.size, 0);
    std::size_t filled = 0;
    for (std::uint8_t r : reached) filled += r == 0;
    return std::cbrt(6.0 / std::numbers::pi * double(filled) * solid.voxel_volume());
}

double default_closing_radius(const Mask& solid) { return 0.1 * filled_diameter(solid); }

Mask close_stack(const Mask& solid, double radius)
{
    const Closing closing = detail::roll_ball(solid, radius);
    return crop_margin(solid, detail::unreached(closing), closing.box.size, closing.margin);
}

}  // namespace coral::morph
