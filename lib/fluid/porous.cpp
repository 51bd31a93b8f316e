// Fields of the fines: scatter to the flow, gather from it.
#include "fluid/porous.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/stopwatch.h"
#include "fluid/detail/fines.h"
#include "fluid/detail/lanes.h"

namespace coral::fluid {

using Eigen::Vector3d;
using Eigen::Vector3i;
using Eigen::Vector4d;

namespace {

using detail::particles_per_chunk;
using detail::planes_per_slab;
using detail::wrap;

using Lanes = Eigen::Array4d;

Eigen::Map<const Lanes> lanes_at(const double* p)
{
    return Eigen::Map<const Lanes>(p);
}

Lanes lanes_at(const float* p)
{
    return Eigen::Map<const Eigen::Array4f>(p).cast<double>();
}

}  // namespace

/// fields[v][c] += w_ic value(i)[v] for all particles: each slab of planes takes its rows from all particles in order, so
/// that no two threads meet and the order of additions does not depend on their number.
template <class Value>
void FineCoupling::scatter(const std::vector<Weights>& chunks, const Target& target, std::span<Field, 4> fields,
                           const Value& value) const
{
    for (Field& field : fields) field.resize(target.total);
    const auto first_cell = [&](std::size_t plane) {
        return std::ptrdiff_t(target.offset) + std::ptrdiff_t(plane) * target.stride[2];
    };
    parallel_blocks(std::size_t(target.cells.z()), planes_per_slab, [&](std::size_t begin, std::size_t end) {
        const std::ptrdiff_t last =
            end == std::size_t(target.cells.z()) ? std::ptrdiff_t(target.total) : first_cell(end);
        for (Field& field : fields) std::fill(field.begin() + first_cell(begin), field.begin() + last, 0.0);
        for (std::size_t chunk = 0; chunk < chunks.size(); ++chunk) {
            const Weights& w = chunks[chunk];
            for (std::size_t p = 0; p < w.low_plane.size(); ++p) {
                if (w.high_plane[p] < int(begin) || w.low_plane[p] >= int(end)) continue;
                const Vector4d amount = value(order_[chunk * particles_per_chunk + p]);
                const double* weight = w.values.data() + w.first_value[p];
                for (std::size_t r = w.first_row[p]; r < w.first_row[p + 1]; ++r) {
                    const Row& row = w.rows[r];
                    if (row.z >= int(begin) && row.z < int(end))
                        for (int l = 0; l < row.length; l += 4)
                            for (std::size_t v = 0; v < 4; ++v)
                                Eigen::Map<Lanes>(fields[v].data() + row.start + l) +=
                                    amount[Eigen::Index(v)] * lanes_at(weight + l);
                    weight += row.lanes();
                }
            }
        }
    });
}

/// sums[i][v] = sum_c w_ic fields[v][c].
template <std::size_t count>
void FineCoupling::gather(const std::vector<Weights>& chunks, std::span<const Field, count> fields,
                          std::vector<Eigen::Matrix<double, int(count), 1>>& sums) const
{
    sums.resize(count_);
    parallel_blocks(chunks.size(), 1, [&](std::size_t chunk, std::size_t) {
        const Weights& w = chunks[chunk];
        const double* value[count];
        for (std::size_t v = 0; v < count; ++v) value[v] = fields[v].data();
        for (std::size_t p = 0; p < w.low_plane.size(); ++p) {
            Lanes sum[count];
            for (Lanes& lanes : sum) lanes.setZero();
            const double* weight = w.values.data() + w.first_value[p];
            for (std::size_t r = w.first_row[p]; r < w.first_row[p + 1]; ++r) {
                const Row& row = w.rows[r];
                for (int l = 0; l < row.length; l += 4) {
                    const Lanes here = lanes_at(weight + l);
                    for (std::size_t v = 0; v < count; ++v) sum[v] += here * lanes_at(value[v] + row.start + l);
                }
                weight += row.lanes();
            }
            auto& total = sums[order_[chunk * particles_per_chunk + p]];
            for (std::size_t v = 0; v < count; ++v) total[Eigen::Index(v)] = sum[v].sum();
        }
    });
}

/// Per block the mean over its cells, weighted by how open they are (all alike in a block that is solid throughout).
/// fill(j, k, rows) gives the values of a row of cells, rows[v][i].
template <std::size_t count, class Fill>
void FineCoupling::average_blocks(std::span<Field, count> averages, const Fill& fill) const
{
    for (Field& field : averages) field.resize(blocks_.total);
    const auto n = std::ptrdiff_t(grid_.cells.x());
    parallel_blocks(std::size_t(blocks_.cells.z()), planes_per_slab, [&](std::size_t begin, std::size_t end) {
        for (Field& field : averages)
            std::fill(field.begin() + std::ptrdiff_t(begin) * blocks_.stride[2],
                      field.begin() + std::ptrdiff_t(end) * blocks_.stride[2], 0.0);
        thread_local std::vector<double> buffer;
        buffer.resize(count * std::size_t(n));
        double* rows[count];
        for (std::size_t v = 0; v < count; ++v) rows[v] = buffer.data() + std::ptrdiff_t(v) * n;
        for (int k = int(begin) * block_; k < std::min(int(end) * block_, grid_.cells.z()); ++k)
            for (int j = 0; j < grid_.cells.y(); ++j) {
                fill(j, k, rows);
                const double* share = share_.data() + layout_.index(0, j, k);
                for (std::size_t v = 0; v < count; ++v) {
                    double* __restrict sum = averages[v].data() + block_row(j, k);
                    const double* row = rows[v];
                    if (block_ == 1) {
                        for (std::ptrdiff_t i = 0; i < n; ++i) sum[i] += share[i] * row[i];
                    } else if (block_ == 2) {
                        for (std::ptrdiff_t b = 0; b < n / 2; ++b)
                            sum[b] += share[2 * b] * row[2 * b] + share[2 * b + 1] * row[2 * b + 1];
                        if (n % 2 != 0) sum[n / 2] += share[n - 1] * row[n - 1];
                    } else {
                        for (std::ptrdiff_t i = 0, b = 0; i < n; ++b)
                            for (const std::ptrdiff_t last = std::min(i + block_, n); i < last; ++i)
                                sum[b] += share[i] * row[i];
                    }
                }
            }
    });
}

void FineCoupling::deposit_volume(Flow& flow, std::span<const double> volumes, std::span<const Vector3d> velocities)
{
    const Stopwatch watch(flow.times().fines);
    const double inverse = 1.0 / grid_.cell_volume();
    scatter(volume_, cells_, std::span<Field, 4>(cell_fields_), [&](std::size_t p) {
        const double v = volumes[p] * inverse;
        return Vector4d(v, v * velocities[p].x(), v * velocities[p].y(), v * velocities[p].z());
    });
    own_solid_.resize(count_);
    for (std::size_t p = 0; p < count_; ++p) own_solid_[p] = own_overlap_[p] * volumes[p] * inverse;
    PorousFields& fields = flow.porous_fields_for_writing();
    if (void_fraction_.empty()) void_fraction_ = FlowField(layout_.total, flow.options().precision, 1.0);
    in_precision(flow.options().precision, [&]<class Real>(Real) {
        find_void_fraction<Real>();
        Real* flux[3];
        for (std::size_t d = 0; d < 3; ++d) flux[d] = fields.solid_flux[d].data<Real>();
        parallel_blocks(std::size_t(grid_.cells.z()) + 1, planes_per_slab, [&](std::size_t begin, std::size_t end) {
            for (int k = int(begin); k < int(end); ++k)
                for (int d = 0; d < 3; ++d)
                    if (k < grid_.cells.z() || d == 2) deposit_flux(d, k, flux[d]);
        });
    });
    flow.change_void_fraction(void_fraction_);
}

/// Void fraction, and where it stops at the smallest allowed the part of the solid that counts.
template <class Real>
void FineCoupling::find_void_fraction()
{
    const double most = 1.0 - options_.smallest_void_fraction;
    const std::ptrdiff_t n = grid_.cells.x();
    parallel_blocks(std::size_t(grid_.cells.z()), planes_per_slab, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            for (int j = 0; j < grid_.cells.y(); ++j) {
                const std::size_t c0 = layout_.index(0, j, int(k));
                const double* solid = cell_fields_[0].data() + c0;
                Real* __restrict open = void_fraction_.data<Real>() + c0;
                for (std::ptrdiff_t i = 0; i < n; ++i) open[i] = Real(1.0 - std::min(solid[i], most));
                char& clipped = clipped_[k * std::size_t(grid_.cells.y()) + std::size_t(j)];
                const bool clips = detail::lane_max(n, [&](std::ptrdiff_t i) { return solid[i]; }) > most;
                if (clips || clipped != 0)
                    for (std::ptrdiff_t i = 0; i < n; ++i)
                        clip_[c0 + std::size_t(i)] = solid[i] > most ? most / solid[i] : 1.0;
                clipped = char(clips);
            }
    });
    any_clipped_ = std::any_of(clipped_.begin(), clipped_.end(), [](char c) { return c != 0; });
}

