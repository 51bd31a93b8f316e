#include "morph/apparent_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "morph/components.h"
#include "morph/distance_transform.h"

namespace coral::morph {
namespace {

constexpr std::size_t block = 1 << 16;

double mean_edge(const Mask& mask) { return std::cbrt(mask.voxel_volume()); }

/// The padded box with the intermediate fields of the closing. Distances in units of c.
struct Closing {
    Mask box;                           ///< input with margin
    std::vector<float> squared;         ///< d^2
    std::vector<std::uint8_t> outside;  ///< E: centres a ball from outside reaches
    double reach = 0;                   ///< R + c/2, in c
    Eigen::Vector3i margin;
};

Closing roll_ball(const Mask& solid, double radius)
{
    const double c = mean_edge(solid);
    Closing out;
    for (int a = 0; a < 3; ++a) out.margin[a] = int(std::ceil(radius / solid.voxel_size[a])) + 3;
    out.box = padded(solid, out.margin);
    out.reach = radius / c + 0.5;
    out.squared = squared_distances(out.box.voxels, out.box.size, 1, solid.voxel_size / c);
    std::vector<std::uint8_t> clear(out.squared.size());
    const float least = float(out.reach * out.reach);
    parallel_blocks(clear.size(), block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) clear[v] = out.squared[v] >= least;
    });
    out.outside = connected_to_border(clear, out.box.size, 1);
    return out;
}

/// Apparent shape in the padded box.
std::vector<std::uint8_t> unreached(const Closing& closing)
{
    const double c = mean_edge(closing.box);
    const std::vector<float> q2 = squared_distances(closing.outside, closing.box.size, 1, closing.box.voxel_size / c);
    std::vector<std::uint8_t> apparent(q2.size());
    const float most = float(closing.reach * closing.reach);
    parallel_blocks(apparent.size(), block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) apparent[v] = q2[v] > most || closing.box.voxels[v];
    });
    return apparent;
}

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

/// Calls visit(neighbour) for the six neighbours inside the box.
template <class Visit>
void for_faces(std::size_t v, const Eigen::Vector3i& size, const Visit& visit)
{
    const std::size_t nx = std::size_t(size.x()), ny = std::size_t(size.y()), nz = std::size_t(size.z());
    const std::size_t i = v % nx, j = v / nx % ny, k = v / (nx * ny);
    if (i > 0) visit(v - 1);
    if (i + 1 < nx) visit(v + 1);
    if (j > 0) visit(v - nx);
    if (j + 1 < ny) visit(v + nx);
    if (k > 0) visit(v - nx * ny);
    if (k + 1 < nz) visit(v + nx * ny);
}

/// b(x) of every open void voxel the ball does not reach, by a bucket queue that starts at E; the result only needs the
/// widest constriction in front of a void that is wider by more than c. [in c]
double widest_constriction(const Closing& closing, const std::vector<std::uint8_t>& open_void)
{
    constexpr int bins_per_edge = 8;
    std::vector<float> b(closing.squared.size(), 0.0F);
    std::vector<std::vector<std::size_t>> buckets(std::size_t(closing.reach * bins_per_edge) + 2);
    const auto push = [&](std::size_t v, float value) {
        b[v] = value;
        buckets[std::min(std::size_t(value * bins_per_edge), buckets.size() - 1)].push_back(v);
    };
    const auto from = [&](std::size_t v, float value) {
        for_faces(v, closing.box.size, [&](std::size_t n) {
            if (closing.box.voxels[n] || closing.outside[n]) return;
            const float candidate = std::min(value, std::sqrt(closing.squared[n]));
            if (candidate > b[n]) push(n, candidate);
        });
    };
    for (std::size_t v = 0; v < b.size(); ++v)
        if (closing.outside[v]) from(v, float(closing.reach));
    for (std::size_t bin = buckets.size(); bin-- > 0;)
        while (!buckets[bin].empty()) {
            const std::size_t v = buckets[bin].back();
            buckets[bin].pop_back();
            if (std::min(std::size_t(b[v] * bins_per_edge), buckets.size() - 1) == bin) from(v, b[v]);
        }
    double widest = 0;
    for (std::size_t v = 0; v < b.size(); ++v)
        if (open_void[v] && std::sqrt(closing.squared[v]) > b[v] + 1.0F) widest = std::max(widest, double(b[v]));
    return widest;
}

/// The width asked of open voids leaves out the dimples that a ball passes over on any rough surface.
std::size_t count_voids(const Closing& closing, const std::vector<std::uint8_t>& voids, const std::vector<std::uint8_t>& open_void)
{
    constexpr std::size_t least_voxels = 8;
    constexpr float least_squared_distance = 4.0F;  // (1.5 c + c/2)^2
    const Components parts = connected_components(voids, closing.box.size, 1, Connectivity::faces);
    std::vector<std::uint8_t> counts(parts.sizes.size(), 0);
    for (std::size_t v = 0; v < voids.size(); ++v)
        if (parts.labels[v] && (!open_void[v] || closing.squared[v] >= least_squared_distance)) counts[parts.labels[v] - 1] = 1;
    std::size_t sum = 0;
    for (std::size_t p = 0; p < counts.size(); ++p) sum += counts[p] && parts.sizes[p] >= least_voxels;
    return sum;
}

}  // namespace

ApparentShape close_with_ball(const Mask& solid, double radius)
{
    const Closing closing = roll_ball(solid, radius);
    const std::vector<std::uint8_t> apparent = unreached(closing);
    const std::vector<std::uint8_t> reached = connected_to_border(closing.box.voxels, closing.box.size, 0);
    ApparentShape out;
    out.radius = radius;
    std::vector<std::uint8_t> voids(apparent.size()), open_void(apparent.size());
    for (std::size_t v = 0; v < apparent.size(); ++v) {
        out.solid += closing.box.voxels[v];
        out.filled += apparent[v];
        voids[v] = apparent[v] && !closing.box.voxels[v];
        open_void[v] = voids[v] && reached[v];
        out.open_void += open_void[v];
    }
    out.closed_void = out.filled - out.solid - out.open_void;
    if (out.filled > out.solid) out.void_count = count_voids(closing, voids, open_void);
    if (out.open_void > 0) {
        const double b = widest_constriction(closing, open_void);
        out.largest_throat = 2.0 * b * mean_edge(solid);
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
    const Closing closing = roll_ball(solid, radius);
    return crop_margin(solid, unreached(closing), closing.box.size, closing.margin);
}

}  // namespace coral::morph
