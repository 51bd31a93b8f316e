// Kernel weights of the fines: which cells and blocks each particle reaches.
#include "fluid/porous.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "fluid/detail/fines.h"
#include "fluid/detail/lanes.h"

namespace coral::fluid {

using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

using detail::particles_per_chunk;
using detail::planes_per_slab;
using detail::wrap;

using Lanes = Eigen::Array4d;

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
        const auto value = [](int i) { return peskin_kernel(std::sqrt(4.0 * i / entries)); };
        for (int i = 0; i <= entries; ++i) steps_[std::size_t(i)] = {value(i), value(i + 1) - value(i)};
    }
    double operator()(double r_squared) const
    {
        const double position = std::min(r_squared * (entries / 4.0), double(entries));
        const int i = int(position);
        const Step& step = steps_[std::size_t(i)];
        return step.value + (position - i) * step.growth;
    }
    Lanes operator()(const Lanes& r_squared) const
    {
        const Lanes position = (r_squared * (entries / 4.0)).min(double(entries));
        const Eigen::Array4i i = position.cast<int>();
        const Step *a = &steps_[std::size_t(i[0])], *b = &steps_[std::size_t(i[1])], *c = &steps_[std::size_t(i[2])],
                   *d = &steps_[std::size_t(i[3])];
        return Lanes(a->value, b->value, c->value, d->value) +
               (position - i.cast<double>()) * Lanes(a->growth, b->growth, c->growth, d->growth);
    }

private:
    static constexpr int entries = 1024;
    struct Step {
        double value, growth;
    };
    std::array<Step, entries + 1> steps_{};
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
    open_cells_ = layout_.make_field(1.0);
    share_ = layout_.make_field(0.0);
    clip_ = layout_.make_field(1.0);
    clipped_.assign(std::size_t(grid.cells.y()) * std::size_t(grid.cells.z()), 0);
}

std::size_t FineCoupling::stored_weights() const
{
    std::size_t sum = 0;
    for (const auto* chunks : {&volume_, &felt_})
        for (const Weights& w : *chunks)
            for (const Row& row : w.rows) sum += std::size_t(row.length);
    return sum;
}

void FineCoupling::Weights::clear()
{
    rows.clear(), low_plane.clear(), high_plane.clear();
    first_row.assign(1, 0), first_value.assign(1, 0);
    used = 0;
}

/// Room for the weights of a row, not yet set.
double* FineCoupling::Weights::append(const Row& row)
{
    rows.push_back(row);
    const std::size_t first = used;
    used += std::size_t(row.lanes());
    if (used > values.size()) values.resize(2 * used);
    return values.data() + first;
}

/// Largest block that leaves about 1.5 blocks per smallest diameter: the felt averages do not change by it. Blocks divide
/// periodic axes; elsewhere the last one may be cut short by the wall.
void FineCoupling::choose_blocks(std::span<const double> diameters)
{
    constexpr double blocks_per_diameter = 1.4;
    const int before = block_;
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
    const std::ptrdiff_t pitch = blocks_.cells.x() + 3;
    blocks_.stride = {1, pitch, pitch * blocks_.cells.y()};
    blocks_.offset = 0;
    blocks_.total = std::size_t(blocks_.stride[2]) * std::size_t(blocks_.cells.z());
    if (block_ == before && open_blocks_.size() == blocks_.total) return;
    open_blocks_.assign(blocks_.total, 0.0);  // to be found anew
    std::fill(open_cells_.begin(), open_cells_.end(), -1.0);
}

double FineCoupling::cells_in_block(int i, int j, int k) const
{
    const Vector3i first = block_ * Vector3i(i, j, k);
    return double((grid_.cells - first).cwiseMin(Vector3i::Constant(block_)).prod());
}

