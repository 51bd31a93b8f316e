#include "fluid/detail/cosine_planes.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "fluid/detail/fftw.h"
#include "fluid/grid.h"

namespace coral::fluid::detail {

std::mutex& planner_mutex()
{
    static std::mutex mutex;
    return mutex;
}

namespace {

template <class Real>
struct Complex {
    Real re = 0, im = 0;
};

template <class Real>
inline Complex<Real> operator+(Complex<Real> a, Complex<Real> b)
{
    return {a.re + b.re, a.im + b.im};
}
template <class Real>
inline Complex<Real> operator-(Complex<Real> a, Complex<Real> b)
{
    return {a.re - b.re, a.im - b.im};
}
template <class Real>
inline Complex<Real> operator*(Complex<Real> a, Complex<Real> b)
{
    return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
template <class Real>
inline Complex<Real> conj(Complex<Real> a)
{
    return {a.re, -a.im};
}
template <class Real>
inline Complex<Real> times_i(Complex<Real> a)
{
    return {-a.im, a.re};
}

/// Order and twiddles of one direction: sample s of the real sequence is entry place[s] of the complex one.
template <class Real>
struct Direction {
    std::vector<std::size_t> place;
    std::vector<Real> twiddle_re, twiddle_im;  ///< exp(-i pi k / 2n)
    explicit Direction(std::size_t n)
    {
        for (std::size_t s = 0; s < n; ++s) {
            place.push_back(s % 2 == 0 ? s / 2 : n - 1 - s / 2);
            const double angle = std::numbers::pi * double(s) / (2.0 * double(n));
            twiddle_re.push_back(Real(std::cos(angle)));
            twiddle_im.push_back(Real(-std::sin(angle)));
        }
    }
    Complex<Real> twiddle(std::size_t k) const { return {twiddle_re[k], twiddle_im[k]}; }
};

/// C(k) = w V(k) + w* V(n-k), C(n-k) = i (w V(k) - w* V(n-k)): holds for two real sequences packed as one, because it
/// is linear.
template <class Real>
inline void to_cosine(Complex<Real> w, Complex<Real>& low, Complex<Real>& high)
{
    const Complex<Real> p = w * low, q = conj(w) * high;
    low = p + q;
    high = times_i(p - q);
}

/// V(k) = w* (C(k) - i C(n-k)), V(n-k) = w (C(k) + i C(n-k)).
template <class Real>
inline void from_cosine(Complex<Real> w, Complex<Real>& low, Complex<Real>& high)
{
    const Complex<Real> turned = times_i(high);
    high = w * (low + turned);
    low = conj(w) * (low - turned);
}

/// Real and imaginary parts of a row in arrays of their own, the first once more behind the last.
template <class Real>
void part(const Complex<Real>* __restrict row, std::size_t n, Real* __restrict re, Real* __restrict im)
{
    for (std::size_t k = 0; k < n; ++k) re[k] = row[k].re, im[k] = row[k].im;
    re[n] = re[0], im[n] = im[0];
}

/// to_cosine along a parted row: x + i y = scale (w V(k) + w* V(n-k)), the same formula for all k.
template <class Real>
void row_to_cosine(const Direction<Real>& d, std::size_t n, Real scale, const Real* __restrict re, const Real* __restrict im,
                   Real* __restrict x, Real* __restrict y)
{
    const Real *wr = d.twiddle_re.data(), *wi = d.twiddle_im.data();
    for (std::size_t k = 0; k < n; ++k) {
        const Real ar = re[k], ai = im[k], br = re[n - k], bi = im[n - k];
        x[k] = scale * (wr[k] * (ar + br) - wi[k] * (ai - bi));
        y[k] = scale * (wr[k] * (ai + bi) + wi[k] * (ar - br));
    }
}

/// from_cosine along a row: V(k) = w* (C(k) - i C(n-k)) for C = x + i y, the same formula for all k but the first.
template <class Real>
void row_from_cosine(const Direction<Real>& d, std::size_t n, const Real* __restrict x, const Real* __restrict y,
                     Complex<Real>* __restrict row)
{
    const Real *wr = d.twiddle_re.data(), *wi = d.twiddle_im.data();
    row[0] = {x[0], y[0]};
    for (std::size_t k = 1; k < n; ++k) {
        const Real re = x[k] + y[n - k], im = y[k] - x[n - k];
        row[k] = {wr[k] * re + wi[k] * im, wr[k] * im - wi[k] * re};
    }
}

}  // namespace

template <class Real>
struct CosinePlanes<Real>::Impl {
    using Number = Complex<Real>;
    using Buffer = std::vector<Number, CacheAligned<Number>>;
    using Fft = Fftw<Real>;
    std::size_t na, nb;
    Direction<Real> a, b;
    /// Rows from one array to another, columns in place: planned as one, without measuring, they take up to twice as long.
    struct PlanePlan {
        PlanOf<Real> rows, columns;
    };
    PlanePlan forth, back;

