#include "fluid/poisson.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <variant>

#include "core/parallel.h"
#include "fluid/detail/cosine_planes.h"
#include "fluid/detail/fftw.h"

namespace coral::fluid {

namespace {

using detail::Fftw;
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

constexpr std::size_t planes_per_block = 4;  // even: planes are transformed in pairs
constexpr std::size_t rows_per_block = 4;

/// Transforms of one precision.
template <class Real>
struct Transforms {
    detail::PlanOf<Real> forward, backward, forward_t, backward_t;
    std::unique_ptr<detail::CosinePlanes<Real>> cosine;  ///< when both transforms of a plane are cosine ones
};

}  // namespace

struct Poisson::Impl {
    GridSpec grid;
    Precision precision;
    int t_axis = 2, a_axis = 0, b_axis = 1;  ///< tridiagonal, fastest and second axis of the transformed array
    std::size_t nx = 0, ny = 0, nz = 0, na = 0, nb = 0, nt = 0;
    std::size_t plane_xy = 0, plane_ab = 0;  ///< elements per plane, padded so that every plane starts on a cache line
    Transform a, b, t;
    bool periodic_t = false, singular = false;
    double low_end = 0.0, high_end = 0.0;  ///< added to the diagonal at the two ends
    std::variant<Transforms<double>, Transforms<float>> transforms;

    Impl(const GridSpec& g, Precision p);
    template <class Real>
    void plan();
    template <class Real>
    void solve(FlowField& work, FlowField& scratch) const;
    template <class Real>
    void transform_planes(Real* f, bool forth) const;
    template <class Real>
    void transform_t(Real* f, const detail::PlanOf<Real>& plan) const;
    template <class Real>
    void divide(Real* f) const;
    template <class Real>
    void tridiagonal(Real* f) const;
    template <class Real>
    void tridiagonal_row(Real* f, std::size_t row_b, std::vector<double>& factor) const;
    template <class Real>
    void spread_constant_mode(Real* f) const;
    template <class Real>
    void transpose(const Real* from, Real* to, bool forth) const;
};

Poisson::Impl::Impl(const GridSpec& g, Precision p) : grid(g), precision(p)
{
    t_axis = tridiagonal_axis(g);
    a_axis = t_axis == 0 ? 1 : 0;
    b_axis = t_axis == 2 ? 1 : 2;
    nx = std::size_t(g.cells.x()), ny = std::size_t(g.cells.y()), nz = std::size_t(g.cells.z());
    na = std::size_t(g.cells[a_axis]), nb = std::size_t(g.cells[b_axis]), nt = std::size_t(g.cells[t_axis]);
    plane_xy = (nx * ny + 15) / 16 * 16;
    plane_ab = (na * nb + 15) / 16 * 16;
    a = transform_for(g, a_axis), b = transform_for(g, b_axis), t = transform_for(g, t_axis);
    periodic_t = g.periodic(t_axis);
    low_end = g.outlet(t_axis, 0) ? -1.0 : 1.0;
    high_end = g.outlet(t_axis, 1) ? -1.0 : 1.0;
    singular = std::none_of(g.boundary.begin(), g.boundary.end(),
                            [](const Boundary& side) { return side.kind == BoundaryKind::outlet; });
    in_precision(precision, [&]<class Real>(Real) { plan<Real>(); });
}

template <class Real>
void Poisson::Impl::plan()
{
    using Fft = Fftw<Real>;
    auto& to = transforms.emplace<Transforms<Real>>();
    if (a.forward == FFTW_REDFT10 && b.forward == FFTW_REDFT10) to.cosine = std::make_unique<detail::CosinePlanes<Real>>(na, nb);
    const std::lock_guard lock(planner_mutex());
    FlowField field(plane_ab * (periodic_t ? nt : 1), precision);
    Real* sample = field.data<Real>();
    const int n0 = int(nb), n1 = int(na), n2 = int(nt);
    // ESTIMATE: measured plans may differ from run to run and with them the last bits
    to.forward.plan = Fft::plan_r2r_2d(n0, n1, sample, sample, b.forward, a.forward, FFTW_ESTIMATE);
    to.backward.plan = Fft::plan_r2r_2d(n0, n1, sample, sample, b.backward, a.backward, FFTW_ESTIMATE);
    if (!periodic_t) return;
    const auto along_t = [&](fftw_r2r_kind kind) {
        return Fft::plan_many_r2r(1, &n2, n1, sample, nullptr, int(plane_ab), 1, sample, nullptr, int(plane_ab), 1, &kind,
                                  FFTW_ESTIMATE | FFTW_UNALIGNED);
    };
    to.forward_t.plan = along_t(t.forward);
    to.backward_t.plan = along_t(t.backward);
}

template <class Real>
void Poisson::Impl::transform_planes(Real* f, bool forth) const
{
    const auto& with = std::get<Transforms<Real>>(transforms);
    const auto plan = forth ? with.forward.plan : with.backward.plan;
    parallel_blocks(nt, planes_per_block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; p += with.cosine ? 2 : 1) {
            Real* first = f + p * plane_ab;
            Real* second = p + 1 < end ? first + plane_ab : nullptr;
            if (!with.cosine)
                Fftw<Real>::execute_r2r(plan, first, first);
            else if (forth)
                with.cosine->forward(first, second);
            else
                with.cosine->backward(first, second);
        }
    });
}