/// Solid flux on plane k of the faces of one component: mean of the two cells; none through walls and inlets, that of the
/// cell through outlets.
template <class Real>
void FineCoupling::deposit_flux(int d, int k, Real* flux) const
{
    const Vector3i faces = grid_.cells + Vector3i::Unit(d);
    const int n = grid_.cells[d];
    const std::ptrdiff_t s = layout_.stride[d];
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
    const double* q = cell_fields_[std::size_t(d) + 1].data();
    for (int j = 0; j < faces.y(); ++j) {
        const auto f0 = std::ptrdiff_t(layout_.index(0, j, k));
        std::ptrdiff_t low = f0, high = f0;
        Real* __restrict J = flux + f0;
        if (d == 0) {
            for (int i = 1; i < n; ++i) J[i] = Real(0.5 * (q[f0 + i - 1] + q[f0 + i]));
            for (int i : {0, n}) {
                const double weight = sides(i, f0 + i, low, high);
                J[i] = Real(weight * (q[low] + q[high]));
            }
        } else {
            const double weight = sides(d == 1 ? j : k, f0, low, high);
            for (int i = 0; i < faces.x(); ++i) J[i] = Real(weight * (q[low + i] + q[high + i]));
        }
    }
}

/// Kernel mean of the centred pressure gradient, which is the mean of the two face gradients that the flow uses.
template <class Real>
void FineCoupling::gather_pressure_gradient(const Flow& flow, std::span<FeltFlow> felt) const
{
    const Real* p = flow.pressure().data<Real>();
    const std::ptrdiff_t sy = layout_.stride[1], sz = layout_.stride[2];
    parallel_blocks(volume_.size(), 1, [&](std::size_t chunk, std::size_t) {
        const Weights& w = volume_[chunk];
        for (std::size_t particle = 0; particle < w.low_plane.size(); ++particle) {
            const double* weight = w.values.data() + w.first_value[particle];
            Lanes gx = Lanes::Zero(), gy = Lanes::Zero(), gz = Lanes::Zero();
            for (std::size_t r = w.first_row[particle]; r < w.first_row[particle + 1]; ++r) {
                const Row& row = w.rows[r];
                for (int l = 0; l < row.length; l += 4) {
                    const Real* at = p + row.start + l;
                    Lanes here = lanes_at(weight + l);
                    if (any_clipped_) here *= lanes_at(clip_.data() + row.start + l);
                    gx += here * (lanes_at(at + 1) - lanes_at(at - 1));
                    gy += here * (lanes_at(at + sy) - lanes_at(at - sy));
                    gz += here * (lanes_at(at + sz) - lanes_at(at - sz));
                }
                weight += row.lanes();
            }
            felt[order_[chunk * particles_per_chunk + particle]].pressure_gradient =
                0.5 / grid_.cell * Vector3d(gx.sum(), gy.sum(), gz.sum());
        }
    });
}

