// Kernel weights of the fines: which cells and blocks each particle reaches.
#include "fluid/porous.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "fluid/detail/fines.h"

namespace coral::fluid {

using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

using detail::particles_per_chunk;
using detail::planes_per_slab;
using detail::wrap;

/// Cell that a position beyond the walls at 0 and n mirrors to.
int fold(int i, int n)
{
    const int m = wrap(i, 2 * n);
    return m < n ? m : 2 * n - 1 - m;
}

/// peskin_kernel as a function of r squared, linear between 1024 entries: error below 1e-5 of its peak, a third of the
/// cost of its roots.
class KernelTable {
public:
    KernelTable()
    {
        for (int i = 0; i <= entries + 1; ++i) values_[std::size_t(i)] = peskin_kernel(std::sqrt(4.0 * i / entries));
    }
    double operator()(double r_squared) const
    {
        const double position = std::min(r_squared * (entries / 4.0), double(entries));
        const int i = int(position);
        return values_[std::size_t(i)] + (position - i) * (values_[std::size_t(i) + 1] - values_[std::size_t(i)]);
    }

private:
    static constexpr int entries = 1024;
    std::array<double, entries + 2> values_{};
};
const KernelTable kernel_table;

}  // namespace

double peskin_kernel(double r)
{
    const double inner = 0.125 * (3.0 - 2.0 * r + std::sqrt(std::max(1.0 + 4.0 * r - 4.0 * r * r, 0.0)));
    const double outer = 0.125 * (5.0 - 2.0 * r - std::sqrt(std::max(-7.0 + 12.0 * r - 4.0 * r * r, 0.0)));
    return r <= 1.0 ? inner : (r <= 2.0 ? outer : 0.0);
}

double isolation(double felt, double own_solid)
{
    const double others = std::max(1.0 - felt - own_solid, 0.0);
    const double open = 1.0 - others, wide = 1.0 + 2.0 * others;
    return open * open * open * open / (wide * wide);
}

double bulk_void_fraction(double felt, double own_solid)
{
    return felt + own_solid * isolation(felt, own_solid);
}

FineCoupling::FineCoupling(const GridSpec& grid, const KernelOptions& options)
    : grid_(grid), layout_(grid.cells), options_(options)
{
    cells_.cells = grid.cells;
    cells_.cell = grid.cell;
    for (int d = 0; d < 3; ++d) cells_.stride[d] = layout_.stride[d];
    cells_.offset = std::ptrdiff_t(layout_.index(0, 0, 0));
    cells_.total = layout_.total;
    for (int d = 0; d < 3; ++d) {
        const int n = grid.cells[d];
        // half to each face; all to the other one where a face has a given velocity and could not answer
        for (int i = 0; i < n; ++i) {
            const bool low = i >= grid.first_unknown(d), high = i + 1 < grid.last_unknown(d) || grid.periodic(d);
            low_share_[d].push_back(low ? (high ? 0.5 : 1.0) : 0.0);
            high_share_[d].push_back(high ? (low ? 0.5 : 1.0) : 0.0);
        }
    }
    void_fraction_ = layout_.make_field(1.0);
    open_cells_ = layout_.make_field(1.0);
}

std::size_t FineCoupling::stored_weights() const
{
    std::size_t sum = 0;
    for (const auto* chunks : {&volume_, &felt_})
        for (const Weights& w : *chunks) sum += w.values.size();
    return sum;
}

/// Largest block that leaves about 1.5 blocks per smallest diameter: the felt averages do not change by it. Blocks divide
/// periodic axes; elsewhere the last one may be cut short by the wall.
void FineCoupling::choose_blocks(std::span<const double> diameters)
{
    constexpr double blocks_per_diameter = 1.4;
    block_ = std::max(options_.coupling_cells, 1);
    if (options_.coupling_cells <= 0) {
        double smallest = 4.0 * blocks_per_diameter * grid_.cell;  // no more than 4 cells
        for (const double d : diameters) smallest = std::min(smallest, d);
        block_ = std::max(1, int(smallest / (blocks_per_diameter * grid_.cell) + 1e-9));
    }
    const auto divides = [&](int d) { return !grid_.periodic(d) || grid_.cells[d] % block_ == 0; };
    while (block_ > 1 && !(divides(0) && divides(1) && divides(2))) --block_;
    blocks_.cells = (grid_.cells.array() + block_ - 1) / block_;
    blocks_.cell = grid_.cell * block_;
    blocks_.stride = {1, blocks_.cells.x(), std::ptrdiff_t(blocks_.cells.x()) * blocks_.cells.y()};
    blocks_.offset = 0;
    blocks_.total = std::size_t(blocks_.stride[2]) * std::size_t(blocks_.cells.z());
}

double FineCoupling::cells_in_block(int i, int j, int k) const
{
    const Vector3i first = block_ * Vector3i(i, j, k);
    return double((grid_.cells - first).cwiseMin(Vector3i::Constant(block_)).prod());
}

