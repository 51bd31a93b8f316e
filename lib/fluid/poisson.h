#pragma once
/// \file fluid/poisson.h
/// Direct solution of the seven-point Poisson equation of a GridSpec: fast transforms along two axes, a tridiagonal
/// solve along the third (an axis with an outlet if there is one). Periodic in all three: transforms along all three.
#include <memory>

#include "fluid/flow_field.h"
#include "fluid/grid.h"

namespace coral::fluid {

/// lap x = b at the cell centres, h spacing. Outlet sides hold x = 0 on the face, other sides dx/dn = 0.
/// Without any outlet b must sum to zero (what is left of the sum is spread evenly) and x gets zero mean.
class Poisson {
public:
    /// \param precision  of the arrays; the recurrences of the tridiagonal solve are in double either way
    explicit Poisson(const GridSpec& grid, Precision precision = Precision::float64);
    ~Poisson();

    /// Address of cell (i, j, k) in the work array is i + row() j + plane() k.
    std::size_t row() const;
    std::size_t plane() const;
    FlowField make_work() const;

    /// In: b [1/s2 for a pressure]; out: x. Safe to call from several threads with different arrays; the result does
    /// not depend on the number of threads. \param scratch  second array, resized as needed (only used when the
    /// tridiagonal axis is not z)
    void solve(FlowField& work, FlowField& scratch) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace coral::fluid
