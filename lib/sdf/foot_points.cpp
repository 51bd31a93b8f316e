#include "sdf/detail/foot_points.h"

#include <cstdint>

#include "core/parallel.h"

namespace coral::sdf::detail {
namespace {

/// Zero between a node and a neighbour of other sign: the interpolant passes through both nodes, so bisection cannot fail.
Eigen::Vector3d bisect(const CubicField& field, Eigen::Vector3d solid, Eigen::Vector3d open, Eigen::Vector3d& normal)
{
    Eigen::Vector3d middle = solid, gradient;
    for (int n = 0; n < 16; ++n) {
        middle = 0.5 * (solid + open);
        (field.value(middle, gradient) < 0.0 ? solid : open) = middle;
    }
    normal = gradient.norm() > 1e-9 ? gradient.normalized() : (open - solid).normalized();
    return middle;
}

/// Whether the sign changes between each node of a row and one of its six neighbours; `line` is the row's first node.
void find_crossings(const CubicField& field, const float* line, std::vector<std::uint8_t>& crossing)
{
    const std::ptrdiff_t row = field.row(), layer = field.layer();
    std::uint8_t* out = crossing.data();
    for (std::ptrdiff_t i = 1; i < row - 1; ++i) {
        const bool solid = line[i] < 0;
        out[i] = ((line[i - 1] < 0) != solid) | ((line[i + 1] < 0) != solid) | ((line[i - row] < 0) != solid) | ((line[i + row] < 0) != solid) |
                 ((line[i - layer] < 0) != solid) | ((line[i + layer] < 0) != solid);
    }
}

void take_row(const CubicField& field, int j, int k, std::vector<std::uint8_t>& crossing, std::vector<FootPoint>& feet)
{
    const std::ptrdiff_t row = field.row(), layer = field.layer();
    const float* line = field.values + row * j + layer * k;
    const std::ptrdiff_t offsets[6] = {-1, 1, -row, row, -layer, layer};
    const Eigen::Vector3d steps[6] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
    find_crossings(field, line, crossing);
    for (int i = 1; i < field.size.x() - 1; ++i) {
        if (!crossing[std::size_t(i)]) continue;
        const bool solid = line[i] < 0;
        int side = 0;
        while ((line[i + offsets[side]] < 0) == solid) ++side;
        const Eigen::Vector3d node(i, j, k);
        Eigen::Vector3d p = node, normal;
        if (!field.project(p, normal) || (p - node).squaredNorm() > 2.25) {
            const Eigen::Vector3d other = node + steps[side];
            p = bisect(field, solid ? node : other, solid ? other : node, normal);
        }
        feet.push_back({p.cast<float>(), normal.cast<float>()});
    }
}

}  // namespace

std::vector<FootPoint> find_foot_points(const CubicField& field)
{
    constexpr std::size_t layers_per_block = 16;
    const std::size_t layers = std::size_t(field.size.z());
    std::vector<std::vector<FootPoint>> parts((layers + layers_per_block - 1) / layers_per_block);
    parallel_blocks(layers, layers_per_block, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint8_t> crossing(std::size_t(field.size.x()));
        for (std::size_t k = std::max<std::size_t>(begin, 1); k < std::min(end, layers - 1); ++k)
            for (int j = 1; j < field.size.y() - 1; ++j) take_row(field, j, int(k), crossing, parts[begin / layers_per_block]);
    });
    std::vector<FootPoint> feet;
    std::size_t total = 0;
    for (const auto& part : parts) total += part.size();
    feet.reserve(total);
    for (const auto& part : parts) feet.insert(feet.end(), part.begin(), part.end());
    return feet;
}

}  // namespace coral::sdf::detail
