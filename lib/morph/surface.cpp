#include "morph/surface.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"

namespace coral::morph {
namespace {

constexpr double smallest_occupancy = 1e-5;  // beyond it the truncated Gaussian tells nothing about the distance

std::vector<float> gaussian_weights(double sigma)
{
    const int reach = std::max(1, int(std::ceil(4.0 * sigma)));
    std::vector<double> w(std::size_t(2 * reach + 1));
    double sum = 0;
    for (int i = -reach; i <= reach; ++i) sum += w[std::size_t(i + reach)] = std::exp(-0.5 * i * i / (sigma * sigma));
    std::vector<float> out(w.size());
    std::transform(w.begin(), w.end(), out.begin(), [sum](double v) { return float(v / sum); });
    return out;
}

/// Convolves along one axis: lines of `n` elements `stride` apart, `width` neighbouring lines at once.
void convolve_lines(float* base, std::size_t width, int n, std::size_t stride, const std::vector<float>& w, std::vector<float>& scratch)
{
    const int reach = int(w.size() / 2);
    scratch.assign(std::size_t(n + 2 * reach) * width, 0.0F);
    for (int q = 0; q < n; ++q) std::copy_n(base + std::size_t(q) * stride, width, &scratch[std::size_t(q + reach) * width]);
    for (int q = 0; q < n; ++q) {
        float* out = base + std::size_t(q) * stride;
        std::fill_n(out, width, 0.0F);
        for (std::size_t t = 0; t < w.size(); ++t) {
            const float* in = &scratch[(std::size_t(q) + t) * width];
            for (std::size_t x = 0; x < width; ++x) out[x] += w[t] * in[x];
        }
    }
}

void smooth_rows(float* base, std::size_t rows, int nx, const std::vector<float>& w, std::vector<float>& scratch)
{
    const int reach = int(w.size() / 2);
    scratch.assign(std::size_t(nx + 2 * reach), 0.0F);
    for (std::size_t r = 0; r < rows; ++r) {
        float* row = base + r * std::size_t(nx);
        std::copy_n(row, nx, scratch.begin() + reach);
        std::fill_n(row, nx, 0.0F);
        for (std::size_t t = 0; t < w.size(); ++t)
            for (int i = 0; i < nx; ++i) row[i] += w[t] * scratch[std::size_t(i) + t];
    }
}

/// Marching tetrahedra over a lattice of occupancies; `origin` is the position of lattice point (0, 0, 0).
class Marcher {
public:
    Marcher(const std::vector<float>& occupancy, const Eigen::Vector3i& size, const Eigen::Vector3d& edges, const Eigen::Vector3d& origin)
        : o_(occupancy), size_(size), edges_(edges), origin_(origin), plane_(std::size_t(size.x()) * std::size_t(size.y()))
    {
        for (auto& slab : slabs_) slab.assign(7 * plane_, 0);
        codes_.resize(std::size_t(size_.x()));
    }

    SurfaceMesh run()
    {
        for (int k = 0; k + 1 < size_.z(); ++k) {
            std::swap(slabs_[0], slabs_[1]);
            if (k == 0) std::fill(slabs_[0].begin(), slabs_[0].end(), 0U);
            std::fill(slabs_[1].begin(), slabs_[1].end(), 0U);
            for (int j = 0; j + 1 < size_.y(); ++j) {
                find_corners(j, k);
                for (int i = 0; i + 1 < size_.x(); ++i)
                    if (codes_[std::size_t(i)] != 0 && codes_[std::size_t(i)] != 255) cell(i, j, k);
            }
        }
        return std::move(mesh_);
    }

private:
    /// Corner bits: 1 = +x, 2 = +y, 4 = +z. The six Kuhn tetrahedra walk from corner 0 to 7 along permutations of the axes.
    static constexpr std::array<std::array<int, 2>, 6> middle{{{1, 3}, {2, 6}, {4, 5}, {1, 5}, {2, 3}, {4, 6}}};  // first three even

    /// Corners inside, as bits, of the cells of a row.
    void find_corners(int j, int k)
    {
        const std::size_t nx = std::size_t(size_.x());
        const float* row = &o_[std::size_t(k) * plane_ + std::size_t(j) * nx];
        std::uint8_t* codes = codes_.data();
        for (std::size_t i = 0; i + 1 < nx; ++i) {
            int inside = 0;
            for (std::size_t c = 0; c < 4; ++c) {
                const float* at = row + (c & 1 ? nx : 0) + (c & 2 ? plane_ : 0) + i;
                inside |= int(at[0] >= 0.5F) << (2 * c) | int(at[1] >= 0.5F) << (2 * c + 1);
            }
            codes[i] = std::uint8_t(inside);
        }
    }

