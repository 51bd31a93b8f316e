#include "morph/detail/closing.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "morph/distance_transform.h"

namespace coral::morph::detail {
namespace {

constexpr std::size_t block = 1 << 16;

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

}  // namespace

double mean_edge(const Mask& mask) { return std::cbrt(mask.voxel_volume()); }

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

Bottlenecks bottlenecks(const Closing& closing)
{
    constexpr int bins_per_edge = 8;
    const std::size_t count = closing.squared.size();
    if (count > std::numeric_limits<std::uint32_t>::max()) throw Error("throats", "the box of a grain has more than 2^32 voxels", "coarsen the stack");
    Bottlenecks out{std::vector<float>(count, 0.0F), std::vector<std::uint32_t>(count, 0)};
    std::vector<float>& b = out.radius;
    std::vector<std::vector<std::size_t>> buckets(std::size_t(closing.reach * bins_per_edge) + 2);
    const auto bin_of = [&](float value) { return std::min(std::size_t(value * bins_per_edge), buckets.size() - 1); };
    const auto from = [&](std::size_t v, float value) {
        for_faces(v, closing.box.size, [&](std::size_t n) {
            if (closing.box.voxels[n] || closing.outside[n]) return;
            const float own = std::sqrt(closing.squared[n]), candidate = std::min(value, own);
            if (candidate <= b[n]) return;
            b[n] = candidate;
            out.saddle[n] = own < value ? std::uint32_t(n) : out.saddle[v];
            buckets[bin_of(candidate)].push_back(n);
        });
    };
    for (std::size_t v = 0; v < b.size(); ++v)
        if (closing.outside[v]) from(v, float(closing.reach));
    for (std::size_t bin = buckets.size(); bin-- > 0;)
        while (!buckets[bin].empty()) {
            const std::size_t v = buckets[bin].back();
            buckets[bin].pop_back();
            if (bin_of(b[v]) == bin) from(v, b[v]);
        }
    return out;
}

}  // namespace coral::morph::detail
