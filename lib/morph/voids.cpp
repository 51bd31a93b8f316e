#include "morph/voids.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "morph/detail/closing.h"
#include "morph/detail/throat.h"
#include "morph/distance_transform.h"

namespace coral::morph {
namespace {

constexpr std::size_t least_voxels = 8;

}  // namespace

namespace detail {
namespace {

/// What the voxels of one void add up to. Distances in c.
struct Sums {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of voxel numbers
    float squared_width = 0, squared_depth = 0;
    float constricted = 0, widest = 0;  ///< largest bottleneck behind a constriction; of all voxels
    std::size_t constriction = 0, mouth = 0;  ///< where they are
    bool open = false;
};

void add(Sums& sums, std::size_t voxel, const Closing& closing, float squared_depth, const Bottlenecks& paths)
{
    const std::size_t nx = std::size_t(closing.box.size.x()), ny = std::size_t(closing.box.size.y());
    sums.centre += Eigen::Vector3d(double(voxel % nx), double(voxel / nx % ny), double(voxel / (nx * ny)));
    sums.squared_width = std::max(sums.squared_width, closing.squared[voxel]);
    sums.squared_depth = std::max(sums.squared_depth, squared_depth);
    if (paths.radius.empty()) return;
    const float bottleneck = paths.radius[voxel];
    if (bottleneck > sums.widest) {
        sums.widest = bottleneck;
        sums.mouth = paths.saddle[voxel];
    }
    if (bottleneck > sums.constricted && behind_constriction(closing.squared[voxel], bottleneck)) {
        sums.constricted = bottleneck;
        sums.constriction = paths.saddle[voxel];
    }
}

Void from_sums(const Sums& sums, std::size_t voxels, const Closing& closing)
{
    const Mask& box = closing.box;
    const double c = mean_edge(box);
    Void v;
    v.voxels = voxels;
    v.volume = double(voxels) * box.voxel_volume();
    v.open = sums.open;
    if (v.open) v.throat_diameter = sums.constricted > 0 ? throat_diameter(closing, sums.constriction, sums.constricted) : throat_diameter(closing, sums.mouth, sums.widest);
    v.width = 2.0 * c * std::sqrt(double(sums.squared_width));
    v.depth = c * (std::sqrt(double(sums.squared_depth)) - 0.5);
    v.centroid = (sums.centre / double(voxels) + box.offset.cast<double>() + Eigen::Vector3d::Constant(0.5)).cwiseProduct(box.voxel_size);
    return v;
}

}  // namespace

VoidParts void_parts(const Closing& closing, const std::vector<std::uint8_t>& voids, std::vector<std::uint8_t> open)
{
    constexpr float least_squared_distance = 4.0F;  // (1.5 c + c/2)^2
    VoidParts out{std::move(open), connected_components(voids, closing.box.size, 1, Connectivity::faces), {}};
    out.counts.assign(out.parts.sizes.size(), 0);
    for (std::size_t v = 0; v < voids.size(); ++v)
        if (out.parts.labels[v] && (!out.open[v] || closing.squared[v] >= least_squared_distance)) out.counts[out.parts.labels[v] - 1] = 1;
    for (std::size_t p = 0; p < out.counts.size(); ++p)
        if (out.parts.sizes[p] < least_voxels) out.counts[p] = 0;
    return out;
}

std::vector<Void> describe_voids(const Closing& closing, const std::vector<std::uint8_t>& apparent, const VoidParts& parts,
                                 const Bottlenecks& paths)
{
    const std::vector<float> depth = squared_distances(apparent, closing.box.size, 0, closing.box.voxel_size / mean_edge(closing.box));
    std::vector<Sums> sums(parts.counts.size());
    for (std::size_t v = 0; v < depth.size(); ++v) {
        const std::uint32_t part = parts.parts.labels[v];
        if (part == 0 || !parts.counts[part - 1]) continue;
        add(sums[part - 1], v, closing, depth[v], paths);
        sums[part - 1].open = sums[part - 1].open || parts.open[v];
    }
    std::vector<std::size_t> order;
    for (std::size_t p = 0; p < sums.size(); ++p)
        if (parts.counts[p]) order.push_back(p);
    std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return parts.parts.sizes[a] > parts.parts.sizes[b]; });
    std::vector<Void> voids;
    for (const std::size_t p : order) voids.push_back(from_sums(sums[p], parts.parts.sizes[p], closing));
    return voids;
}

}  // namespace detail

Void scaled(Void v, double factor)
{
    v.volume *= factor * factor * factor;
    v.throat_diameter *= factor;
    v.width *= factor;
    v.depth *= factor;
    v.centroid *= factor;
    return v;
}

std::vector<std::uint8_t> void_classes(const Mask& solid, const Mask& apparent)
{
    const Mask box = padded(solid, 1);
    const std::vector<std::uint8_t> reached = connected_to_border(box.voxels, box.size, 0);
    std::vector<std::uint8_t> voids(solid.voxels.size());
    for (std::size_t v = 0; v < voids.size(); ++v) voids[v] = apparent.voxels[v] && !solid.voxels[v];
    const Components parts = connected_components(voids, solid.size, 1, Connectivity::faces);
    const auto is_wide = [&](int i, int j, int k) {  // of a voxel of the padded box
        for (int c = k - 1; c <= k + 1; ++c)
            for (int b = j - 1; b <= j + 1; ++b)
                for (int a = i - 1; a <= i + 1; ++a)
                    if (box.voxels[box.index(a, b, c)]) return false;
        return true;
    };
    std::vector<std::uint8_t> kind(parts.sizes.size(), 0);
    std::size_t v = 0;
    for (int k = 1; k <= solid.size.z(); ++k)
        for (int j = 1; j <= solid.size.y(); ++j)
            for (int i = 1; i <= solid.size.x(); ++i, ++v) {
                const std::uint32_t part = parts.labels[v];
                if (part == 0 || kind[part - 1] || parts.sizes[part - 1] < least_voxels) continue;
                if (!reached[box.index(i, j, k)]) kind[part - 1] = 1;
                else if (is_wide(i, j, k)) kind[part - 1] = 2;
            }
    for (v = 0; v < voids.size(); ++v) voids[v] = parts.labels[v] ? kind[parts.labels[v] - 1] : 0;
    return voids;
}

}  // namespace coral::morph
