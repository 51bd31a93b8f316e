#include "morph/components.h"

#include <algorithm>
#include <limits>

#include "core/error.h"

namespace coral::morph {
namespace {

struct Run {
    int begin, end;       ///< x range [begin, end)
    std::uint32_t label;  ///< number of the run itself, then of its component
};

std::uint32_t find_root(std::vector<std::uint32_t>& parent, std::uint32_t a)
{
    while (parent[a] != a) {
        parent[a] = parent[parent[a]];
        a = parent[a];
    }
    return a;
}

void unite(std::vector<std::uint32_t>& parent, std::uint32_t a, std::uint32_t b)
{
    a = find_root(parent, a);
    b = find_root(parent, b);
    if (a != b) parent[std::max(a, b)] = std::min(a, b);  // the root is the first run in memory order
}

/// Unites the runs of two rows that touch; `reach` = 1 lets them touch diagonally.
void join_rows(std::span<const Run> row, std::span<const Run> other, int reach, std::vector<std::uint32_t>& parent)
{
    std::size_t o = 0;
    for (const Run& run : row) {
        while (o < other.size() && other[o].end + reach <= run.begin) ++o;
        for (std::size_t p = o; p < other.size() && other[p].begin < run.end + reach; ++p) unite(parent, run.label, other[p].label);
    }
}

}  // namespace

Components connected_components(std::span<const std::uint8_t> voxels, const Eigen::Vector3i& size, std::uint8_t value,
                                Connectivity connectivity)
{
    const int nx = size.x(), ny = size.y(), nz = size.z();
    const std::size_t rows = std::size_t(ny) * std::size_t(nz);
    std::vector<Run> runs;
    std::vector<std::size_t> first(rows + 1, 0);
    for (std::size_t r = 0; r < rows; ++r) {
        const std::uint8_t* v = &voxels[r * std::size_t(nx)];
        for (int i = 0; i < nx;) {
            if (v[i] != value) {
                ++i;
                continue;
            }
            const int begin = i;
            while (i < nx && v[i] == value) ++i;
            runs.push_back({begin, i, std::uint32_t(runs.size())});
        }
        first[r + 1] = runs.size();
    }
    if (runs.size() > std::numeric_limits<std::uint32_t>::max() - 2)
        throw Error("connected components", "more than 2^32 runs of voxels", "crop or coarsen the stack");
    std::vector<std::uint32_t> parent(runs.size());
    for (std::size_t i = 0; i < parent.size(); ++i) parent[i] = std::uint32_t(i);

    const auto row = [&](int j, int k) {
        const std::size_t r = std::size_t(k) * std::size_t(ny) + std::size_t(j);
        return std::span<const Run>(runs.data() + first[r], first[r + 1] - first[r]);
    };
    const int reach = connectivity == Connectivity::full ? 1 : 0;
    for (int k = 0; k < nz; ++k)
        for (int j = 0; j < ny; ++j) {
            if (j > 0) join_rows(row(j, k), row(j - 1, k), reach, parent);
            if (k == 0) continue;
            for (int b = std::max(j - reach, 0); b <= std::min(j + reach, ny - 1); ++b) join_rows(row(j, k), row(b, k - 1), reach, parent);
        }

    Components out;
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const std::uint32_t root = find_root(parent, std::uint32_t(i));  // a root comes before its other runs
        if (root == i) {
            out.sizes.push_back(0);
            runs[i].label = std::uint32_t(out.sizes.size());
        } else {
            runs[i].label = runs[root].label;
        }
        out.sizes[runs[i].label - 1] += std::size_t(runs[i].end - runs[i].begin);
    }
    out.labels.reserve(rows * std::size_t(nx), out.sizes.size() > 65535 ? 4 : out.sizes.size() > 255 ? 2 : 1);
    std::vector<std::uint32_t> line;
    for (std::size_t r = 0; r < rows; ++r) {
        line.assign(std::size_t(nx), 0);
        for (std::size_t i = first[r]; i < first[r + 1]; ++i) std::fill(line.begin() + runs[i].begin, line.begin() + runs[i].end, runs[i].label);
        out.labels.append(std::span<const std::uint32_t>(line));
    }
    return out;
}

std::vector<std::uint8_t> connected_to_border(std::span<const std::uint8_t> voxels, const Eigen::Vector3i& size, std::uint8_t value)
{
    const std::size_t nx = std::size_t(size.x()), ny = std::size_t(size.y()), nz = std::size_t(size.z()), plane = nx * ny;
    std::vector<std::uint8_t> reached(plane * nz, 0);
    std::vector<std::size_t> stack;
    const auto visit = [&](std::size_t v) {
        if (voxels[v] != value || reached[v]) return;
        reached[v] = 1;
        stack.push_back(v);
    };
    const auto flood = [&] {
        while (!stack.empty()) {
            const std::size_t v = stack.back();
            stack.pop_back();
            const std::size_t i = v % nx, j = v / nx % ny, k = v / plane;
            if (i > 0) visit(v - 1);
            if (i + 1 < nx) visit(v + 1);
            if (j > 0) visit(v - nx);
            if (j + 1 < ny) visit(v + nx);
            if (k > 0) visit(v - plane);
            if (k + 1 < nz) visit(v + plane);
        }
    };
    for (std::size_t k = 0; k < nz; ++k)
        for (std::size_t j = 0; j < ny; ++j) {
            const bool whole_row = k == 0 || k + 1 == nz || j == 0 || j + 1 == ny;
            for (std::size_t i = 0; i < nx; i += whole_row || nx == 1 ? 1 : nx - 1) visit(k * plane + j * nx + i);
            flood();
        }
    return reached;
}

Islands keep_largest_component(Mask& mask)
{
    const Components parts = connected_components(mask.voxels, mask.size, 1, Connectivity::full);
    Islands islands;
    if (parts.sizes.size() < 2) return islands;
    const auto largest = std::uint32_t(std::max_element(parts.sizes.begin(), parts.sizes.end()) - parts.sizes.begin()) + 1;
    for (std::size_t v = 0; v < parts.labels.size(); ++v)
        if (parts.labels[v] != largest) mask.voxels[v] = 0;
    islands.count = parts.sizes.size() - 1;
    for (std::size_t s : parts.sizes) islands.voxels += s;
    islands.voxels -= parts.sizes[largest - 1];
    return islands;
}

}  // namespace coral::morph
