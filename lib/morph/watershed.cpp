#include "morph/watershed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "morph/apparent_shape.h"
#include "morph/distance_transform.h"

namespace coral::morph {
namespace {

/// Solid voxels by falling distance, memory order among equals: a counting sort of quantised squared distances
/// (exact for cubic voxels, where they are integers; steps of c^2/16 otherwise).
std::vector<std::size_t> by_falling_distance(const Mask& mask, const std::vector<float>& squared)
{
    const bool cubic = mask.voxel_size.maxCoeff() == mask.voxel_size.minCoeff();
    const double steps = cubic ? 1.0 : 16.0;
    const auto key = [&](std::size_t v) { return std::size_t(double(squared[v]) * steps); };
    std::size_t largest = 0, solid = 0;
    for (std::size_t v = 0; v < squared.size(); ++v)
        if (mask.voxels[v]) {
            largest = std::max(largest, key(v));
            ++solid;
        }
    std::vector<std::size_t> start(largest + 2, 0);
    for (std::size_t v = 0; v < squared.size(); ++v)
        if (mask.voxels[v]) ++start[largest - key(v) + 1];
    for (std::size_t b = 1; b < start.size(); ++b) start[b] += start[b - 1];
    std::vector<std::size_t> order(solid);
    for (std::size_t v = 0; v < squared.size(); ++v)
        if (mask.voxels[v]) order[start[largest - key(v)]++] = v;
    return order;
}

/// Basins that merge. Each root keeps the height of its peak.
struct Basins {
    std::vector<std::uint32_t> parent{0};
    std::vector<float> peak{0};

    std::uint32_t add(float height)
    {
        parent.push_back(std::uint32_t(parent.size()));
        peak.push_back(height);
        return parent.back();
    }
    std::uint32_t root(std::uint32_t a)
    {
        while (parent[a] != a) {
            parent[a] = parent[parent[a]];
            a = parent[a];
        }
        return a;
    }
    /// The lower of two basins that meet at `depth` merges into the other if its dynamics is small.
    void meet(std::uint32_t a, std::uint32_t b, float depth, double dynamics)
    {
        if (peak[a] < peak[b] || (peak[a] == peak[b] && a > b)) std::swap(a, b);
        if (peak[b] - depth < dynamics * peak[b] + 0.5) parent[b] = a;
    }
};

/// Labels 1.. in memory order of their first voxel.
std::size_t renumber(std::vector<std::uint32_t>& labels, std::size_t largest)
{
    std::vector<std::uint32_t> number(largest + 1, 0);
    std::uint32_t next = 0;
    for (std::uint32_t& l : labels)
        if (l) {
            if (number[l] == 0) number[l] = ++next;
            l = number[l];
        }
    return next;
}

/// Volume-weighted median of the equivalent diameters of the labels [m].
double median_diameter(const std::vector<std::uint32_t>& labels, std::size_t grains, double voxel_volume)
{
    std::vector<std::size_t> sizes(grains + 1, 0);
    for (std::uint32_t l : labels) ++sizes[l];
    sizes[0] = 0;
    std::sort(sizes.begin(), sizes.end());
    std::size_t total = 0, sum = 0, i = 0;
    for (std::size_t s : sizes) total += s;
    for (; i + 1 < sizes.size() && 2 * (sum += sizes[i]) < total;) ++i;
    return std::cbrt(6.0 / std::numbers::pi * double(sizes[i]) * voxel_volume);
}

}  // namespace

std::vector<std::uint32_t> watershed(const Mask& mask, double dynamics, std::size_t& basin_count)
{
    // A margin of void spares the neighbour loop its bounds checks, and makes the border of the stack a surface.
    const Mask box = padded(mask, 1);
    const double c = std::cbrt(mask.voxel_volume());
    std::vector<float> d = squared_distances(box.voxels, box.size, 0, mask.voxel_size / c);
    const std::vector<std::size_t> order = by_falling_distance(box, d);
    parallel_blocks(d.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) d[v] = std::sqrt(d[v]);
    });

    std::array<std::ptrdiff_t, 26> offsets{};
    for (int n = 0, o = 0; n < 27; ++n)
        if (n != 13)
            offsets[std::size_t(o++)] = (n % 3 - 1) + std::ptrdiff_t(box.size.x()) * ((n / 3 % 3 - 1) + std::ptrdiff_t(box.size.y()) * (n / 9 - 1));

    std::vector<std::uint32_t> labels(box.count(), 0);
    Basins basins;
    for (std::size_t v : order) {
        std::array<std::uint32_t, 26> roots{};
        std::size_t root_count = 0;
        float steepest = -1;
        std::uint32_t own = 0;
        std::uint32_t last = 0;
        for (std::ptrdiff_t o : offsets) {
            const std::size_t n = std::size_t(std::ptrdiff_t(v) + o);
            const std::uint32_t label = labels[n];
            if (label == 0) continue;
            if (d[n] > steepest) {
                steepest = d[n];
                own = label;
            }
            if (label == last) continue;
            last = label;
            roots[root_count++] = basins.root(label);
        }
        if (own == 0) {
            labels[v] = basins.add(d[v]);
            continue;
        }
        labels[v] = basins.root(own);
        for (std::size_t a = 0; a < root_count; ++a)
            for (std::size_t b = a + 1; b < root_count; ++b) {
                const std::uint32_t ra = basins.root(roots[a]), rb = basins.root(roots[b]);
                if (ra != rb) basins.meet(ra, rb, d[v], dynamics);
            }
    }

    std::vector<std::uint32_t> out(mask.count(), 0);
    for (int k = 0; k < mask.size.z(); ++k)
        for (int j = 0; j < mask.size.y(); ++j)
            for (int i = 0; i < mask.size.x(); ++i) {
                const std::uint32_t label = labels[box.index(i + 1, j + 1, k + 1)];
                if (label) out[mask.index(i, j, k)] = basins.root(label);
            }
    basin_count = renumber(out, basins.parent.size());
    return out;
}

namespace {

/// One closing and watershed. `left_open` is the share of the stack's void that the closing leaves outside.
WatershedResult split_once(const Mask& solid, double radius, double dynamics, double& left_open)
{
    const Mask filled = close_stack(solid, radius);
    left_open = double(filled.count() - solid_count(filled)) / double(std::max<std::size_t>(solid.count() - solid_count(solid), 1));
    WatershedResult result;
    result.closing_radius = radius;
    result.labels = watershed(filled, dynamics, result.grains);
    return result;
}

}  // namespace

WatershedResult split_touching_grains(const Mask& solid, const WatershedOptions& options)
{
    if (solid_count(solid) == 0) throw Error("watershed", "the stack holds no solid voxel", "check --solid and --threshold");
    const double c = std::cbrt(solid.voxel_volume());
    double left_open = 0;
    WatershedResult result = split_once(solid, options.closing_radius > 0 ? options.closing_radius : c, options.dynamics, left_open);
    for (int pass = 0; options.closing_radius <= 0 && pass < 3; ++pass) {
        const double next = 0.1 * median_diameter(result.labels, result.grains, solid.voxel_volume());
        if (next < 1.1 * result.closing_radius) break;
        WatershedResult trial = split_once(solid, next, options.dynamics, left_open);
        if (left_open < 0.5) break;
        result = std::move(trial);
    }
    for (std::size_t v = 0; v < result.labels.size(); ++v)
        if (!solid.voxels[v]) result.labels[v] = 0;
    result.grains = renumber(result.labels, result.grains);
    return result;
}

}  // namespace coral::morph
