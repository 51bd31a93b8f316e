#include "fluid/poisson.h"

#include <fftw3.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

#include "core/parallel.h"
#include "fluid/detail/cosine_planes.h"

namespace coral::fluid {

namespace {

using detail::planner_mutex;

/// What diagonalises the second difference along one axis.
struct Transform {
    fftw_r2r_kind forward = FFTW_REDFT10, backward = FFTW_REDFT01;
    double norm = 1.0;               ///< forward then backward multiplies by this
    std::vector<double> eigenvalue;  ///< of h2 d2/dx2, <= 0
};

Transform transform_for(const GridSpec& grid, int axis)
{
    const int n = grid.cells[axis];
    const bool low = grid.outlet(axis, 0), high = grid.outlet(axis, 1);
    Transform t;
    t.norm = 2.0 * n;
    double shift = 0.0, denominator = 2.0 * n;
    if (grid.periodic(axis)) {
        t.forward = FFTW_R2HC;
        t.backward = FFTW_HC2R;
        t.norm = n;
        denominator = n;
    } else if (low && high) {
        t.forward = FFTW_RODFT10;
        t.backward = FFTW_RODFT01;
        shift = 1.0;
    } else if (low || high) {
        t.forward = t.backward = low ? FFTW_RODFT11 : FFTW_REDFT11;
        shift = 0.5;
    }
    for (int k = 0; k < n; ++k) {
        const double s = std::sin(std::numbers::pi * (k + shift) / denominator);
        t.eigenvalue.push_back(-4.0 * s * s);
    }
    return t;
}

int tridiagonal_axis(const GridSpec& grid)
{
    for (int axis : {2, 1, 0})
        if (grid.outlet(axis, 0) || grid.outlet(axis, 1)) return axis;
    for (int axis : {2, 1, 0})
        if (!grid.periodic(axis)) return axis;
    return 2;
}

struct Plan {
    fftw_plan plan = nullptr;
    Plan() = default;
    Plan(const Plan&) = delete;
    Plan& operator=(const Plan&) = delete;
    ~Plan()
    {
        const std::lock_guard lock(planner_mutex());
        if (plan) fftw_destroy_plan(plan);
    }
};

constexpr std::size_t planes_per_block = 4;  // even: planes are transformed in pairs
constexpr std::size_t rows_per_block = 4;

}  // namespace

struct Poisson::Impl {
    GridSpec grid;
    int t_axis = 2, a_axis = 0, b_axis = 1;  ///< tridiagonal, fastest and second axis of the transformed array
    std::size_t nx = 0, ny = 0, nz = 0, na = 0, nb = 0, nt = 0;
    std::size_t plane_xy = 0, plane_ab = 0;  ///< elements per plane, padded so that every plane starts on a cache line
    Transform a, b, t;
    bool periodic_t = false, singular = false;
    double low_end = 0.0, high_end = 0.0;  ///< added to the diagonal at the two ends
    Plan forward, backward, forward_t, backward_t;
    std::unique_ptr<detail::CosinePlanes> cosine;  ///< when both transforms are cosine ones