void FineCoupling::find_open(const Field* cell_solid)
{
    open_blocks_.resize(blocks_.total);
    parallel_blocks(std::size_t(blocks_.cells.z()), planes_per_slab, [&](std::size_t begin, std::size_t end) {
        const auto first = open_blocks_.begin() + std::ptrdiff_t(begin) * blocks_.stride[2];
        std::fill(first, open_blocks_.begin() + std::ptrdiff_t(end) * blocks_.stride[2], 0.0);
        for (int k = int(begin) * block_; k < std::min(int(end) * block_, grid_.cells.z()); ++k)
            for (int j = 0; j < grid_.cells.y(); ++j) {
                const std::size_t c0 = layout_.index(0, j, k);
                double* sum = open_blocks_.data() + (k / block_) * blocks_.stride[2] + (j / block_) * blocks_.stride[1];
                for (int i = 0; i < grid_.cells.x(); ++i) {
                    const double open = cell_solid ? 1.0 - (*cell_solid)[c0 + std::size_t(i)] : 1.0;
                    open_cells_[c0 + std::size_t(i)] = open;
                    sum[i / block_] += open;
                }
            }
    });
}

/// Weights of one row of cells, cut or folded at the sides of the domain. `open` null: solid cells count as well.
void FineCoupling::add_row(Weights& weights, const Target& target, const Field* open, double radius, double x,
                           double squared, int j, int k) const
{
    const int n = target.cells.x();
    const double h = target.cell, scale = 4.0 / (radius * radius);
    const double half = std::sqrt(std::max(radius * radius - squared, 0.0));
    const int low = int(std::ceil((x - half) / h - 0.5)), high = int(std::floor((x + half) / h - 0.5));
    const auto weight = [&](int i) {
        const double dx = (i + 0.5) * h - x;
        return kernel_table(scale * (dx * dx + squared));
    };
    const std::ptrdiff_t base = target.offset + j * target.stride[1] + k * target.stride[2];
    const auto add_run = [&](int first, int length) {  // appends zeros; returns where they start
        weights.rows.push_back({std::uint32_t(base + first), k, length});
        weights.values.resize(weights.values.size() + std::size_t(length), 0.0);
        return weights.values.data() + weights.values.size() - length;
    };
    const auto shut = [&](double* values, int first, int length) {
        if (open)
            for (int l = 0; l < length; ++l) values[l] *= (*open)[std::size_t(base + first + l)];
    };
    if (low > high) return;
    if (grid_.periodic(0)) {
        for (int i = low; i <= high;) {
            const int first = wrap(i, n), length = std::min(high - i + 1, n - first);
            double* values = add_run(first, length);
            for (int l = 0; l < length; ++l) values[l] = weight(i + l);
            shut(values, first, length);
            i += length;
        }
        return;
    }
    if (low >= 0 && high < n) {
        const int length = high - low + 1;
        double* values = add_run(low, length);
        for (int l = 0; l < length; ++l) values[l] = weight(low + l);
        shut(values, low, length);
        return;
    }
    const bool wide = high - low + 1 >= n;
    const int first = wide || low < 0 ? 0 : std::min(low, fold(high, n));
    const int last = wide || high >= n ? n - 1 : std::max(high, fold(low, n));
    double* values = add_run(first, last - first + 1);
    for (int i = low; i <= high; ++i) values[fold(i, n) - first] += weight(i);
    shut(values, first, last - first + 1);
}

void FineCoupling::add_particle(Weights& weights, const Target& target, const Field& open, double radius,
                                const Vector3d& position) const
{
    const Vector3d size = grid_.size();
    Vector3d x = position - grid_.origin;
    for (int d = 0; d < 3; ++d) {
        if (grid_.periodic(d))
            x[d] -= size[d] * std::floor(x[d] / size[d]);
        else
            x[d] = std::clamp(x[d], 0.0, size[d]);
    }
    const double h = target.cell;
    const auto target_cell = [&](int i, int d) {
        return grid_.periodic(d) ? wrap(i, target.cells[d]) : fold(i, target.cells[d]);
    };
    const std::size_t first_row = weights.rows.size(), first_value = weights.values.size();
    for (const Field* pass :
         {&open, static_cast<const Field*>(nullptr)}) {  // the second when every cell around is solid
        for (int k = int(std::ceil((x.z() - radius) / h - 0.5)); k <= int(std::floor((x.z() + radius) / h - 0.5));
             ++k) {
            const double dz = (k + 0.5) * h - x.z(), reach = std::sqrt(std::max(radius * radius - dz * dz, 0.0));
            for (int j = int(std::ceil((x.y() - reach) / h - 0.5)); j <= int(std::floor((x.y() + reach) / h - 0.5));
                 ++j) {
                const double dy = (j + 0.5) * h - x.y();
                add_row(weights, target, pass, radius, x.x(), dy * dy + dz * dz, target_cell(j, 1), target_cell(k, 2));
            }
        }
        double sum = 0.0;
        for (std::size_t v = first_value; v < weights.values.size(); ++v) sum += weights.values[v];
        if (sum > 1e-6 || !pass) {
            for (std::size_t v = first_value; v < weights.values.size(); ++v) weights.values[v] /= sum;
            break;
        }
        weights.rows.resize(first_row);
        weights.values.resize(first_value);
    }
    std::int32_t low = target.cells.z(), high = -1;
    for (std::size_t r = first_row; r < weights.rows.size(); ++r) {
        low = std::min(low, weights.rows[r].plane);
        high = std::max(high, weights.rows[r].plane);
    }
    weights.low_plane.push_back(low);
    weights.high_plane.push_back(high);
    weights.first_row.push_back(weights.rows.size());
    weights.first_value.push_back(weights.values.size());
}