    Impl(std::size_t na_, std::size_t nb_) : na(na_), nb(nb_), a(na_), b(nb_)
    {
        const Buffers sample = buffers();
        const std::lock_guard lock(planner_mutex());
        plan(forth, sample, FFTW_FORWARD);
        plan(back, sample, FFTW_BACKWARD);
    }
    struct Buffers {
        Buffer *in, *out;
    };
    Buffers buffers() const
    {
        thread_local Buffer in, out;
        in.resize(na * nb), out.resize(na * nb);
        return {&in, &out};
    }
    static typename Fft::Complex* raw(Buffer& buffer) { return reinterpret_cast<typename Fft::Complex*>(buffer.data()); }
    void plan(PlanePlan& to, const Buffers& of, int sign) const
    {
        const int m = int(na), n = int(nb);
        to.rows.plan = Fft::plan_many_dft(1, &m, n, raw(*of.in), nullptr, 1, m, raw(*of.out), nullptr, 1, m, sign, FFTW_ESTIMATE);
        to.columns.plan = Fft::plan_many_dft(1, &n, m, raw(*of.out), nullptr, m, 1, raw(*of.out), nullptr, m, 1, sign, FFTW_ESTIMATE);
    }
    static void transform(const PlanePlan& with, const Buffers& of)
    {
        Fft::execute_dft(with.rows.plan, raw(*of.in), raw(*of.out));
        Fft::execute_dft(with.columns.plan, raw(*of.out), raw(*of.out));
    }
};

template <class Real>
CosinePlanes<Real>::CosinePlanes(std::size_t na, std::size_t nb) : impl_(std::make_unique<Impl>(na, nb)) {}
template <class Real>
CosinePlanes<Real>::~CosinePlanes() = default;

template <class Real>
void CosinePlanes<Real>::forward(Real* first, Real* second) const
{
    using Number = Complex<Real>;
    const std::size_t na = impl_->na, nb = impl_->nb;
    const auto buffers = impl_->buffers();
    for (std::size_t j = 0; j < nb; ++j) {
        Number* row = buffers.in->data() + impl_->b.place[j] * na;
        const Real *x = first + j * na, *y = second ? second + j * na : nullptr;
        for (std::size_t i = 0; i < na; ++i) row[impl_->a.place[i]] = {x[i], y ? y[i] : Real(0)};
    }
    Impl::transform(impl_->forth, buffers);
    auto& buffer = *buffers.out;
    for (std::size_t k = 1; k <= nb / 2; ++k) {
        const Number w = impl_->b.twiddle(k);
        Number *low = buffer.data() + k * na, *high = buffer.data() + (nb - k) * na;
        if (low == high)  // the middle row is its own partner
            for (std::size_t i = 0; i < na; ++i) low[i] = w * low[i] + conj(w) * low[i];
        else
            for (std::size_t i = 0; i < na; ++i) to_cosine(w, low[i], high[i]);
    }
    // parted a row ahead: what has just been written cannot be read backwards without waiting
    thread_local std::vector<Real> parts, unused;
    parts.resize(4 * (na + 1)), unused.resize(na);
    const auto re = [&](std::size_t j) { return parts.data() + 2 * (j % 2) * (na + 1); };
    part(buffer.data(), na, re(0), re(0) + na + 1);
    for (std::size_t j = 0; j < nb; ++j) {
        if (j + 1 < nb) part(buffer.data() + (j + 1) * na, na, re(j + 1), re(j + 1) + na + 1);
        const Real scale = j == 0 ? Real(2) : Real(1);  // row 0 has no partner: C(0) = 2 V(0)
        row_to_cosine(impl_->a, na, scale, re(j), re(j) + na + 1, first + j * na, second ? second + j * na : unused.data());
    }
}

template <class Real>
void CosinePlanes<Real>::backward(Real* first, Real* second) const
{
    using Number = Complex<Real>;
    const std::size_t na = impl_->na, nb = impl_->nb;
    const auto buffers = impl_->buffers();
    auto& buffer = *buffers.in;
    const std::vector<Real> none(second ? 0 : na);
    for (std::size_t j = 0; j < nb; ++j)
        row_from_cosine(impl_->a, na, first + j * na, second ? second + j * na : none.data(), buffer.data() + j * na);
    for (std::size_t k = 1; k <= nb / 2; ++k) {
        const Number w = impl_->b.twiddle(k);
        Number *low = buffer.data() + k * na, *high = buffer.data() + (nb - k) * na;
        for (std::size_t i = 0; i < na; ++i) {
            Number p = low[i], q = high[i];
            from_cosine(w, p, q);
            low[i] = p;
            high[i] = q;
        }
    }
    Impl::transform(impl_->back, buffers);
    for (std::size_t j = 0; j < nb; ++j) {
        const Number* row = buffers.out->data() + impl_->b.place[j] * na;
        Real *x = first + j * na, *y = second ? second + j * na : nullptr;
        for (std::size_t i = 0; i < na; ++i) {
            const Number value = row[impl_->a.place[i]];
            x[i] = value.re;
            if (y) y[i] = value.im;
        }
    }
}

template class CosinePlanes<double>;
template class CosinePlanes<float>;

}  // namespace coral::fluid::detail