template <class Real>
void Poisson::Impl::transform_t(Real* f, const detail::PlanOf<Real>& plan) const
{
    parallel_blocks(nb, rows_per_block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r) Fftw<Real>::execute_r2r(plan.plan, f + r * na, f + r * na);
    });
}

/// All axes transformed: x = b / eigenvalue; the constant mode is set to zero.
template <class Real>
void Poisson::Impl::divide(Real* f) const
{
    const double scale = grid.cell * grid.cell / (a.norm * b.norm * t.norm);
    parallel_blocks(nt, planes_per_block, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            for (std::size_t j = 0; j < nb; ++j) {
                Real* row = f + k * plane_ab + j * na;
                const double bt = b.eigenvalue[j] + t.eigenvalue[k];
                const double first = double(row[0]);
                for (std::size_t i = 0; i < na; ++i) row[i] = Real(double(row[i]) * (scale / (a.eigenvalue[i] + bt)));
                if (j == 0 && k == 0) row[0] = singular ? Real(0) : Real(first * scale / (a.eigenvalue[0] + bt));
            }
    });
}

/// Thomas algorithm for the modes of one row, side by side: x[p-1] + (-2 + la + lb) x[p] + x[p+1] = h2 b[p].
template <class Real>
void Poisson::Impl::tridiagonal_row(Real* f, std::size_t row_b, std::vector<double>& factor) const
{
    const double scale = grid.cell * grid.cell / (a.norm * b.norm);
    const double diagonal = -2.0 + b.eigenvalue[row_b];
    const double* lambda = a.eigenvalue.data();
    for (std::size_t p = 0; p < nt; ++p) {
        Real* row = f + p * plane_ab;
        const double end = diagonal + (p == 0 ? low_end : 0.0) + (p + 1 == nt ? high_end : 0.0);
        double* c = factor.data() + p * na;
        if (p == 0) {
            for (std::size_t i = 0; i < na; ++i) {
                c[i] = 1.0 / (end + lambda[i]);
                row[i] = Real(double(row[i]) * (scale * c[i]));
            }
        } else {
            const double* c_before = c - na;
            const Real* before = row - plane_ab;
            for (std::size_t i = 0; i < na; ++i) {
                c[i] = 1.0 / (end + lambda[i] - c_before[i]);
                row[i] = Real((scale * double(row[i]) - double(before[i])) * c[i]);
            }
        }
    }
    if (singular && row_b == 0)
        f[(nt - 1) * plane_ab] = 0;  // the constant mode: its last pivot is zero; pin its last value
    for (std::size_t p = nt - 1; p-- > 0;) {
        Real* row = f + p * plane_ab;
        const Real* after = row + plane_ab;
        const double* c = factor.data() + p * na;
        for (std::size_t i = 0; i < na; ++i) row[i] = Real(double(row[i]) - c[i] * double(after[i]));
    }
}

/// Takes the mean off the constant mode.
template <class Real>
void Poisson::Impl::spread_constant_mode(Real* f) const
{
    double sum = 0.0;
    for (std::size_t p = 0; p < nt; ++p) sum += double(f[p * plane_ab]);
    for (std::size_t p = 0; p < nt; ++p) f[p * plane_ab] = Real(double(f[p * plane_ab]) - sum / double(nt));
}

template <class Real>
void Poisson::Impl::tridiagonal(Real* f) const
{
    if (singular) spread_constant_mode(f);  // so that pinning does not gather what is left of the sum in one cell
    parallel_blocks(nb, rows_per_block, [&](std::size_t begin, std::size_t end) {
        thread_local std::vector<double> factor;
        factor.resize(na * nt);
        for (std::size_t r = begin; r < end; ++r) tridiagonal_row(f + r * na, r, factor);
    });
    if (singular) spread_constant_mode(f);  // of the solution: zero mean
}

/// Between the array as the caller sees it (x fastest, z slowest) and the one with the tridiagonal axis slowest.
template <class Real>
void Poisson::Impl::transpose(const Real* from, Real* to, bool forth) const
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

template <class Real>
void Poisson::Impl::solve(FlowField& work, FlowField& scratch) const
{
    const bool turned = t_axis != 2;
    if (turned) {
        if (scratch.size() != plane_ab * nt || scratch.precision() != precision) scratch = FlowField(plane_ab * nt, precision);
        transpose(work.data<Real>(), scratch.data<Real>(), true);
    }
    Real* f = turned ? scratch.data<Real>() : work.data<Real>();
    transform_planes(f, true);
    if (periodic_t) {
        const auto& with = std::get<Transforms<Real>>(transforms);
        transform_t(f, with.forward_t);
        divide(f);
        transform_t(f, with.backward_t);
    } else {
        tridiagonal(f);
    }
    transform_planes(f, false);
    if (turned) transpose(scratch.data<Real>(), work.data<Real>(), false);
}

Poisson::Poisson(const GridSpec& grid, Precision precision) : impl_(std::make_unique<Impl>(grid, precision)) {}
Poisson::~Poisson() = default;
std::size_t Poisson::row() const
{
    return impl_->nx;
}
std::size_t Poisson::plane() const
{
    return impl_->plane_xy;
}
FlowField Poisson::make_work() const
{
    return FlowField(impl_->plane_xy * impl_->nz, impl_->precision);
}

void Poisson::solve(FlowField& work, FlowField& scratch) const
{
    in_precision(impl_->precision, [&]<class Real>(Real) { impl_->solve<Real>(work, scratch); });
}

}  // namespace coral::fluid