void FineCoupling::feel(const Flow& flow, std::span<FeltFlow> felt) const
{
    in_precision(flow.options().precision, [&]<class Real>(Real) {
        gather_pressure_gradient<Real>(flow, felt);
        average_felt<Real>(flow, felt);
    });
}

template <class Real>
void FineCoupling::average_felt(const Flow& flow, std::span<FeltFlow> felt) const
{
    const int n = grid_.cells.x();
    const auto fill_flow = [&](int j, int k, double* const* rows) {
        const std::size_t c0 = layout_.index(0, j, k);
        const Real* eps = flow.porous_fields().void_fraction.data<Real>() + c0;
        std::copy(eps, eps + n, rows[0]);
        for (int d = 0; d < 3; ++d) {
            const Real *low = flow.velocity(d).data<Real>() + c0, *high = low + layout_.stride[d];
            double* __restrict row = rows[d + 1];
            for (int i = 0; i < n; ++i) row[i] = 0.5 * double(eps[i]) * (double(low[i]) + double(high[i]));
        }
    };
    const auto put = [&](std::size_t i, const auto& sums) {
        FeltFlow& f = felt[i];
        f.void_fraction = bulk_void_fraction(sums[0], own_solid_[i]);
        f.velocity = sums.template segment<3>(1) / sums[0];
        f.own_solid = own_solid_[i];
        f.support_radius = radius_[i];
    };
    if (options_.self_disturbance != SelfDisturbance::removed) {
        average_blocks(std::span<Field, 4>(block_fields_.data(), 4), fill_flow);
        gather(felt_, std::span<const Field, 4>(block_fields_.data(), 4), plain_sums_);
        for (std::size_t i = 0; i < count_; ++i) {
            put(i, plain_sums_[i]);
            felt[i].isolation = 0.0;
            felt[i].wide_pressure_gradient = felt[i].pressure_gradient;
        }
        return;
    }
    average_blocks(std::span<Field, 7>(block_fields_), [&](int j, int k, double* const* rows) {
        fill_flow(j, k, rows);
        const Real* at = flow.pressure().data<Real>() + layout_.index(0, j, k);
        const double scale = 0.5 / grid_.cell;
        for (int d = 0; d < 3; ++d) {
            const std::ptrdiff_t s = layout_.stride[d];
            double* __restrict row = rows[d + 4];
            for (int i = 0; i < n; ++i) row[i] = scale * (double(at[i + s]) - double(at[i - s]));
        }
    });
    gather(felt_, std::span<const Field, 7>(block_fields_), felt_sums_);
    for (std::size_t i = 0; i < count_; ++i) {
        put(i, felt_sums_[i]);
        felt[i].isolation = isolation(felt_sums_[i][0], own_solid_[i]);
        felt[i].wide_pressure_gradient = felt_sums_[i].tail<3>();
    }
}