    void cell(int i, int j, int k)
    {
        const std::size_t base = std::size_t(k) * plane_ + std::size_t(j) * std::size_t(size_.x()) + std::size_t(i);
        for (int c = 0; c < 8; ++c)
            corner_[std::size_t(c)] = o_[base + std::size_t(c & 1) + (c & 2 ? std::size_t(size_.x()) : 0) + (c & 4 ? plane_ : 0)];
        const int inside = codes_[std::size_t(i)];
        at_ = {i, j, k};
        for (std::size_t t = 0; t < 6; ++t) {
            // An odd permutation has its middle corners swapped to make the tetrahedron positive.
            const bool even = t < 3;
            tetrahedron({0, middle[t][even ? 0 : 1], middle[t][even ? 1 : 0], 7}, inside);
        }
    }

    void tetrahedron(std::array<int, 4> v, int inside_corners)
    {
        int inside = 0;
        for (int n = 0; n < 4; ++n) inside |= (inside_corners >> v[std::size_t(n)] & 1) << n;
        // Even permutations that bring the odd vertex, or the inside pair, to the front.
        static constexpr std::array<std::array<int, 4>, 4> single{{{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 1, 0}}};
        const auto edge = [&](int a, int b) { return vertex(v[std::size_t(a)], v[std::size_t(b)]); };
        const auto pair = [&](int a, int b, int c, int d) {
            const std::uint32_t ac = edge(a, c), ad = edge(a, d), bd = edge(b, d), bc = edge(b, c);
            add(ac, ad, bd);
            add(ac, bd, bc);
        };
        switch (inside) {
            case 1: case 2: case 4: case 8: {
                const auto& s = single[inside == 1 ? 0 : inside == 2 ? 1 : inside == 4 ? 2 : 3];
                add(edge(s[0], s[1]), edge(s[0], s[2]), edge(s[0], s[3]));
                break;
            }
            case 14: case 13: case 11: case 7: {
                const auto& s = single[inside == 14 ? 0 : inside == 13 ? 1 : inside == 11 ? 2 : 3];
                add(edge(s[0], s[1]), edge(s[0], s[3]), edge(s[0], s[2]));
                break;
            }
            case 3: pair(0, 1, 2, 3); break;
            case 5: pair(0, 2, 3, 1); break;
            case 9: pair(0, 3, 1, 2); break;
            case 6: pair(1, 2, 0, 3); break;
            case 10: pair(1, 3, 2, 0); break;
            case 12: pair(2, 3, 0, 1); break;
            default: break;
        }
    }

    /// Number of the vertex on the edge between two corners of the cell; made at first use.
    std::uint32_t vertex(int a, int b)
    {
        if (a > b) std::swap(a, b);  // along a tetrahedron the corner number grows with the position
        const int low = a, step = b ^ a;
        const std::size_t column = std::size_t(at_[1] + (low >> 1 & 1)) * std::size_t(size_.x()) + std::size_t(at_[0] + (low & 1));
        std::uint32_t& id = slabs_[std::size_t(low >> 2 & 1)][std::size_t(step - 1) * plane_ + column];
        if (id == 0) {
            const double fa = height(corner_[std::size_t(a)]), fb = height(corner_[std::size_t(b)]);
            const double t = fa / (fa - fb);
            Eigen::Vector3d p;
            for (int axis = 0; axis < 3; ++axis)
                p[axis] = origin_[axis] + edges_[axis] * (at_[std::size_t(axis)] + (low >> axis & 1) + t * (step >> axis & 1));
            mesh_.vertices.push_back(p);
            id = std::uint32_t(mesh_.vertices.size());
        }
        return id - 1;
    }

    static double height(float occupancy)
    {
        const double h = -probit(std::clamp(double(occupancy), smallest_occupancy, 1.0 - smallest_occupancy));
        // A node exactly at one half counts as inside; a hair keeps the two ends of an edge apart.
        return occupancy >= 0.5F ? std::min(h, -1e-9) : std::max(h, 1e-9);
    }

    void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) { mesh_.triangles.push_back({a, b, c}); }

