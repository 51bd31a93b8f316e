#pragma once
/// \file fluid/grid.h
/// Uniform staggered (MAC) grid: what a flow domain is, and how its fields lie in memory.
/// Velocity components live on the faces of cubic cells (u[i] at x = origin + i h, v and w alike), pressure and
/// porosity at the centres. All fields share one padded layout, x fastest, with two ghost layers on each side.
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <new>
#include <vector>

namespace coral::fluid {

enum class BoundaryKind {
    slip,      ///< no flow through, no shear
    wall,      ///< no slip; moves with `velocity` in its own plane
    inlet,     ///< velocity given
    outlet,    ///< pressure given on the face, flow leaves freely; back-flow carries no momentum
    periodic,  ///< both sides of an axis, or none
};

struct Boundary {
    BoundaryKind kind = BoundaryKind::slip;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< of an inlet, or tangential of a wall [m/s]
    double pressure = 0.0;                               ///< of an outlet [Pa]
};

/// Index of a domain face: 2*axis + (0 at the low side, 1 at the high side).
enum Face { x_minus, x_plus, y_minus, y_plus, z_minus, z_plus };

/// Domain, resolution and boundaries of a flow.
struct GridSpec {
    Eigen::Vector3i cells = Eigen::Vector3i::Zero();   ///< number of cells along x, y, z
    double cell = 0.0;                                 ///< edge of the cubic cells [m]
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< low corner of the domain [m]
    std::array<Boundary, 6> boundary{};                ///< indexed by Face

    bool periodic(int axis) const { return boundary[2 * axis].kind == BoundaryKind::periodic; }
    bool outlet(int axis, int side) const { return boundary[2 * axis + side].kind == BoundaryKind::outlet; }
    Eigen::Vector3d size() const { return cells.cast<double>() * cell; }
    std::size_t cell_count() const { return std::size_t(cells.x()) * std::size_t(cells.y()) * std::size_t(cells.z()); }
    double cell_volume() const { return cell * cell * cell; }
    /// \throws UsageError  no cells, a periodic side without its partner, or inlets whose flow has nowhere to go
    void validate() const;
    /// Velocity faces of `axis` that the flow equations advance: indices [first, last) along `axis`.
    /// A given-velocity side is left out, an outlet side is in; periodic: [0, n).
    int first_unknown(int axis) const { return periodic(axis) || outlet(axis, 0) ? 0 : 1; }
    int last_unknown(int axis) const { return cells[axis] + (outlet(axis, 1) ? 1 : 0); }
};

namespace detail {
/// Memory for an array that begins on a cache line. Large ones begin at other places of a page one after the other: what a loop reads of ten
/// fields at the same index would else fall into one set of a cache that holds eight.
void* allocate_staggered(std::size_t bytes);
void free_staggered(void* memory, std::size_t bytes);
}  // namespace detail

/// Plain allocator that starts arrays on cache lines (and SIMD registers).
template <class T>
struct CacheAligned {
    using value_type = T;
    CacheAligned() = default;
    template <class U>
    CacheAligned(const CacheAligned<U>&)
    {
    }
    T* allocate(std::size_t n) { return static_cast<T*>(detail::allocate_staggered(n * sizeof(T))); }
    void deallocate(T* p, std::size_t n) { detail::free_staggered(p, n * sizeof(T)); }
    template <class U>
    bool operator==(const CacheAligned<U>&) const
    {
        return true;
    }
};

/// One padded field; element (i, j, k) is field[layout.index(i, j, k)].
using Field = std::vector<double, CacheAligned<double>>;

/// Addresses of a padded field: i in [-2, nx+2], j in [-2, ny+2], k in [-2, nz+2] (faces reach n, plus two ghosts).
struct Layout {
    Layout() = default;
    explicit Layout(const Eigen::Vector3i& cells);

    static constexpr int ghost = 2;
    Eigen::Vector3i cells = Eigen::Vector3i::Zero();
    std::array<std::ptrdiff_t, 3> stride{};  ///< 1, row pitch, plane
    std::size_t total = 0;                   ///< elements of a field

    std::size_t index(int i, int j, int k) const
    {
        return std::size_t((i + ghost) + (j + ghost) * stride[1] + (k + ghost) * stride[2]);
    }
    Field make_field(double value = 0.0) const { return Field(total, value); }
};

}  // namespace coral::fluid