/// Values of the cells of a row: what each takes of its block.
void FineCoupling::cell_row(const Field& blocks, int j, int k, double* __restrict row) const
{
    const double* share = share_.data() + layout_.index(0, j, k);
    const double* block = blocks.data() + block_row(j, k);
    const int n = grid_.cells.x();
    if (block_ == 2) {
        for (int b = 0; b < n / 2; ++b) {
            row[2 * b] = share[2 * b] * block[b];
            row[2 * b + 1] = share[2 * b + 1] * block[b];
        }
        if (n % 2 != 0) row[n - 1] = share[n - 1] * block[n / 2];
        return;
    }
    for (int i = 0, b = 0; i < n; ++b)
        for (const int last = std::min(i + block_, n); i < last; ++i) row[i] = share[i] * block[b];
}

void FineCoupling::deposit_drag(Flow& flow, std::span<const double> coefficients, std::span<const Vector3d> forces)
{
    const Stopwatch watch(flow.times().fines);
    const double scale = 1.0 / (flow.options().density * grid_.cell_volume());
    const std::span<Field, 4> blocks(block_fields_.data(), 4);
    scatter(felt_, blocks_, blocks, [&](std::size_t p) {
        return Vector4d(scale * Vector4d(coefficients[p], forces[p].x(), forces[p].y(), forces[p].z()));
    });
    in_precision(flow.options().precision,
                 [&]<class Real>(Real) { spread_drag<Real>(flow.porous_fields_for_writing()); });
}