/// How open cells and blocks are; planes of blocks in which no grain has moved since the last step are left as they are.
void FineCoupling::find_open(const Field* cell_solid)
{
    const int n = grid_.cells.x();
    const auto open_row = [&](int j, int k, auto&& visit) {
        const std::size_t c0 = layout_.index(0, j, k);
        if (cell_solid)
            for (int i = 0; i < n; ++i) visit(i, c0 + std::size_t(i), 1.0 - (*cell_solid)[c0 + std::size_t(i)]);
        else
            for (int i = 0; i < n; ++i) visit(i, c0 + std::size_t(i), 1.0);
    };
    const auto find_plane = [&](int plane) {
        const int k_end = std::min((plane + 1) * block_, grid_.cells.z());
        bool same = true;
        for (int k = plane * block_; k < k_end && same; ++k)
            for (int j = 0; j < grid_.cells.y() && same; ++j) {
                int different = 0;
                open_row(j, k, [&](int, std::size_t c, double open) { different += open_cells_[c] != open; });
                same = different == 0;
            }
        if (same) return;
        const auto first = open_blocks_.begin() + plane * blocks_.stride[2];
        std::fill(first, first + blocks_.stride[2], 0.0);
        for (int k = plane * block_; k < k_end; ++k)
            for (int j = 0; j < grid_.cells.y(); ++j) {
                double* sum = open_blocks_.data() + block_row(j, k);
                open_row(j, k, [&](int i, std::size_t c, double open) {
                    open_cells_[c] = open;
                    sum[i / block_] += open;
                });
            }
        for (int k = plane * block_; k < k_end; ++k)
            for (int j = 0; j < grid_.cells.y(); ++j) {
                const double* sum = open_blocks_.data() + block_row(j, k);
                const std::size_t c0 = layout_.index(0, j, k);
                for (int i = 0; i < n; ++i) {
                    const int b = i / block_;
                    share_[c0 + std::size_t(i)] = sum[b] > 0.0 ? open_cells_[c0 + std::size_t(i)] / sum[b]
                                                               : 1.0 / cells_in_block(b, j / block_, k / block_);
                }
            }
    };
    parallel_blocks(std::size_t(blocks_.cells.z()), planes_per_slab, [&](std::size_t begin, std::size_t end) {
        for (int plane = int(begin); plane < int(end); ++plane) find_plane(plane);
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
    const auto add_run = [&](int first, int length) {
        return weights.append({std::uint32_t(base + first), std::int16_t(first), std::int16_t(j), std::int16_t(k),
                               std::int16_t(length)});
    };
    const auto fill = [&](int position, int first, int length) {  // position: before it is wrapped
        double* values = add_run(first, length);
        const double* openness = open ? open->data() + base + first : nullptr;
        for (int l = 0; l < length; l += 4) {
            const Lanes dx = (position + l + 0.5) * h - x + h * Lanes(0.0, 1.0, 2.0, 3.0);
            Lanes four = kernel_table((scale * (dx * dx + squared)).eval());
            if (openness) four *= Eigen::Map<const Lanes>(openness + l);
            Eigen::Map<Lanes>(values + l) = four;
        }
        for (int l = length; l % 4 != 0; ++l) values[l] = 0.0;
    };
    if (low > high) return;
    if (grid_.periodic(0)) {
        for (int i = low; i <= high;) {
            const int first = wrap(i, n), length = std::min(high - i + 1, n - first);
            fill(i, first, length);
            i += length;
        }
        return;
    }
    if (low >= 0 && high < n) {
        fill(low, low, high - low + 1);
        return;
    }
    const bool wide = high - low + 1 >= n;
    const int first = wide || low < 0 ? 0 : std::min(low, fold(high, n));
    const int last = wide || high >= n ? n - 1 : std::max(high, fold(low, n));
    const int length = last - first + 1;
    double* values = add_run(first, length);
    std::fill(values, weights.values.data() + weights.used, 0.0);
    for (int i = low; i <= high; ++i) values[fold(i, n) - first] += weight(i);
    if (open)
        for (int l = 0; l < length; ++l) values[l] *= (*open)[std::size_t(base + first + l)];
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
    const std::size_t first_row = weights.rows.size(), first_value = weights.used;
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
        double* const values = weights.values.data() + first_value;
        const auto count = std::ptrdiff_t(weights.used - first_value);
        const double sum = detail::lane_sum(count, [&](std::ptrdiff_t v) { return values[v]; });
        if (sum > 1e-6 || !pass) {
            const double factor = 1.0 / sum;
            for (std::ptrdiff_t v = 0; v < count; ++v) values[v] *= factor;
            break;
        }
        weights.rows.resize(first_row);
        weights.used = first_value;
    }
    std::int32_t low = target.cells.z(), high = -1;
    for (std::size_t r = first_row; r < weights.rows.size(); ++r) {
        low = std::min(low, std::int32_t(weights.rows[r].z));
        high = std::max(high, std::int32_t(weights.rows[r].z));
    }
    weights.low_plane.push_back(low);
    weights.high_plane.push_back(high);
    weights.first_row.push_back(weights.rows.size());
    weights.first_value.push_back(weights.used);
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
        weights.clear();
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
    std::vector<std::int32_t> block_of(std::size_t(grid_.cells.x()));
    for (std::size_t i = 0; i < block_of.size(); ++i) block_of[i] = std::int32_t(i) / block_;
    parallel_blocks(volume_.size(), 1, [&](std::size_t chunk, std::size_t) {
        thread_local Field felt;  // zero between particles
        felt.resize(blocks_.total, 0.0);
        const Weights &narrow = volume_[chunk], &wide = felt_[chunk];
        for (std::size_t p = 0; p < narrow.low_plane.size(); ++p) {
            const std::span<const Row> rows(narrow.rows.data() + narrow.first_row[p],
                                            narrow.rows.data() + narrow.first_row[p + 1]);
            int low_y = grid_.cells.y(), high_y = 0;
            for (const Row& row : rows) low_y = std::min(low_y, int(row.y)), high_y = std::max(high_y, int(row.y));
            low_y /= block_, high_y /= block_;
            const int low_z = narrow.low_plane[p] / block_, high_z = narrow.high_plane[p] / block_;
            const auto each_wide = [&](auto&& visit) {
                const double* weight = wide.values.data() + wide.first_value[p];
                for (std::size_t r = wide.first_row[p]; r < wide.first_row[p + 1]; ++r) {
                    const Row& row = wide.rows[r];
                    if (row.z >= low_z && row.z <= high_z && row.y >= low_y && row.y <= high_y)
                        for (std::size_t l = 0; l < std::size_t(row.length); ++l) visit(row.start + l, weight[l]);
                    weight += row.lanes();
                }
            };
            each_wide([&](std::size_t b, double weight) { felt[b] += open_blocks_[b] > 0.0 ? weight : 0.0; });
            double sum = 0.0;
            const double* weight = narrow.values.data() + narrow.first_value[p];
            for (const Row& row : rows) {
                const double* in_row = felt.data() + block_row(row.y, row.z);
                const double* share = share_.data() + row.start;
                const std::int32_t* block = block_of.data() + row.x;
                sum += detail::lane_sum(
                    row.length, [=](std::ptrdiff_t l) { return weight[l] * in_row[block[l]] * share[l]; });
                weight += row.lanes();
            }
            own_overlap_[order_[chunk * particles_per_chunk + p]] = sum;
            each_wide([&](std::size_t b, double) { felt[b] = 0.0; });
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
