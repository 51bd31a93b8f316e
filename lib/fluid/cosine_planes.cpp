#include "fluid/detail/cosine_planes.h"

#include <fftw3.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "fluid/grid.h"

namespace coral::fluid::detail {

std::mutex& planner_mutex()
{
    static std::mutex mutex;
    return mutex;
}

namespace {

struct Complex {
    double re = 0.0, im = 0.0;
};
using Buffer = std::vector<Complex, CacheAligned<Complex>>;

inline Complex operator+(Complex a, Complex b)
{
    return {a.re + b.re, a.im + b.im};
}
inline Complex operator-(Complex a, Complex b)
{
    return {a.re - b.re, a.im - b.im};
}
inline Complex operator*(Complex a, Complex b)
{
    return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
inline Complex conj(Complex a)
{
    return {a.re, -a.im};
}
inline Complex times_i(Complex a)
{
    return {-a.im, a.re};
}

/// Order and twiddles of one direction: sample s of the real sequence is entry place[s] of the complex one.
struct Direction {
    std::vector<std::size_t> place;
    std::vector<Complex> twiddle;  ///< exp(-i pi k / 2n)
    explicit Direction(std::size_t n)
    {
        for (std::size_t s = 0; s < n; ++s) {
            place.push_back(s % 2 == 0 ? s / 2 : n - 1 - s / 2);
            const double angle = std::numbers::pi * double(s) / (2.0 * double(n));
            twiddle.push_back({std::cos(angle), -std::sin(angle)});
        }
    }
};

/// C(k) = w V(k) + w* V(n-k), C(n-k) = i (w V(k) - w* V(n-k)): holds for two real sequences packed as one, because it
/// is linear.
inline void to_cosine(Complex w, Complex& low, Complex& high)
{
    const Complex p = w * low, q = conj(w) * high;
    low = p + q;
    high = times_i(p - q);
}

/// V(k) = w* (C(k) - i C(n-k)), V(n-k) = w (C(k) + i C(n-k)).
inline void from_cosine(Complex w, Complex& low, Complex& high)
{
    const Complex turned = times_i(high);
    high = w * (low + turned);
    low = conj(w) * (low - turned);
}

}  // namespace

struct CosinePlanes::Impl {
    std::size_t na, nb;
    Direction a, b;
    fftw_plan forth = nullptr, back = nullptr;

    Impl(std::size_t na_, std::size_t nb_) : na(na_), nb(nb_), a(na_), b(nb_)
    {
        Buffer sample(na * nb);
        const std::lock_guard lock(planner_mutex());
        auto* data = reinterpret_cast<fftw_complex*>(sample.data());
        forth = fftw_plan_dft_2d(int(nb), int(na), data, data, FFTW_FORWARD, FFTW_ESTIMATE);
        back = fftw_plan_dft_2d(int(nb), int(na), data, data, FFTW_BACKWARD, FFTW_ESTIMATE);
    }
    ~Impl()
    {
        const std::lock_guard lock(planner_mutex());
        fftw_destroy_plan(forth);
        fftw_destroy_plan(back);
    }
    Buffer& buffer() const
    {
        thread_local Buffer values;
        values.resize(na * nb);
        return values;
    }
};

CosinePlanes::CosinePlanes(std::size_t na, std::size_t nb) : impl_(std::make_unique<Impl>(na, nb)) {}
CosinePlanes::~CosinePlanes() = default;

void CosinePlanes::forward(double* first, double* second) const
{
    const std::size_t na = impl_->na, nb = impl_->nb;
    Buffer& buffer = impl_->buffer();
    for (std::size_t j = 0; j < nb; ++j) {
        Complex* row = buffer.data() + impl_->b.place[j] * na;
        const double *x = first + j * na, *y = second ? second + j * na : nullptr;
        for (std::size_t i = 0; i < na; ++i) row[impl_->a.place[i]] = {x[i], y ? y[i] : 0.0};
    }
    auto* data = reinterpret_cast<fftw_complex*>(buffer.data());
    fftw_execute_dft(impl_->forth, data, data);
    for (std::size_t k = 1; k <= nb / 2; ++k) {
        const Complex w = impl_->b.twiddle[k];
        Complex *low = buffer.data() + k * na, *high = buffer.data() + (nb - k) * na;
        if (low == high)  // the middle row is its own partner
            for (std::size_t i = 0; i < na; ++i) low[i] = w * low[i] + conj(w) * low[i];
        else
            for (std::size_t i = 0; i < na; ++i) to_cosine(w, low[i], high[i]);
    }
    for (std::size_t j = 0; j < nb; ++j) {
        Complex* row = buffer.data() + j * na;
        const double scale = j == 0 ? 2.0 : 1.0;  // row 0 has no partner either: C(0) = 2 V(0)
        double *x = first + j * na, *y = second ? second + j * na : nullptr;
        const auto put = [&](std::size_t i, Complex value) {
            x[i] = scale * value.re;
            if (y) y[i] = scale * value.im;
        };
        put(0, row[0] + row[0]);
        for (std::size_t i = 1; i <= na / 2; ++i) {
            Complex low = row[i], high = row[na - i];
            to_cosine(impl_->a.twiddle[i], low, high);
            put(na - i, high);
            put(i, low);  // last: in the middle of an even row both are the same entry, and `low` is right
        }
    }
}

void CosinePlanes::backward(double* first, double* second) const
{
    const std::size_t na = impl_->na, nb = impl_->nb;
    Buffer& buffer = impl_->buffer();
    for (std::size_t j = 0; j < nb; ++j) {
        Complex* row = buffer.data() + j * na;
        const double *x = first + j * na, *y = second ? second + j * na : nullptr;
        row[0] = {x[0], y ? y[0] : 0.0};
        for (std::size_t i = 1; i <= na / 2; ++i) {
            Complex low = {x[i], y ? y[i] : 0.0}, high = {x[na - i], y ? y[na - i] : 0.0};
            from_cosine(impl_->a.twiddle[i], low, high);
            row[i] = low;
            row[na - i] = high;
        }
    }
    for (std::size_t k = 1; k <= nb / 2; ++k) {
        const Complex w = impl_->b.twiddle[k];
        Complex *low = buffer.data() + k * na, *high = buffer.data() + (nb - k) * na;
        for (std::size_t i = 0; i < na; ++i) {
            Complex p = low[i], q = high[i];
            from_cosine(w, p, q);
            low[i] = p;
            high[i] = q;
        }
    }
    auto* data = reinterpret_cast<fftw_complex*>(buffer.data());
    fftw_execute_dft(impl_->back, data, data);
    for (std::size_t j = 0; j < nb; ++j) {
        const Complex* row = buffer.data() + impl_->b.place[j] * na;
        double *x = first + j * na, *y = second ? second + j * na : nullptr;
        for (std::size_t i = 0; i < na; ++i) {
            const Complex value = row[impl_->a.place[i]];
            x[i] = value.re;
            if (y) y[i] = value.im;
        }
    }
}

}  // namespace coral::fluid::detail