    explicit Impl(const GridSpec& g);
    void transform_planes(Field& f, bool forth) const;
    void transform_t(Field& f, const Plan& plan) const;
    void divide(Field& f) const;
    void tridiagonal(Field& f) const;
    void tridiagonal_row(double* f, std::size_t row_b, std::vector<double>& factor) const;
    void transpose(const Field& from, Field& to, bool forth) const;
};

Poisson::Impl::Impl(const GridSpec& g) : grid(g)
{
    t_axis = tridiagonal_axis(g);
    a_axis = t_axis == 0 ? 1 : 0;
    b_axis = t_axis == 2 ? 1 : 2;
    nx = std::size_t(g.cells.x()), ny = std::size_t(g.cells.y()), nz = std::size_t(g.cells.z());
    na = std::size_t(g.cells[a_axis]), nb = std::size_t(g.cells[b_axis]), nt = std::size_t(g.cells[t_axis]);
    plane_xy = (nx * ny + 7) / 8 * 8;
    plane_ab = (na * nb + 7) / 8 * 8;
    a = transform_for(g, a_axis), b = transform_for(g, b_axis), t = transform_for(g, t_axis);
    periodic_t = g.periodic(t_axis);
    low_end = g.outlet(t_axis, 0) ? -1.0 : 1.0;
    high_end = g.outlet(t_axis, 1) ? -1.0 : 1.0;
    singular = std::none_of(g.boundary.begin(), g.boundary.end(),
                            [](const Boundary& side) { return side.kind == BoundaryKind::outlet; });
    if (a.forward == FFTW_REDFT10 && b.forward == FFTW_REDFT10) cosine = std::make_unique<detail::CosinePlanes>(na, nb);
    const std::lock_guard lock(planner_mutex());
    Field sample(plane_ab * (periodic_t ? nt : 1));
    const int n0 = int(nb), n1 = int(na), n2 = int(nt);
    // ESTIMATE: measured plans may differ from run to run and with them the last bits
    forward.plan = fftw_plan_r2r_2d(n0, n1, sample.data(), sample.data(), b.forward, a.forward, FFTW_ESTIMATE);
    backward.plan = fftw_plan_r2r_2d(n0, n1, sample.data(), sample.data(), b.backward, a.backward, FFTW_ESTIMATE);
    if (!periodic_t) return;
    const auto along_t = [&](fftw_r2r_kind kind) {
        return fftw_plan_many_r2r(1, &n2, n1, sample.data(), nullptr, int(plane_ab), 1, sample.data(), nullptr,
                                  int(plane_ab), 1, &kind, FFTW_ESTIMATE | FFTW_UNALIGNED);
    };
    forward_t.plan = along_t(t.forward);
    backward_t.plan = along_t(t.backward);
}

void Poisson::Impl::transform_planes(Field& f, bool forth) const
{
    const fftw_plan plan = forth ? forward.plan : backward.plan;
    parallel_blocks(nt, planes_per_block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; p += cosine ? 2 : 1) {
            double* first = f.data() + p * plane_ab;
            double* second = p + 1 < end ? first + plane_ab : nullptr;
            if (!cosine)
                fftw_execute_r2r(plan, first, first);
            else if (forth)
                cosine->forward(first, second);
            else
                cosine->backward(first, second);
        }
    });
}

void Poisson::Impl::transform_t(Field& f, const Plan& plan) const
{
    parallel_blocks(nb, rows_per_block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r) fftw_execute_r2r(plan.plan, f.data() + r * na, f.data() + r * na);
    });
}

/// All axes transformed: x = b / eigenvalue; the constant mode is set to zero.
void Poisson::Impl::divide(Field& f) const
{
    const double scale = grid.cell * grid.cell / (a.norm * b.norm * t.norm);
    parallel_blocks(nt, planes_per_block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            for (std::size_t j = 0; j < nb; ++j) {
                double* row = f.data() + k * plane_ab + j * na;
                const double bt = b.eigenvalue[j] + t.eigenvalue[k];
                const double first = row[0];
                for (std::size_t i = 0; i < na; ++i) row[i] *= scale / (a.eigenvalue[i] + bt);
                if (j == 0 && k == 0) row[0] = singular ? 0.0 : first * scale / (a.eigenvalue[0] + bt);
            }
    });
}