/// From blocks to the faces of their cells.
template <class Real>
void FineCoupling::spread_drag(PorousFields& fields) const
{
    const std::span<const Field, 4> blocks(block_fields_.data(), 4);
    const Vector3i n = grid_.cells;
    const auto half_outside = [&](int d, int f) {
        return (f == 0 && grid_.outlet(d, 0)) || (f == n[d] && grid_.outlet(d, 1)) ? 2.0 : 1.0;
    };
    using Rows = std::array<std::vector<double>, 4>;  // coefficient and force of a row of cells
    // faces of plane k need the cells of planes k - 1 and k
    parallel_blocks(std::size_t(n.z()) + 1, planes_per_slab, [&](std::size_t begin, std::size_t end) {
        Rows here, below, behind;
        for (Rows* rows : {&here, &below, &behind})
            for (std::vector<double>& row : *rows) row.resize(std::size_t(n.x()));
        const auto load = [&](int j, int k, Rows& rows) {
            const bool outside =
                (!grid_.periodic(1) && (j < 0 || j >= n.y())) || (!grid_.periodic(2) && (k < 0 || k >= n.z()));
            for (std::size_t v = 0; v < 4; ++v) {
                if (outside)
                    std::fill(rows[v].begin(), rows[v].end(), 0.0);
                else
                    cell_row(blocks[v], wrap(j, n.y()), wrap(k, n.z()), rows[v].data());
            }
        };
        const auto share = [&](const std::vector<double>& shares, int i, int d) {
            if (grid_.periodic(d)) i = wrap(i, n[d]);
            return i >= 0 && i < n[d] ? shares[std::size_t(i)] : 0.0;
        };
        const auto mix = [](Real* __restrict to, int count, double low, double high, const std::vector<double>& before,
                            const std::vector<double>& after) {
            for (int i = 0; i < count; ++i) to[i] = Real(low * before[std::size_t(i)] + high * after[std::size_t(i)]);
        };
        const auto put = [&](std::size_t d, std::size_t f0, double low, double high, const Rows& before,
                             const Rows& after) {
            mix(fields.drag_rate[d].data<Real>() + f0, n.x(), low, high, before[0], after[0]);
            mix(fields.drag_force[d].data<Real>() + f0, n.x(), low, high, before[d + 1], after[d + 1]);
        };
        const auto put_along = [&](Real* __restrict to, const std::vector<double>& row) {
            const double *low = high_share_[0].data(), *high = low_share_[0].data(), *value = row.data();
            for (int i = 1; i < n.x(); ++i) to[i] = Real(low[i - 1] * value[i - 1] + high[i] * value[i]);
            for (int i : {0, n.x()}) {
                const double half_x = half_outside(0, i);
                to[i] = Real(half_x * share(high_share_[0], i - 1, 0) * value[wrap(i - 1, n.x())] +
                             half_x * share(low_share_[0], i, 0) * value[wrap(i, n.x())]);
            }
        };
        for (int k = int(begin); k < int(end); ++k) {
            load(-1, k, below);
            for (int j = 0; j <= n.y(); ++j) {
                load(j, k, here);
                const std::size_t f0 = layout_.index(0, j, k);
                const double half_y = half_outside(1, j), half_z = half_outside(2, k);
                if (j < n.y()) {
                    load(j, k - 1, behind);
                    put(2, f0, half_z * share(high_share_[2], k - 1, 2), half_z * share(low_share_[2], k, 2), behind,
                        here);
                }
                if (k < n.z())
                    put(1, f0, half_y * share(high_share_[1], j - 1, 1), half_y * share(low_share_[1], j, 1), below,
                        here);
                if (j < n.y() && k < n.z()) {
                    put_along(fields.drag_rate[0].data<Real>() + f0, here[0]);
                    put_along(fields.drag_force[0].data<Real>() + f0, here[1]);
                }
                std::swap(here, below);
            }
        }
    });
}

/// Per block the mean of u* - u^n.
template <class Real>
void FineCoupling::average_change(const Flow& flow) const
{
    const Real *u[3], *us[3];
    for (int d = 0; d < 3; ++d) u[d] = flow.velocity(d).data<Real>(), us[d] = flow.provisional(d).data<Real>();
    // the transpose of deposit_drag: each cell sees its faces with the shares it gave them
    average_blocks(std::span<Field, 3>(block_fields_.data(), 3), [&](int j, int k, double* const* rows) {
        const auto c0 = std::ptrdiff_t(layout_.index(0, j, k));
        const int n = grid_.cells.x(), position[3] = {0, j, k};
        const double *low_x = low_share_[0].data(), *high_x = high_share_[0].data();
        const auto change = [&](int d, std::ptrdiff_t f) { return double(us[d][f]) - double(u[d][f]); };
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
    });
}

void FineCoupling::drag_lag(const Flow& flow, std::span<const double> coefficients, std::span<Vector3d> lag) const
{
    in_precision(flow.options().precision, [&]<class Real>(Real) { average_change<Real>(flow); });
    gather(felt_, std::span<const Field, 3>(block_fields_.data(), 3), lag_sums_);
    for (std::size_t i = 0; i < count_; ++i) lag[i] = coefficients[i] * lag_sums_[i];
}

}  // namespace coral::fluid
