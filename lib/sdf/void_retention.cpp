#include "sdf/void_retention.h"

#include <cassert>

#include "core/parallel.h"

namespace coral::sdf {
namespace {

/// Marks the positive nodes joined over faces to the first node, which lies outside (the solid keeps off the border of the grid).
std::vector<std::uint8_t> linked_nodes(const DistanceGrid& grid)
{
    std::vector<std::uint8_t> linked(grid.node_count(), 0);
    const std::size_t nx = std::size_t(grid.size.x()), layer = nx * std::size_t(grid.size.y());
    std::vector<std::size_t> stack;
    const auto visit = [&](std::size_t n) {
        if (linked[n] || !(grid.distance[n] > 0)) return;
        linked[n] = 1;
        stack.push_back(n);
    };
    visit(0);
    while (!stack.empty()) {
        const std::size_t n = stack.back();
        stack.pop_back();
        if (n % nx > 0) visit(n - 1);
        if (n % nx + 1 < nx) visit(n + 1);
        if (n % layer >= nx) visit(n - nx);
        if (n % layer + nx < layer) visit(n + nx);
        if (n >= layer) visit(n - layer);
        if (n + layer < linked.size()) visit(n + layer);
    }
    return linked;
}

/// Whether the nearest positive node around a point is linked to the outside. (Not any of the eight: across a thin wall the others are.)
bool is_linked(const DistanceGrid& grid, const std::vector<std::uint8_t>& linked, const Eigen::Vector3d& point)
{
    const Eigen::Vector3d at = (point - grid.origin) / grid.spacing;
    Eigen::Vector3i low;
    for (int a = 0; a < 3; ++a) low[a] = std::clamp(int(std::floor(at[a])), 0, grid.size[a] - 2);
    double nearest = 4.0;  // more than any squared distance in a cell
    bool found = false;
    for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3i node = low + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2);
        const std::size_t n = grid.index(node.x(), node.y(), node.z());
        const double squared = (node.cast<double>() - at).squaredNorm();
        if (!(grid.distance[n] > 0) || squared >= nearest) continue;
        nearest = squared;
        found = linked[n] != 0;
    }
    return found;
}

struct Counts {
    std::size_t masked = 0, voids = 0, shared = 0, open = 0, cut_off = 0, lost = 0;
    Counts operator+(const Counts& o) const
    {
        return {masked + o.masked, voids + o.voids, shared + o.shared, open + o.open, cut_off + o.cut_off, lost + o.lost};
    }
};

}  // namespace

VoidRetention& VoidRetention::operator+=(const VoidRetention& other)
{
    masked += other.masked;
    kept += other.kept;
    voids += other.voids;
    shared += other.shared;
    open += other.open;
    cut_off += other.cut_off;
    solid_lost += other.solid_lost;
    return *this;
}

VoidRetention void_retention(const GrainMask& solid, const GrainMask& apparent, std::span<const std::uint8_t> classes, const GrainLevelSet& grain)
{
    assert(solid.size == apparent.size && classes.size() == apparent.solid.size());
    const std::vector<std::uint8_t> linked = linked_nodes(grain.solid);
    const std::size_t nx = std::size_t(solid.size.x()), ny = std::size_t(solid.size.y()), rows = ny * std::size_t(solid.size.z());
    const Counts sum = parallel_sum(rows, 256, Counts{}, [&](std::size_t begin, std::size_t end) {
        Counts part;
        for (std::size_t row = begin; row < end; ++row)
            for (std::size_t i = 0; i < nx; ++i) {
                const std::size_t v = row * nx + i;
                part.masked += apparent.solid[v] && !solid.solid[v];
                if (classes[v] == 0 && !solid.solid[v]) continue;
                const Eigen::Vector3d p = solid.first_centre - grain.centre +
                                          solid.voxel_size.cwiseProduct(Eigen::Vector3d(double(i), double(row % ny), double(row / ny)));
                const bool free = grain.solid.sample(p) > 0;
                if (solid.solid[v]) {
                    part.lost += free;
                    continue;
                }
                ++part.voids;
                part.shared += free && grain.apparent.sample(p) < 0;
                part.open += classes[v] == 2;
                part.cut_off += classes[v] == 2 && !(free && is_linked(grain.solid, linked, p));
            }
        return part;
    });
    const double voxel = solid.voxel_size.prod();
    VoidRetention out;
    out.solid_lost = double(sum.lost) * voxel;
    if (sum.voids == 0) return out;
    out.masked = double(sum.masked) * voxel;
    out.kept = grain.apparent_volume - grain.volume;
    out.voids = double(sum.voids) * voxel;
    out.shared = double(sum.shared) * voxel;
    out.open = double(sum.open) * voxel;
    out.cut_off = double(sum.cut_off) * voxel;
    return out;
}

}  // namespace coral::sdf