/// Thomas algorithm for the modes of one row, side by side: x[p-1] + (-2 + la + lb) x[p] + x[p+1] = h2 b[p].
void Poisson::Impl::tridiagonal_row(double* f, std::size_t row_b, std::vector<double>& factor) const
{
    const double scale = grid.cell * grid.cell / (a.norm * b.norm);
    const double diagonal = -2.0 + b.eigenvalue[row_b];
    const double* lambda = a.eigenvalue.data();
    for (std::size_t p = 0; p < nt; ++p) {
        double* row = f + p * plane_ab;
        const double end = diagonal + (p == 0 ? low_end : 0.0) + (p + 1 == nt ? high_end : 0.0);
        double* c = factor.data() + p * na;
        if (p == 0) {
            for (std::size_t i = 0; i < na; ++i) {
                c[i] = 1.0 / (end + lambda[i]);
                row[i] *= scale * c[i];
            }
        } else {
            const double* c_before = c - na;
            const double* before = row - plane_ab;
            for (std::size_t i = 0; i < na; ++i) {
                c[i] = 1.0 / (end + lambda[i] - c_before[i]);
                row[i] = (scale * row[i] - before[i]) * c[i];
            }
        }
    }
    if (singular && row_b == 0)
        f[(nt - 1) * plane_ab] = 0.0;  // the constant mode: its last pivot is zero; pin its last value
    for (std::size_t p = nt - 1; p-- > 0;) {
        double* row = f + p * plane_ab;
        const double* after = row + plane_ab;
        const double* c = factor.data() + p * na;
        for (std::size_t i = 0; i < na; ++i) row[i] -= c[i] * after[i];
    }
}

void Poisson::Impl::tridiagonal(Field& f) const
{
    if (singular) {  // spread what is left of the sum, so that pinning does not gather it in one cell
        double sum = 0.0;
        for (std::size_t p = 0; p < nt; ++p) sum += f[p * plane_ab];
        for (std::size_t p = 0; p < nt; ++p) f[p * plane_ab] -= sum / double(nt);
    }
    parallel_blocks(nb, rows_per_block, [&](std::size_t begin, std::size_t end) {
        thread_local std::vector<double> factor;
        factor.resize(na * nt);
        for (std::size_t r = begin; r < end; ++r) tridiagonal_row(f.data() + r * na, r, factor);
    });
    if (singular) {  // the constant mode of the solution: zero mean
        double sum = 0.0;
        for (std::size_t p = 0; p < nt; ++p) sum += f[p * plane_ab];
        for (std::size_t p = 0; p < nt; ++p) f[p * plane_ab] -= sum / double(nt);
    }
}

/// Between the array as the caller sees it (x fastest, z slowest) and the one with the tridiagonal axis slowest.
void Poisson::Impl::transpose(const Field& from, Field& to, bool forth) const
{
    std::size_t stride[3];
    stride[a_axis] = 1, stride[b_axis] = na, stride[t_axis] = plane_ab;
    parallel_blocks(nz, planes_per_block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            for (std::size_t j = 0; j < ny; ++j) {
                const std::size_t outside = k * plane_xy + j * nx, inside = k * stride[2] + j * stride[1];
                for (std::size_t i = 0; i < nx; ++i) {
                    if (forth)
                        to[inside + i * stride[0]] = from[outside + i];
                    else
                        to[outside + i] = from[inside + i * stride[0]];
                }
            }
    });
}

Poisson::Poisson(const GridSpec& grid) : impl_(std::make_unique<Impl>(grid)) {}
Poisson::~Poisson() = default;
std::size_t Poisson::row() const
{
    return impl_->nx;
}
std::size_t Poisson::plane() const
{
    return impl_->plane_xy;
}
Field Poisson::make_work() const
{
    return Field(impl_->plane_xy * impl_->nz, 0.0);
}

void Poisson::solve(Field& work, Field& scratch) const
{
    const Impl& s = *impl_;
    const bool turned = s.t_axis != 2;
    if (turned) {
        scratch.resize(s.plane_ab * s.nt);
        s.transpose(work, scratch, true);
    }
    Field& f = turned ? scratch : work;
    s.transform_planes(f, true);
    if (s.periodic_t) {
        s.transform_t(f, s.forward_t);
        s.divide(f);
        s.transform_t(f, s.backward_t);
    } else {
        s.tridiagonal(f);
    }
    s.transform_planes(f, false);
    if (turned) s.transpose(scratch, work, false);
}

}  // namespace coral::fluid
