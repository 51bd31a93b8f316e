#include "morph/distance_transform.h"

#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace coral::morph {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr int tile_width = 32;  // columns worked on together: two cache lines of floats
using Row = Eigen::Array<float, tile_width, 1>;

/// Scratch of one task: a tile before and after, and the lower envelope of parabolas.
struct Scratch {
    explicit Scratch(int n)
        : before(std::size_t(n)), after(std::size_t(n)), column(std::size_t(n)), apex(std::size_t(n)), from(std::size_t(n) + 1) {}
    std::vector<Row> before, after;  ///< [n]
    std::vector<float> column;
    std::vector<int> apex;     ///< position of each parabola of the envelope
    std::vector<double> from;  ///< where each parabola starts to be the lowest
};

/// after(q) = min over p of before(p) + (w (q - p))^2 for all columns at once, looking ever farther from q until no column can gain.
/// Short distances are the rule, and there this beats the envelope. Returns false, work undone, when one is longer than `farthest`.
bool search_tile(int n, double w, Scratch& s)
{
    constexpr int farthest = 96;
    for (int q = 0; q < n; ++q) {
        Row best = s.before[std::size_t(q)];
        for (int step = 1; step < n; ++step) {
            const float rise = float(w * w * step * step);
            if (best.maxCoeff() <= rise) break;
            if (step > farthest) return false;
            if (q >= step) best = best.min(s.before[std::size_t(q - step)] + rise);
            if (q + step < n) best = best.min(s.before[std::size_t(q + step)] + rise);
        }
        s.after[std::size_t(q)] = best;
    }
    return true;
}

/// The same for column c by the lower envelope of parabolas [Felzenszwalb & Huttenlocher 2012, Theory Comput. 8].
void envelope_column(int c, int n, double w, Scratch& s)
{
    for (int q = 0; q < n; ++q) s.column[std::size_t(q)] = s.before[std::size_t(q)][c];
    const std::vector<float>& f = s.column;
    const double w2 = w * w;
    int top = -1;
    for (int q = 0; q < n; ++q) {
        const double at = f[std::size_t(q)];
        if (at == infinity) continue;
        double start = -std::numeric_limits<double>::infinity();
        while (top >= 0) {
            const int p = s.apex[std::size_t(top)];
            start = (at - double(f[std::size_t(p)]) + w2 * (double(q) * q - double(p) * p)) / (2.0 * w2 * (q - p));
            if (start > s.from[std::size_t(top)]) break;
            --top;
        }
        if (top < 0) start = -std::numeric_limits<double>::infinity();
        ++top;
        s.apex[std::size_t(top)] = q;
        s.from[std::size_t(top)] = start;
    }
    if (top < 0) {
        for (int q = 0; q < n; ++q) s.after[std::size_t(q)][c] = infinity;
        return;
    }
    s.from[std::size_t(top) + 1] = std::numeric_limits<double>::infinity();
    for (int q = 0, e = 0; q < n; ++q) {
        while (s.from[std::size_t(e) + 1] < q) ++e;
        const double step = double(q - s.apex[std::size_t(e)]);
        s.after[std::size_t(q)][c] = float(double(f[std::size_t(s.apex[std::size_t(e)])]) + w2 * step * step);
    }
}

/// Transforms all columns of one plane in place: columns start at base + x and step by `stride`.
void transform_plane(float* base, int width, int n, std::size_t stride, double w, Scratch& s)
{
    for (int x0 = 0; x0 < width; x0 += tile_width) {
        const int columns = std::min(tile_width, width - x0);
        bool any = false;
        for (int q = 0; q < n; ++q) {
            Row& row = s.before[std::size_t(q)];
            const float* from = base + std::size_t(q) * stride + x0;
            // Columns past the edge repeat the last one, so that they ask for no work of their own.
            for (int c = 0; c < tile_width; ++c) row[c] = from[std::min(c, columns - 1)];
            any = any || row.minCoeff() < infinity;
        }
        if (!any) continue;
        if (!search_tile(n, w, s))
            for (int c = 0; c < columns; ++c) envelope_column(c, n, w, s);
        for (int q = 0; q < n; ++q) std::copy_n(s.after[std::size_t(q)].data(), columns, base + std::size_t(q) * stride + x0);
    }
}

/// Along x the distance is that to the last feature on either side: two sweeps.
void transform_row(const std::uint8_t* voxels, float* d2, int n, std::uint8_t feature, double w)
{
    float steps = infinity;
    for (int i = 0; i < n; ++i) d2[i] = steps = voxels[i] == feature ? 0.0F : steps + 1.0F;
    steps = infinity;
    for (int i = n - 1; i >= 0; --i) {
        steps = voxels[i] == feature ? 0.0F : steps + 1.0F;
        d2[i] = std::min(d2[i], steps);
    }
    for (int i = 0; i < n; ++i) d2[i] = float(w * w * double(d2[i]) * double(d2[i]));
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
