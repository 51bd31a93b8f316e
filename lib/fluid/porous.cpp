// Fields of the fines: scatter to the flow, gather from it.
#include "fluid/porous.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/stopwatch.h"
#include "fluid/detail/fines.h"

namespace coral::fluid {

using Eigen::Vector3d;
using Eigen::Vector3i;
using Eigen::Vector4d;

namespace {

using detail::particles_per_chunk;
using detail::planes_per_slab;
using detail::wrap;

Vector4d quad(const Field& quads, std::size_t at)
{
    return Eigen::Map<const Vector4d>(quads.data() + 4 * at);
}

}  // namespace

/// quads[c] += w_ic value(i) for all particles: each slab of planes takes its rows from all particles in order, so that
/// no two threads meet and the order of additions does not depend on their number.
template <class Value>
void FineCoupling::scatter(const std::vector<Weights>& chunks, const Target& target, Quads& quads,
                           const Value& value) const
{
    quads.resize(4 * target.total);
    const auto first_cell = [&](std::size_t plane) {
        return std::size_t(target.offset) + plane * std::size_t(target.stride[2]);
    };
    parallel_blocks(std::size_t(target.cells.z()), planes_per_slab, [&](std::size_t begin, std::size_t end) {
        const std::size_t last = end == std::size_t(target.cells.z()) ? target.total : first_cell(end);
        std::fill(quads.begin() + std::ptrdiff_t(4 * first_cell(begin)), quads.begin() + std::ptrdiff_t(4 * last), 0.0);
        for (std::size_t chunk = 0; chunk < chunks.size(); ++chunk) {
            const Weights& w = chunks[chunk];
            for (std::size_t p = 0; p < w.low_plane.size(); ++p) {
                if (w.high_plane[p] < int(begin) || w.low_plane[p] >= int(end)) continue;
                const Vector4d amount = value(order_[chunk * particles_per_chunk + p]);
                const double* weight = w.values.data() + w.first_value[p];
                for (std::size_t r = w.first_row[p]; r < w.first_row[p + 1]; ++r) {
                    const Row& row = w.rows[r];
                    if (row.plane >= int(begin) && row.plane < int(end)) {
                        double* at = quads.data() + 4 * std::size_t(row.start);
                        for (int l = 0; l < row.length; ++l) Eigen::Map<Vector4d>(at + 4 * l) += weight[l] * amount;
                    }
                    weight += row.length;
                }
            }
        }
    });
}

/// sums[i] = sum_c w_ic value(c).
template <class Value>
void FineCoupling::gather(const std::vector<Weights>& chunks, const Value& value, std::span<Vector4d> sums) const
{
    parallel_blocks(chunks.size(), 1, [&](std::size_t chunk, std::size_t) {
        const Weights& w = chunks[chunk];
        for (std::size_t p = 0; p < w.low_plane.size(); ++p) {
            Vector4d sum = Vector4d::Zero();
            const double* weight = w.values.data() + w.first_value[p];
            for (std::size_t r = w.first_row[p]; r < w.first_row[p + 1]; ++r) {
                const Row& row = w.rows[r];
                for (int l = 0; l < row.length; ++l) sum += weight[l] * value(std::size_t(row.start) + std::size_t(l));
                weight += row.length;
            }
            sums[order_[chunk * particles_per_chunk + p]] = sum;
        }
    });
}

/// Per block the mean over its cells of four values, weighted by how open the cells are (all alike in a block that is
/// solid throughout). fill(j, k, rows) gives the values of a row of cells, rows[v][i].
template <class Fill>
void FineCoupling::average_blocks(Quads& quads, const Fill& fill) const
{
    quads.resize(4 * blocks_.total);
    const auto n = std::size_t(grid_.cells.x());
    parallel_blocks(std::size_t(blocks_.cells.z()), planes_per_slab, [&](std::size_t begin, std::size_t end) {
        std::fill(quads.begin() + 4 * std::ptrdiff_t(begin) * blocks_.stride[2],
                  quads.begin() + 4 * std::ptrdiff_t(end) * blocks_.stride[2], 0.0);
        thread_local std::vector<double> buffer;
        buffer.resize(4 * n);
        double* const rows[4] = {buffer.data(), buffer.data() + n, buffer.data() + 2 * n, buffer.data() + 3 * n};
        for (int k = int(begin) * block_; k < std::min(int(end) * block_, grid_.cells.z()); ++k)
            for (int j = 0; j < grid_.cells.y(); ++j) {
                fill(j, k, rows);
                const double* open_cells = open_cells_.data() + layout_.index(0, j, k);
                const auto b0 = std::size_t((k / block_) * blocks_.stride[2] + (j / block_) * blocks_.stride[1]);
                for (int i = 0, b = 0; i < grid_.cells.x(); ++b) {
                    const double open = open_blocks_[b0 + std::size_t(b)];
                    Vector4d sum = Vector4d::Zero();
                    for (const int last = std::min(i + block_, grid_.cells.x()); i < last; ++i)
                        sum += (open > 0.0 ? open_cells[i] : 1.0) *
                               Vector4d(rows[0][i], rows[1][i], rows[2][i], rows[3][i]);
                    Eigen::Map<Vector4d>(quads.data() + 4 * (b0 + std::size_t(b))) +=
                        sum / (open > 0.0 ? open : cells_in_block(b, j / block_, k / block_));
                }
            }
    });
}

void FineCoupling::deposit_volume(Flow& flow, std::span<const double> volumes, std::span<const Vector3d> velocities)
{
    const Stopwatch watch(flow.times().fines);
    const double inverse = 1.0 / grid_.cell_volume();
    scatter(volume_, cells_, cell_quads_, [&](std::size_t p) {
        const double v = volumes[p] * inverse;
        return Vector4d(v, v * velocities[p].x(), v * velocities[p].y(), v * velocities[p].z());
    });
    own_solid_.resize(count_);
    for (std::size_t p = 0; p < count_; ++p) own_solid_[p] = own_overlap_[p] * volumes[p] * inverse;
    PorousFields& fields = flow.porous_fields_for_writing();
    const double most = 1.0 - options_.smallest_void_fraction;
    std::vector<char> clipped(std::size_t(grid_.cells.z()), 0);
    parallel_blocks(std::size_t(grid_.cells.z()), planes_per_slab, [&](std::size_t begin, std::size_t end) {
        for (int k = int(begin); k < int(end); ++k)
            for (int j = 0; j < grid_.cells.y(); ++j) {
                const std::size_t c0 = layout_.index(0, j, k);
                for (std::size_t c = c0; c < c0 + std::size_t(grid_.cells.x()); ++c) {
                    const double solid = cell_quads_[4 * c];
                    void_fraction_[c] = 1.0 - std::min(solid, most);
                    if (solid > most) clipped[std::size_t(k)] = 1;
                }
            }
    });
    clip_.clear();
    if (std::any_of(clipped.begin(), clipped.end(), [](char c) { return c != 0; })) {
        clip_ = layout_.make_field(1.0);
        for (std::size_t c = 0; c < clip_.size(); ++c)
            if (cell_quads_[4 * c] > most) clip_[c] = most / cell_quads_[4 * c];
    }
    for (int d = 0; d < 3; ++d) deposit_flux(d, fields.solid_flux[d]);
    flow.change_void_fraction(void_fraction_);
}

/// Solid flux on the faces of one component: mean of the two cells; none through walls and inlets, that of the cell
/// through outlets.
void FineCoupling::deposit_flux(int d, Field& flux) const
{
    const Vector3i faces = grid_.cells + Vector3i::Unit(d);
    const int n = grid_.cells[d];
    const std::ptrdiff_t s = layout_.stride[d];
    parallel_blocks(std::size_t(faces.z()), planes_per_slab, [&](std::size_t begin, std::size_t end) {
        // values of the cells below and above a face at `position`, and the weight of each
        const auto sides = [&](int position, std::ptrdiff_t f, std::ptrdiff_t& low, std::ptrdiff_t& high) {
            low = f - s, high = f;
            if (position > 0 && position < n) return 0.5;
            if (grid_.periodic(d)) {
                if (position == 0) low = f + (n - 1) * s;
                if (position == n) high = f - n * s;
                return 0.5;
            }
            if (position == 0) low = high;
            if (position == n) high = low;
            return grid_.outlet(d, position == 0 ? 0 : 1) ? 0.5 : 0.0;
        };
        const double* q = cell_quads_.data() + 1 + d;
        for (int k = int(begin); k < int(end); ++k)
            for (int j = 0; j < faces.y(); ++j) {
                const auto f0 = std::ptrdiff_t(layout_.index(0, j, k));
                std::ptrdiff_t low = f0, high = f0;
                double* J = flux.data() + f0;
                if (d == 0) {
                    for (int i = 1; i < n; ++i) J[i] = 0.5 * (q[4 * (f0 + i - 1)] + q[4 * (f0 + i)]);
                    for (int i : {0, n}) {
                        const double weight = sides(i, f0 + i, low, high);
                        J[i] = weight * (q[4 * low] + q[4 * high]);
                    }
                } else {
                    const double weight = sides(d == 1 ? j : k, f0, low, high);
                    for (int i = 0; i < faces.x(); ++i) J[i] = weight * (q[4 * (low + i)] + q[4 * (high + i)]);
                }
            }
    });
}

/// Kernel mean of the centred pressure gradient, which is the mean of the two face gradients that the flow uses.
void FineCoupling::gather_pressure_gradient(const Flow& flow, std::span<FeltFlow> felt) const
{
    const double* p = flow.pressure().data();
    const std::ptrdiff_t sy = layout_.stride[1], sz = layout_.stride[2];
    parallel_blocks(volume_.size(), 1, [&](std::size_t chunk, std::size_t) {
        const Weights& w = volume_[chunk];
        std::vector<double> clipped;
        for (std::size_t particle = 0; particle < w.low_plane.size(); ++particle) {
            const double* weight = w.values.data() + w.first_value[particle];
            double gx = 0.0, gy = 0.0, gz = 0.0;
            for (std::size_t r = w.first_row[particle]; r < w.first_row[particle + 1]; ++r) {
                const Row& row = w.rows[r];
                const double* at = p + row.start;
                const double* values = weight;
                if (!clip_.empty()) {
                    clipped.assign(weight, weight + row.length);
                    for (int l = 0; l < row.length; ++l) clipped[std::size_t(l)] *= clip_[row.start + std::size_t(l)];
                    values = clipped.data();
                }
#pragma omp simd reduction(+ : gx, gy, gz)
                for (int l = 0; l < row.length; ++l) {
                    gx += values[l] * (at[l + 1] - at[l - 1]);
                    gy += values[l] * (at[l + sy] - at[l - sy]);
                    gz += values[l] * (at[l + sz] - at[l - sz]);
                }
                weight += row.length;
            }
            felt[order_[chunk * particles_per_chunk + particle]].pressure_gradient =
                0.5 / grid_.cell * Vector3d(gx, gy, gz);
        }
    });
}

void FineCoupling::feel(const Flow& flow, std::span<FeltFlow> felt) const
{
    gather_pressure_gradient(flow, felt);
    const double* u[3] = {flow.velocity(0).data(), flow.velocity(1).data(), flow.velocity(2).data()};
    const double* eps = flow.porous_fields().void_fraction.data();
    average_blocks(block_quads_, [&](int j, int k, double* const* rows) {
        const std::size_t c0 = layout_.index(0, j, k);
        const int n = grid_.cells.x();
        for (int i = 0; i < n; ++i) rows[0][i] = eps[c0 + std::size_t(i)];
        for (int d = 0; d < 3; ++d) {
            const double *low = u[d] + c0, *high = low + layout_.stride[d];
            for (int i = 0; i < n; ++i) rows[d + 1][i] = 0.5 * rows[0][i] * (low[i] + high[i]);
        }
    });
    sums_.resize(count_);
    gather(
        felt_, [&](std::size_t b) { return quad(block_quads_, b); }, sums_);
    const bool removed = options_.self_disturbance == SelfDisturbance::removed;
    for (std::size_t i = 0; i < count_; ++i) {
        FeltFlow& f = felt[i];
        f.void_fraction = bulk_void_fraction(sums_[i][0], own_solid_[i]);
        f.velocity = sums_[i].tail<3>() / sums_[i][0];
        f.isolation = removed ? isolation(sums_[i][0], own_solid_[i]) : 0.0;
        f.own_solid = own_solid_[i];
        f.support_radius = radius_[i];
        f.wide_pressure_gradient = f.pressure_gradient;
    }
    if (removed) gather_wide_pressure_gradient(flow, felt);
}

void FineCoupling::gather_wide_pressure_gradient(const Flow& flow, std::span<FeltFlow> felt) const
{
    const double* p = flow.pressure().data();
    average_blocks(block_quads_, [&](int j, int k, double* const* rows) {
        const double* at = p + layout_.index(0, j, k);
        const int n = grid_.cells.x();
        const double scale = 0.5 / grid_.cell;
        for (int d = 0; d < 3; ++d) {
            const std::ptrdiff_t s = layout_.stride[d];
            for (int i = 0; i < n; ++i) rows[d][i] = scale * (at[i + s] - at[i - s]);
        }
        std::fill(rows[3], rows[3] + n, 0.0);
    });
    gather(
        felt_, [&](std::size_t b) { return quad(block_quads_, b); }, sums_);
    for (std::size_t i = 0; i < count_; ++i) felt[i].wide_pressure_gradient = sums_[i].head<3>();
}

/// Four values of each cell of a row, from those of the blocks divided by how open the cells are.
void FineCoupling::cell_row(const Quads& block_values, int j, int k, double* row) const
{
    const std::size_t c0 = layout_.index(0, j, k);
    const auto b0 = std::size_t((k / block_) * blocks_.stride[2] + (j / block_) * blocks_.stride[1]);
    for (int i = 0, b = 0; i < grid_.cells.x(); ++b) {
        const double open = open_blocks_[b0 + std::size_t(b)];
        const Vector4d per_open = quad(block_values, b0 + std::size_t(b)) / (open > 0.0 ? open : cells_in_block(b, j / block_, k / block_));
        for (const int last = std::min(i + block_, grid_.cells.x()); i < last; ++i)
            Eigen::Map<Vector4d>(row + 4 * i) = (open > 0.0 ? open_cells_[c0 + std::size_t(i)] : 1.0) * per_open;
    }
}

void FineCoupling::deposit_drag(Flow& flow, std::span<const double> coefficients, std::span<const Vector3d> forces)
{
    const Stopwatch watch(flow.times().fines);
    const double scale = 1.0 / (flow.options().density * grid_.cell_volume());
    scatter(felt_, blocks_, block_quads_, [&](std::size_t p) {
        return Vector4d(scale * Vector4d(coefficients[p], forces[p].x(), forces[p].y(), forces[p].z()));
    });
    PorousFields& fields = flow.porous_fields_for_writing();
    const Vector3i n = grid_.cells;
    const auto half_outside = [&](int d, int f) {
        return (f == 0 && grid_.outlet(d, 0)) || (f == n[d] && grid_.outlet(d, 1)) ? 2.0 : 1.0;
    };
    // faces of plane k need the cells of planes k - 1 and k
    parallel_blocks(std::size_t(n.z()) + 1, planes_per_slab, [&](std::size_t begin, std::size_t end) {
        const std::size_t row_size = 4 * std::size_t(n.x());
        std::vector<double> here(row_size), below(row_size), behind(row_size);
        const auto load = [&](int j, int k, std::vector<double>& row) {
            const bool outside =
                (!grid_.periodic(1) && (j < 0 || j >= n.y())) || (!grid_.periodic(2) && (k < 0 || k >= n.z()));
            if (outside)
                std::fill(row.begin(), row.end(), 0.0);
            else
                cell_row(block_quads_, wrap(j, n.y()), wrap(k, n.z()), row.data());
        };
        const auto share = [&](const std::vector<double>& shares, int i, int d) {
            if (grid_.periodic(d)) i = wrap(i, n[d]);
            return i >= 0 && i < n[d] ? shares[std::size_t(i)] : 0.0;
        };
        const auto put = [&](int d, std::size_t f0, int count, double low, double high,
                             const std::vector<double>& before, const std::vector<double>& after) {
            for (int i = 0; i < count; ++i) {
                fields.drag_rate[d][f0 + std::size_t(i)] =
                    low * before[4 * std::size_t(i)] + high * after[4 * std::size_t(i)];
                fields.drag_force[d][f0 + std::size_t(i)] = low * before[4 * std::size_t(i) + 1 + std::size_t(d)] +
                                                            high * after[4 * std::size_t(i) + 1 + std::size_t(d)];
            }
        };
        for (int k = int(begin); k < int(end); ++k) {
            load(-1, k, below);
            for (int j = 0; j <= n.y(); ++j) {
                load(j, k, here);
                load(j, k - 1, behind);
                const std::size_t f0 = layout_.index(0, j, k);
                const double half_y = half_outside(1, j), half_z = half_outside(2, k);
                if (j < n.y())
                    put(2, f0, n.x(), half_z * share(high_share_[2], k - 1, 2), half_z * share(low_share_[2], k, 2),
                        behind, here);
                if (k < n.z())
                    put(1, f0, n.x(), half_y * share(high_share_[1], j - 1, 1), half_y * share(low_share_[1], j, 1),
                        below, here);
                if (j < n.y() && k < n.z())
                    for (int i = 1; i < n.x(); ++i) {
                        const double low = high_share_[0][std::size_t(i) - 1], high = low_share_[0][std::size_t(i)];
                        const double *before = here.data() + 4 * (i - 1), *after = before + 4;
                        fields.drag_rate[0][f0 + std::size_t(i)] = low * before[0] + high * after[0];
                        fields.drag_force[0][f0 + std::size_t(i)] = low * before[1] + high * after[1];
                    }
                if (j < n.y() && k < n.z())
                    for (int i : {0, n.x()}) {
                        const double half_x = half_outside(0, i);
                        const double low = half_x * share(high_share_[0], i - 1, 0),
                                     high = half_x * share(low_share_[0], i, 0);
                        const std::size_t before = 4 * std::size_t(wrap(i - 1, n.x())),
                                          after = 4 * std::size_t(wrap(i, n.x()));
                        fields.drag_rate[0][f0 + std::size_t(i)] = low * here[before] + high * here[after];
                        fields.drag_force[0][f0 + std::size_t(i)] = low * here[before + 1] + high * here[after + 1];
                    }
                std::swap(here, below);
            }
        }
    });
}

void FineCoupling::drag_lag(const Flow& flow, std::span<const double> coefficients, std::span<Vector3d> lag) const
{
    const double* u[3] = {flow.velocity(0).data(), flow.velocity(1).data(), flow.velocity(2).data()};
    const double* us[3] = {flow.provisional(0).data(), flow.provisional(1).data(), flow.provisional(2).data()};
    // the transpose of deposit_drag: each cell sees its faces with the shares it gave them
    average_blocks(block_quads_, [&](int j, int k, double* const* rows) {
        const auto c0 = std::ptrdiff_t(layout_.index(0, j, k));
        const int n = grid_.cells.x(), position[3] = {0, j, k};
        const double *low_x = low_share_[0].data(), *high_x = high_share_[0].data();
        const auto change = [&](int d, std::ptrdiff_t f) { return us[d][f] - u[d][f]; };
        for (int i = 0; i + 1 < n; ++i) rows[0][i] = low_x[i] * change(0, c0 + i) + high_x[i] * change(0, c0 + i + 1);
        // u* has no periodic copy at the far side yet
        rows[0][n - 1] =
            low_x[n - 1] * change(0, c0 + n - 1) + high_x[n - 1] * change(0, grid_.periodic(0) ? c0 : c0 + n);
        for (int d = 1; d < 3; ++d) {
            const auto m = std::size_t(position[d]);
            const std::ptrdiff_t s = layout_.stride[d];
            const std::ptrdiff_t up = grid_.periodic(d) && position[d] + 1 == grid_.cells[d] ? -position[d] * s : s;
            const double low = low_share_[d][m], high = high_share_[d][m];
            for (int i = 0; i < n; ++i) rows[d][i] = low * change(d, c0 + i) + high * change(d, c0 + i + up);
        }
        std::fill(rows[3], rows[3] + n, 0.0);
    });
    sums_.resize(count_);
    gather(
        felt_, [&](std::size_t b) { return quad(block_quads_, b); }, sums_);
    for (std::size_t i = 0; i < count_; ++i) lag[i] = coefficients[i] * sums_[i].head<3>();
}

}  // namespace coral::fluid
