#include "morph/distance_transform.h"

#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace coral::morph {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr int tile_width = 16;  // columns gathered together: one cache line of floats

/// Scratch of one task: columns of a tile and the lower envelope of parabolas.
struct Scratch {
    explicit Scratch(int n) : column(std::size_t(n) * tile_width), result(std::size_t(n)), apex(std::size_t(n)), from(std::size_t(n) + 1) {}
    std::vector<float> column;  ///< [tile_width][n]
    std::vector<float> result;
    std::vector<int> apex;       ///< position of each parabola of the envelope
    std::vector<double> from;    ///< where each parabola starts to be the lowest
};

/// result(q) = min over p of f(p) + (w (q - p))^2, by the lower envelope of parabolas.
void transform_column(const float* f, int n, double w, Scratch& s)
{
    const double w2 = w * w;
    int top = -1;
    for (int q = 0; q < n; ++q) {
        if (f[q] == infinity) continue;
        double start = -std::numeric_limits<double>::infinity();
        while (top >= 0) {
            const int p = s.apex[std::size_t(top)];
            start = (double(f[q]) - double(f[p]) + w2 * (double(q) * q - double(p) * p)) / (2.0 * w2 * (q - p));
            if (start > s.from[std::size_t(top)]) break;
            --top;
        }
        if (top < 0) start = -std::numeric_limits<double>::infinity();
        ++top;
        s.apex[std::size_t(top)] = q;
        s.from[std::size_t(top)] = start;
    }
    if (top < 0) {
        std::fill_n(s.result.begin(), n, infinity);
        return;
    }
    s.from[std::size_t(top) + 1] = std::numeric_limits<double>::infinity();
    for (int q = 0, e = 0; q < n; ++q) {
        while (s.from[std::size_t(e) + 1] < q) ++e;
        const double step = double(q - s.apex[std::size_t(e)]);
        s.result[std::size_t(q)] = float(double(f[s.apex[std::size_t(e)]]) + w2 * step * step);
    }
}

/// Transforms all columns of one plane in place: columns start at base + x and step by `stride`.
void transform_plane(float* base, int width, int n, std::size_t stride, double w, Scratch& s)
{
    for (int x0 = 0; x0 < width; x0 += tile_width) {
        const int columns = std::min(tile_width, width - x0);
        for (int q = 0; q < n; ++q)
            for (int c = 0; c < columns; ++c) s.column[std::size_t(c * n + q)] = base[std::size_t(q) * stride + std::size_t(x0 + c)];
        for (int c = 0; c < columns; ++c) {
            transform_column(&s.column[std::size_t(c * n)], n, w, s);
            std::copy_n(s.result.begin(), n, s.column.begin() + c * n);
        }
        for (int q = 0; q < n; ++q)
            for (int c = 0; c < columns; ++c) base[std::size_t(q) * stride + std::size_t(x0 + c)] = s.column[std::size_t(c * n + q)];
    }
}

/// Along x the distance is that to the last feature on either side: two sweeps.
void transform_row(const std::uint8_t* voxels, float* d2, int n, std::uint8_t feature, double w)
{
    const auto squared = [w](int steps) { return float(w * w * double(steps) * double(steps)); };
    int last = -1;
    for (int i = 0; i < n; ++i) {
        if (voxels[i] == feature) last = i;
        d2[i] = last < 0 ? infinity : squared(i - last);
    }
    last = -1;
    for (int i = n - 1; i >= 0; --i) {
        if (voxels[i] == feature) last = i;
        if (last >= 0) d2[i] = std::min(d2[i], squared(last - i));
    }
}

}  // namespace

std::vector<float> squared_distances(std::span<const std::uint8_t> voxels, const Eigen::Vector3i& size, std::uint8_t feature,
                                     const Eigen::Vector3d& edges)
{
    const int nx = size.x(), ny = size.y(), nz = size.z();
    const std::size_t plane = std::size_t(nx) * std::size_t(ny);
    std::vector<float> d2(plane * std::size_t(nz));
    parallel_blocks(std::size_t(nz), 4, [&](std::size_t begin, std::size_t end) {
        Scratch s(ny);
        for (std::size_t k = begin; k < end; ++k) {
            for (int j = 0; j < ny; ++j) {
                const std::size_t row = k * plane + std::size_t(j) * std::size_t(nx);
                transform_row(&voxels[row], &d2[row], nx, feature, edges.x());
            }
            transform_plane(&d2[k * plane], nx, ny, std::size_t(nx), edges.y(), s);
        }
    });
    parallel_blocks(std::size_t(ny), 4, [&](std::size_t begin, std::size_t end) {
        Scratch s(nz);
        for (std::size_t j = begin; j < end; ++j) transform_plane(&d2[j * std::size_t(nx)], nx, nz, plane, edges.z(), s);
    });
    return d2;
}

}  // namespace coral::morph