    const std::vector<float>& o_;
    Eigen::Vector3i size_;
    Eigen::Vector3d edges_, origin_;
    std::size_t plane_;
    std::array<std::vector<std::uint32_t>, 2> slabs_;  ///< vertex numbers + 1 by lowest lattice point and edge direction
    std::vector<std::uint8_t> codes_;  ///< of the cells of a row
    std::array<float, 8> corner_{};
    std::array<int, 3> at_{};
    SurfaceMesh mesh_;
};

/// Share of solid in blocks of `factor` voxels, with a margin of `margin` empty blocks.
std::vector<float> block_occupancy(const Mask& mask, const Eigen::Vector3i& factor, int margin, Eigen::Vector3i& size)
{
    for (int a = 0; a < 3; ++a) size[a] = (mask.size[a] + factor[a] - 1) / factor[a] + 2 * margin;
    std::vector<float> out(std::size_t(size.x()) * std::size_t(size.y()) * std::size_t(size.z()), 0.0F);
    const float one = 1.0F / float(factor.prod());
    for (int k = 0; k < mask.size.z(); ++k)
        for (int j = 0; j < mask.size.y(); ++j) {
            float* row = &out[(std::size_t(k / factor.z() + margin) * std::size_t(size.y()) + std::size_t(j / factor.y() + margin)) *
                              std::size_t(size.x()) + std::size_t(margin)];
            const std::uint8_t* v = &mask.voxels[mask.index(0, j, k)];
            for (int i = 0; i < mask.size.x(); ++i) row[i / factor.x()] += v[i] ? one : 0.0F;
        }
    return out;
}

/// Largest principal curvature of the level surface through each lattice point, from central differences of the height.
double largest_curvature(const Eigen::Vector3d& g, const Eigen::Matrix3d& h)
{
    const double g2 = g.squaredNorm();
    if (g2 == 0.0) return 0.0;
    const double norm = std::sqrt(g2);
    const double mean = (g2 * h.trace() - g.dot(h * g)) / (2.0 * norm * g2);
    Eigen::Matrix3d adjugate;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
            adjugate(r, c) = h(r1, c1) * h(r2, c2) - h(r1, c2) * h(r2, c1);
        }
    const double gauss = g.dot(adjugate * g) / (g2 * g2);
    return mean + std::sqrt(std::max(mean * mean - gauss, 0.0));
}

}  // namespace

double probit(double p)
{
    constexpr std::array<double, 6> a{-3.969683028665376e+01, 2.209460984245205e+02, -2.759285104469687e+02,
                                      1.383577518672690e+02, -3.066479806614716e+01, 2.506628277459239e+00};
    constexpr std::array<double, 5> b{-5.447609879822406e+01, 1.615858368580409e+02, -1.556989798598866e+02, 6.680131188771972e+01,
                                      -1.328068155288572e+01};
    constexpr std::array<double, 6> c{-7.784894002430293e-03, -3.223964580411365e-01, -2.400758277161838e+00,
                                      -2.549732539343734e+00, 4.374664141464968e+00, 2.938163982698783e+00};
    constexpr std::array<double, 4> d{7.784695709041462e-03, 3.224671290700398e-01, 2.445134137142996e+00, 3.754408661907416e+00};
    if (p > 0.5) return -probit(1.0 - p);
    if (p < 0.02425) {
        const double q = std::sqrt(-2.0 * std::log(p));
        return (((((c[0] * q + c[1]) * q + c[2]) * q + c[3]) * q + c[4]) * q + c[5]) / ((((d[0] * q + d[1]) * q + d[2]) * q + d[3]) * q + 1.0);
    }
    const double q = p - 0.5, r = q * q;
    return (((((a[0] * r + a[1]) * r + a[2]) * r + a[3]) * r + a[4]) * r + a[5]) * q /
           (((((b[0] * r + b[1]) * r + b[2]) * r + b[3]) * r + b[4]) * r + 1.0);
}

double surface_area(const SurfaceMesh& mesh)
{
    double sum = 0;
    for (const auto& t : mesh.triangles)
        sum += 0.5 * (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]).norm();
    return sum;
}

double enclosed_volume(const SurfaceMesh& mesh)
{
    double sum = 0;
    for (const auto& t : mesh.triangles) sum += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6.0;
    return sum;
}

void smooth(std::vector<float>& values, const Eigen::Vector3i& size, const Eigen::Vector3d& sigma)
{
    const std::size_t nx = std::size_t(size.x()), ny = std::size_t(size.y()), plane = nx * ny;
    const std::vector<float> wx = gaussian_weights(sigma.x()), wy = gaussian_weights(sigma.y()), wz = gaussian_weights(sigma.z());
    parallel_blocks(std::size_t(size.z()), 4, [&](std::size_t begin, std::size_t end) {
        std::vector<float> scratch;
        for (std::size_t k = begin; k < end; ++k) {
            smooth_rows(&values[k * plane], ny, size.x(), wx, scratch);
            convolve_lines(&values[k * plane], nx, size.y(), nx, wy, scratch);
        }
    });
    parallel_blocks(ny, 4, [&](std::size_t begin, std::size_t end) {
        std::vector<float> scratch;
        for (std::size_t j = begin; j < end; ++j) convolve_lines(&values[j * nx], nx, size.z(), plane, wz, scratch);
    });
}

