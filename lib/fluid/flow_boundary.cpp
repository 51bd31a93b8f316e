// Boundary rows, ghost layers, and what passes through the sides of the domain.
#include <algorithm>
#include <cmath>

#include "fluid/detail/faces.h"
#include "fluid/flow.h"

namespace coral::fluid {

namespace {

constexpr int g = Layout::ghost;

int wrap(int i, int n)
{
    return ((i % n) + n) % n;
}

/// Calls body(offset) for every line along `axis`, ghost lines included; offset is the address of position 0 on the
/// line.
template <class Body>
void for_each_line(const Layout& layout, int axis, const Body& body)
{
    const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
    Eigen::Vector3i c = Eigen::Vector3i::Zero();
    for (c[b] = -g; c[b] <= layout.cells[b] + g; ++c[b])
        for (c[a] = -g; c[a] <= layout.cells[a] + g; ++c[a]) body(std::ptrdiff_t(layout.index(c.x(), c.y(), c.z())));
}

/// The two ghosts beyond an outlet whose last inner value is `inner`. Leaving: zero gradient. Entering: back-flow
/// carries no momentum, so they make the upwind-biased value at the outlet zero, without shear where the scheme allows
/// (a limited scheme needs a zero neighbour).
template <class Real>
void set_outlet_ghosts(Real inner, bool enters, bool limited, Real& first, Real& second)
{
    first = enters && limited ? Real(0) : inner;
    second = enters ? (limited ? 2 * inner : 7 * inner) : inner;
}

/// Ghosts of the component normal to the sides: faces 0..n.
template <class Real>
void fill_normal(const GridSpec& grid, const Layout& layout, int axis, bool limited, Real* u)
{
    const int n = grid.cells[axis];
    const std::ptrdiff_t s = layout.stride[axis];
    for_each_line(layout, axis, [&](std::ptrdiff_t o) {
        if (grid.periodic(axis)) {
            for (int m : {-2, -1}) u[o + m * s] = u[o + wrap(m, n) * s];
            for (int m = 0; m <= g; ++m) u[o + (n + m) * s] = u[o + wrap(m, n) * s];
            return;
        }
        for (int side = 0; side < 2; ++side) {
            const std::ptrdiff_t face = o + (side == 0 ? 0 : n) * s, out = side == 0 ? -s : s;
            if (grid.outlet(axis, side)) {
                const bool enters = side == 0 ? u[face] > 0 : u[face] < 0;
                set_outlet_ghosts(u[face], enters, limited, u[face + out], u[face + 2 * out]);
            } else {
                const Boundary& b = grid.boundary[2 * axis + side];
                const Real given = b.kind == BoundaryKind::inlet ? Real(b.velocity[axis]) : Real(0);
                u[face] = given;
                for (int m = 1; m <= g; ++m) u[face + m * out] = 2 * given - u[face - std::min(m, n) * out];
            }
        }
    });
}

/// Ghosts of component `component` beyond the sides of another axis, where it sits at cell positions 0..n-1.
template <class Real>
void fill_tangential(const GridSpec& grid, const Layout& layout, int component, int axis, bool limited,
                     const Real* normal, Real* u)
{
    const int n = grid.cells[axis];
    const std::ptrdiff_t s = layout.stride[axis], own = layout.stride[component];
    for_each_line(layout, axis, [&](std::ptrdiff_t o) {
        if (grid.periodic(axis)) {
            for (int m : {-2, -1, n, n + 1, n + 2}) u[o + m * s] = u[o + wrap(m, n) * s];
            return;
        }
        for (int side = 0; side < 2; ++side) {
            const std::ptrdiff_t inner = o + (side == 0 ? 0 : n - 1) * s, out = side == 0 ? -s : s;
            const Boundary& b = grid.boundary[2 * axis + side];
            if (b.kind == BoundaryKind::outlet) {
                const std::ptrdiff_t face = o + (side == 0 ? 0 : n) * s;
                const Real q = normal[face] + (face >= own ? normal[face - own] : normal[face]);
                const bool enters = side == 0 ? q > 0 : q < 0;
                set_outlet_ghosts(u[inner], enters, limited, u[inner + out], u[inner + 2 * out]);
                continue;
            }
            const bool even = b.kind == BoundaryKind::slip;
            for (int m = 0; m < g; ++m) {
                const Real mirrored = u[inner - std::min(m, n - 1) * out];
                u[inner + (m + 1) * out] = even ? mirrored : Real(2.0 * b.velocity[component]) - mirrored;
            }
        }
    });
}

}  // namespace

void Flow::fill_velocity_ghosts()
{
    const bool limited = options_.convection == Convection::koren;
    in_precision(options_.precision, [&]<class Real>(Real) {
        Real* u[3];
        for (int axis = 0; axis < 3; ++axis) u[axis] = velocity_[axis].data<Real>();
        for (int axis = 0; axis < 3; ++axis) {
            fill_normal(grid_, layout_, axis, limited, u[axis]);
            for (int component = 0; component < 3; ++component)
                if (component != axis)
                    fill_tangential<Real>(grid_, layout_, component, axis, limited, u[axis], u[component]);
        }
    });
}

/// Cells: even at sides with given velocity or outlets, periodic copies.
void Flow::fill_centre_ghosts(FlowField& field) const
{
    in_precision(options_.precision, [&]<class Real>(Real) {
        Real* f = field.data<Real>();
        for (int axis = 0; axis < 3; ++axis) {
            const int n = grid_.cells[axis];
            const std::ptrdiff_t s = layout_.stride[axis];
            for_each_line(layout_, axis, [&](std::ptrdiff_t o) {
                for (int m : {-2, -1, n, n + 1, n + 2}) {
                    int from = m < 0 ? std::min(-1 - m, n - 1) : std::max(2 * n - 1 - m, 0);
                    if (grid_.periodic(axis)) from = wrap(m, n);
                    f[o + m * s] = f[o + from * s];
                }
            });
        }
    });
}

void Flow::fill_pressure_ghosts()
{
    in_precision(options_.precision, [&]<class Real>(Real) {
        Real* p = pressure_.data<Real>();
        for (int axis = 0; axis < 3; ++axis) {
            const int n = grid_.cells[axis];
            const std::ptrdiff_t s = layout_.stride[axis];
            for_each_line(layout_, axis, [&](std::ptrdiff_t o) {
                if (grid_.periodic(axis)) {
                    p[o - s] = p[o + (n - 1) * s];
                    p[o + n * s] = p[o];
                    return;
                }
                for (int side = 0; side < 2; ++side) {
                    const std::ptrdiff_t inner = o + (side == 0 ? 0 : n - 1) * s, out = side == 0 ? -s : s;
                    const double on_face = grid_.boundary[2 * axis + side].pressure / options_.density;
                    p[inner + out] = grid_.outlet(axis, side) ? Real(2.0 * on_face) - p[inner] : p[inner];
                }
            });
        }
    });
}

/// Given normal velocities and periodic copies, which the divergence needs; no ghosts.
void Flow::apply_given_velocities(std::array<FlowField, 3>& velocity) const
{
    in_precision(options_.precision, [&]<class Real>(Real) {
        for (int axis = 0; axis < 3; ++axis) {
            const int n = grid_.cells[axis];
            const std::ptrdiff_t s = layout_.stride[axis];
            Real* u = velocity[axis].data<Real>();
            for_each_line(layout_, axis, [&](std::ptrdiff_t o) {
                if (grid_.periodic(axis)) {
                    u[o + n * s] = u[o];
                    return;
                }
                for (int side = 0; side < 2; ++side) {
                    const Boundary& b = grid_.boundary[2 * axis + side];
                    if (b.kind != BoundaryKind::outlet)
                        u[o + (side == 0 ? 0 : n) * s] = b.kind == BoundaryKind::inlet ? Real(b.velocity[axis]) : Real(0);
                }
            });
        }
    });
}

/// sum of value(c) over the cells next to a side; c is the linear index of the cell.
template <class Value>
static double sum_over_side(const GridSpec& grid, const Layout& layout, Face side, const Value& value)
{
    const int axis = side / 2, a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
    Eigen::Vector3i c;
    c[axis] = side % 2 == 0 ? 0 : grid.cells[axis] - 1;
    double sum = 0.0;
    for (c[b] = 0; c[b] < grid.cells[b]; ++c[b])
        for (c[a] = 0; c[a] < grid.cells[a]; ++c[a]) sum += value(layout.index(c.x(), c.y(), c.z()));
    return sum;
}

static double side_area(const GridSpec& grid, Face side)
{
    const Eigen::Vector3d size = grid.size();
    return size.prod() / size[side / 2];
}

double Flow::mean_boundary_pressure(Face side) const
{
    if (grid_.boundary[side].kind == BoundaryKind::outlet) return grid_.boundary[side].pressure / options_.density;
    const double sum = sum_over_side(grid_, layout_, side, [&](std::size_t c) { return pressure_[c]; });
    return sum * grid_.cell * grid_.cell / side_area(grid_, side);
}

double Flow::boundary_outflow(Face side) const
{
    const int axis = side / 2;
    const std::size_t step = side % 2 == 0 ? 0 : std::size_t(layout_.stride[axis]);
    const double sum = sum_over_side(grid_, layout_, side, [&](std::size_t c) {
        const std::size_t f = c + step;
        return face_void_fraction(axis, f) * velocity_[axis][f] + (has_fines_ ? porous_.solid_flux[axis][f] : 0.0);
    });
    return (side % 2 == 0 ? -sum : sum) * grid_.cell * grid_.cell;
}

void Flow::balance_sides()
{
    for (int side = 0; side < 6; ++side) {
        const int axis = side / 2;
        const BoundaryKind kind = grid_.boundary[side].kind;
        if (kind != BoundaryKind::inlet && kind != BoundaryKind::outlet) continue;
        mass_.net_flux += boundary_outflow(Face(side));
        const std::size_t step = side % 2 == 0 ? 0 : std::size_t(layout_.stride[axis]);
        const double sign = side % 2 == 0 ? 1.0 : -1.0;
        mass_.inflow += grid_.cell * grid_.cell * sum_over_side(grid_, layout_, Face(side), [&](std::size_t c) {
                            return std::max(0.0, sign * face_void_fraction(axis, c + step) * velocity_[axis][c + step]);
                        });
    }
}

/// Force of the sides' pressure on the fluid: what is left of -sum grad p over the unknown faces [N].
Eigen::Vector3d Flow::boundary_pressure_force() const
{
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis) {
        if (grid_.periodic(axis)) continue;
        const Face low = Face(2 * axis), high = Face(2 * axis + 1);
        force[axis] = side_area(grid_, low) * (mean_boundary_pressure(low) - mean_boundary_pressure(high));
    }
    return options_.density * force;
}

Eigen::Vector3d Flow::mean_superficial_velocity() const
{
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis)
        for (int k = 0; k < grid_.cells.z(); ++k)
            for (int j = 0; j < grid_.cells.y(); ++j)
                for (int i = 0; i < grid_.cells.x(); ++i) {
                    const std::size_t low = layout_.index(i, j, k), high = low + std::size_t(layout_.stride[axis]);
                    sum[axis] += 0.5 * (face_void_fraction(axis, low) * velocity_[axis][low] +
                                        face_void_fraction(axis, high) * velocity_[axis][high]);
                }
    return sum / double(grid_.cell_count());
}

Eigen::Vector3d Flow::cell_velocity(int i, int j, int k) const
{
    Eigen::Vector3d u;
    const std::size_t c = layout_.index(i, j, k);
    for (int axis = 0; axis < 3; ++axis)
        u[axis] = 0.5 * (velocity_[axis][c] + velocity_[axis][c + std::size_t(layout_.stride[axis])]);
    return u;
}

}  // namespace coral::fluid