/// Radius of the volume kernel [m].
double FineCoupling::support_radius(double diameter) const
{
    return 0.5 * std::max(options_.volume_support * diameter, options_.smallest_support * grid_.cell);
}

void FineCoupling::find_weights(std::vector<Weights>& chunks, const Target& target, const Field& open, double factor,
                                std::span<const Vector3d> positions, std::span<const double> diameters) const
{
    chunks.resize((positions.size() + particles_per_chunk - 1) / particles_per_chunk);
    parallel_blocks(positions.size(), particles_per_chunk, [&](std::size_t begin, std::size_t end) {
        Weights& weights = chunks[begin / particles_per_chunk];
        weights.rows.clear(), weights.values.clear(), weights.low_plane.clear(), weights.high_plane.clear();
        weights.first_row.assign(1, 0), weights.first_value.assign(1, 0);
        for (std::size_t o = begin; o < end; ++o) {
            const std::size_t p = order_[o];
            add_particle(weights, target, open, factor * support_radius(diameters[p]), positions[p]);
        }
    });
}

void FineCoupling::find_own_overlap()
{
    own_overlap_.assign(count_, 0.0);
    if (options_.self_disturbance == SelfDisturbance::kept) return;
    parallel_blocks(volume_.size(), 1, [&](std::size_t chunk, std::size_t) {
        thread_local Field felt;  // zero between particles
        felt.resize(blocks_.total, 0.0);
        const Weights &narrow = volume_[chunk], &wide = felt_[chunk];
        for (std::size_t p = 0; p < narrow.low_plane.size(); ++p) {
            const auto each_wide = [&](auto&& visit) {
                const double* weight = wide.values.data() + wide.first_value[p];
                for (std::size_t r = wide.first_row[p]; r < wide.first_row[p + 1]; ++r) {
                    const Row& row = wide.rows[r];
                    if (row.plane >= narrow.low_plane[p] / block_ && row.plane <= narrow.high_plane[p] / block_)
                        for (int l = 0; l < row.length; ++l) visit(felt[row.start + std::size_t(l)], weight[l]);
                    weight += row.length;
                }
            };
            each_wide([](double& at, double weight) { at += weight; });
            double sum = 0.0;
            const double* weight = narrow.values.data() + narrow.first_value[p];
            for (std::size_t r = narrow.first_row[p]; r < narrow.first_row[p + 1]; ++r) {
                const Row& row = narrow.rows[r];
                const std::ptrdiff_t in_plane = std::ptrdiff_t(row.start) - cells_.offset - row.plane * cells_.stride[2];
                const std::ptrdiff_t j = in_plane / cells_.stride[1], i = in_plane - j * cells_.stride[1];
                const std::ptrdiff_t b0 = (row.plane / block_) * blocks_.stride[2] + (j / block_) * blocks_.stride[1];
                for (int l = 0; l < row.length; ++l) {
                    const auto b = std::size_t(b0 + (i + l) / block_);
                    const double open = open_blocks_[b];
                    if (open > 0.0) sum += weight[l] * felt[b] * open_cells_[row.start + std::size_t(l)] / open;
                }
                weight += row.length;
            }
            own_overlap_[order_[chunk * particles_per_chunk + p]] = sum;
            each_wide([](double& at, double) { at = 0.0; });
        }
    });
}

/// Neighbours in space become neighbours in memory: through layers of four cells, columns of four cells, then along x.
void FineCoupling::sort_particles(std::span<const Vector3d> positions)
{
    std::vector<std::array<double, 3>> key(positions.size());
    for (std::size_t p = 0; p < positions.size(); ++p) {
        const Vector3d x = (positions[p] - grid_.origin) / grid_.cell;
        key[p] = {std::floor(x.z() / 4.0), std::floor(x.y() / 4.0), x.x()};
    }
    order_.resize(positions.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::sort(order_.begin(), order_.end(),
              [&](std::size_t a, std::size_t b) { return std::pair(key[a], a) < std::pair(key[b], b); });
}

void FineCoupling::place(std::span<const Vector3d> positions, std::span<const double> diameters,
                         const Field* cell_solid)
{
    count_ = positions.size();
    sort_particles(positions);
    choose_blocks(diameters);
    find_open(cell_solid);
    find_weights(volume_, cells_, open_cells_, 1.0, positions, diameters);
    const double wide = options_.felt_support / options_.volume_support;
    find_weights(felt_, blocks_, open_blocks_, wide, positions, diameters);
    radius_.resize(count_);
    for (std::size_t p = 0; p < count_; ++p) radius_[p] = wide * support_radius(diameters[p]);
    find_own_overlap();
}

}  // namespace coral::fluid