SurfaceMesh extract_surface(const Mask& mask, double sigma)
{
    const int margin = int(std::ceil(4.0 * sigma)) + 1;
    Eigen::Vector3i size;
    std::vector<float> occupancy = block_occupancy(mask, Eigen::Vector3i::Ones(), margin, size);
    smooth(occupancy, size, Eigen::Vector3d::Constant(sigma));
    return Marcher(occupancy, size, mask.voxel_size, (0.5 - margin) * mask.voxel_size).run();
}

std::vector<CurvatureSample> surface_curvature(const Mask& mask, double scale)
{
    scale = std::max(scale, 1.5 * mask.voxel_size.maxCoeff());
    Eigen::Vector3i factor, size;
    for (int a = 0; a < 3; ++a) factor[a] = std::max(1, int(scale / (1.5 * mask.voxel_size[a])));
    const Eigen::Vector3d edges = factor.cast<double>().cwiseProduct(mask.voxel_size);
    const Eigen::Vector3d sigma = (scale / edges.array()).matrix();
    const int margin = int(std::ceil(4.0 * sigma.maxCoeff())) + 2;
    std::vector<float> height = block_occupancy(mask, factor, margin, size);
    smooth(height, size, sigma);
    const SurfaceMesh mesh = Marcher(height, size, edges, Eigen::Vector3d::Zero()).run();
    const double farthest = -scale * probit(smallest_occupancy);
    parallel_blocks(height.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const double o = height[v];
            height[v] = float(o <= smallest_occupancy ? farthest : o >= 1.0 - smallest_occupancy ? -farthest : -scale * probit(o));
        }
    });

    const std::ptrdiff_t dx = 1, dy = size.x(), dz = std::ptrdiff_t(size.x()) * size.y();
    const std::array<std::ptrdiff_t, 3> step{dx, dy, dz};
    const auto at_node = [&](std::ptrdiff_t v) {
        const auto f = [&](std::ptrdiff_t o) { return double(height[std::size_t(v + o)]); };
        Eigen::Vector3d g;
        Eigen::Matrix3d h;
        for (int a = 0; a < 3; ++a) {
            const std::ptrdiff_t p = step[std::size_t(a)];
            g[a] = (f(p) - f(-p)) / (2.0 * edges[a]);
            h(a, a) = (f(p) - 2.0 * f(0) + f(-p)) / (edges[a] * edges[a]);
            for (int b = 0; b < a; ++b) {
                const std::ptrdiff_t q = step[std::size_t(b)];
                h(a, b) = h(b, a) = (f(p + q) - f(p - q) - f(q - p) + f(-p - q)) / (4.0 * edges[a] * edges[b]);
            }
        }
        return largest_curvature(g, h);
    };
    // Vertices share their lattice points: each of these is worked out once.
    const auto lowest = [&](const Eigen::Vector3d& p) { return p.array().floor().cast<std::ptrdiff_t>().matrix().dot(Eigen::Matrix<std::ptrdiff_t, 3, 1>(dx, dy, dz)); };
    const auto corner = [&](int c) { return (c & 1 ? dx : 0) + (c & 2 ? dy : 0) + (c & 4 ? dz : 0); };
    std::vector<std::ptrdiff_t> nodes;
    std::vector<std::uint8_t> wanted(height.size(), 0);
    for (const Eigen::Vector3d& vertex : mesh.vertices)
        for (int c = 0; c < 8; ++c) {
            const std::ptrdiff_t v = lowest(vertex.cwiseQuotient(edges)) + corner(c);
            if (!std::exchange(wanted[std::size_t(v)], 1)) nodes.push_back(v);
        }
    std::vector<float> curvature(height.size());
    parallel_blocks(nodes.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) curvature[std::size_t(nodes[n])] = float(at_node(nodes[n]));
    });

    std::vector<CurvatureSample> samples(mesh.vertices.size());
    for (const auto& t : mesh.triangles) {
        const double area = 0.5 * (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]).norm();
        for (std::uint32_t v : t) samples[v].area += area / 3.0;
    }
    for (std::size_t s = 0; s < samples.size(); ++s) {
        const Eigen::Vector3d p = mesh.vertices[s].cwiseQuotient(edges), t = p - p.array().floor().matrix();
        for (int c = 0; c < 8; ++c) {
            const double w = (c & 1 ? t.x() : 1 - t.x()) * (c & 2 ? t.y() : 1 - t.y()) * (c & 4 ? t.z() : 1 - t.z());
            if (w > 1e-9) samples[s].largest_curvature += w * double(curvature[std::size_t(lowest(p) + corner(c))]);
        }
    }
    return samples;
}

}  // namespace coral::morph
