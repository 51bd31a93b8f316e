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
    std::vector<Complex<Real>> twiddle;  ///< exp(-i pi k / 2n)
    explicit Direction(std::size_t n)
    {
        for (std::size_t s = 0; s < n; ++s) {
            place.push_back(s % 2 == 0 ? s / 2 : n - 1 - s / 2);
            const double angle = std::numbers::pi * double(s) / (2.0 * double(n));
            twiddle.push_back({Real(std::cos(angle)), Real(-std::sin(angle))});
        }
    }
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

}  // namespace

template <class Real>
struct CosinePlanes<Real>::Impl {
    using Number = Complex<Real>;
    using Buffer = std::vector<Number, CacheAligned<Number>>;
    using Fft = Fftw<Real>;
    std::size_t na, nb;
    Direction<Real> a, b;
    PlanOf<Real> forth, back;

    Impl(std::size_t na_, std::size_t nb_) : na(na_), nb(nb_), a(na_), b(nb_)
    {
        Buffers sample = buffers();
        const std::lock_guard lock(planner_mutex());
        forth.plan = Fft::plan_dft_2d(int(nb), int(na), raw(*sample.in), raw(*sample.out), FFTW_FORWARD, FFTW_ESTIMATE);
        back.plan = Fft::plan_dft_2d(int(nb), int(na), raw(*sample.in), raw(*sample.out), FFTW_BACKWARD, FFTW_ESTIMATE);
    }
    /// From one array to another: in place FFTW would copy to and fro.
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
    static void transform(const PlanOf<Real>& plan, const Buffers& of) { Fft::execute_dft(plan.plan, raw(*of.in), raw(*of.out)); }
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
        const Number w = impl_->b.twiddle[k];
        Number *low = buffer.data() + k * na, *high = buffer.data() + (nb - k) * na;
        if (low == high)  // the middle row is its own partner
            for (std::size_t i = 0; i < na; ++i) low[i] = w * low[i] + conj(w) * low[i];
        else
            for (std::size_t i = 0; i < na; ++i) to_cosine(w, low[i], high[i]);
    }
    for (std::size_t j = 0; j < nb; ++j) {
        Number* row = buffer.data() + j * na;
        const Real scale = j == 0 ? Real(2) : Real(1);  // row 0 has no partner either: C(0) = 2 V(0)
        Real *x = first + j * na, *y = second ? second + j * na : nullptr;
        const auto put = [&](std::size_t i, Number value) {
            x[i] = scale * value.re;
            if (y) y[i] = scale * value.im;
        };
        put(0, row[0] + row[0]);
        for (std::size_t i = 1; i <= na / 2; ++i) {
            Number low = row[i], high = row[na - i];
            to_cosine(impl_->a.twiddle[i], low, high);
            put(na - i, high);
            put(i, low);  // last: in the middle of an even row both are the same entry, and `low` is right
        }
    }
}

template <class Real>
void CosinePlanes<Real>::backward(Real* first, Real* second) const
{
    using Number = Complex<Real>;
    const std::size_t na = impl_->na, nb = impl_->nb;
    const auto buffers = impl_->buffers();
    auto& buffer = *buffers.in;
    for (std::size_t j = 0; j < nb; ++j) {
        Number* row = buffer.data() + j * na;
        const Real *x = first + j * na, *y = second ? second + j * na : nullptr;
        row[0] = {x[0], y ? y[0] : Real(0)};
        for (std::size_t i = 1; i <= na / 2; ++i) {
            Number low = {x[i], y ? y[i] : Real(0)}, high = {x[na - i], y ? y[na - i] : Real(0)};
            from_cosine(impl_->a.twiddle[i], low, high);
            row[i] = low;
            row[na - i] = high;
        }
    }
    for (std::size_t k = 1; k <= nb / 2; ++k) {
        const Number w = impl_->b.twiddle[k];
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
