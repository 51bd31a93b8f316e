#pragma once
/// \file fluid/detail/cosine_planes.h
/// Two-dimensional cosine transforms (DCT-II and DCT-III) of planes, two real planes as one complex one.
/// FFTW's own cosine transforms use no SIMD; the complex ones do [Makhoul, IEEE Trans. Acoust. Speech Signal Process.
/// 28:27, 1980].
#include <cstddef>
#include <memory>

namespace coral::fluid::detail {

/// \tparam Real  double or float
template <class Real>
class CosinePlanes {
public:
    /// \param na, nb  points along the fast and the slow direction of a plane
    CosinePlanes(std::size_t na, std::size_t nb);
    ~CosinePlanes();

    /// In place on two planes of nb rows of na values, like FFTW's unnormalised REDFT10 in both directions. `second`
    /// may be null.
    void forward(Real* first, Real* second) const;
    /// Like REDFT01 in both directions; forward then backward multiplies by 4 na nb.
    void backward(Real* first, Real* second) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace coral::fluid::detail
