#include "fluid/grid.h"

#include <sys/mman.h>

#include <atomic>
#include <cstring>
#include <string>

#include "core/error.h"

namespace coral::fluid {

namespace {

const char* const side_names[] = {"x-", "x+", "y-", "y+", "z-", "z+"};

/// Volume per time entering through sides whose velocity is given, over h2.
double given_inflow(const GridSpec& grid)
{
    double inflow = 0.0;
    for (int side = 0; side < 6; ++side) {
        const Boundary& b = grid.boundary[side];
        if (b.kind != BoundaryKind::inlet) continue;
        const int axis = side / 2;
        const double faces = double(grid.cells[(axis + 1) % 3]) * grid.cells[(axis + 2) % 3];
        inflow += (side % 2 == 0 ? 1.0 : -1.0) * b.velocity[axis] * faces;
    }
    return inflow;
}

}  // namespace

void GridSpec::validate() const
{
    if (cells.minCoeff() < 1)
        throw UsageError("domain", "has no cells along one axis", "make size at least one cell everywhere");
    if (!(cell > 0.0)) throw UsageError("domain.cell", "is not positive", "give the edge of a cell, such as \"0.5mm\"");
    bool has_outlet = false;
    double largest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const bool low = boundary[2 * axis].kind == BoundaryKind::periodic;
        const bool high = boundary[2 * axis + 1].kind == BoundaryKind::periodic;
        if (low != high)
            throw UsageError(std::string("boundary.") + side_names[2 * axis + (low ? 1 : 0)],
                             "is not periodic but the opposite side is", "make both sides periodic, or none");
    }
    for (int side = 0; side < 6; ++side) {
        has_outlet = has_outlet || boundary[side].kind == BoundaryKind::outlet;
        if (boundary[side].kind == BoundaryKind::inlet) {
            const double faces = double(cells[(side / 2 + 1) % 3]) * cells[(side / 2 + 2) % 3];
            largest = std::max(largest, std::abs(boundary[side].velocity[side / 2]) * faces);
        }
        if (boundary[side].kind == BoundaryKind::wall && boundary[side].velocity[side / 2] != 0.0)
            throw UsageError(std::string("boundary.") + side_names[side], "is a wall that moves through itself",
                             "give a wall a velocity in its own plane only, or make it an inlet");
    }
    if (!has_outlet && std::abs(given_inflow(*this)) > 1e-12 * largest)
        throw UsageError("boundary", "what flows in through the inlets cannot flow out",
                         "make one side an outlet with a pressure");
}

namespace detail {

namespace {
constexpr std::size_t line = 64, large = 65536;
// A page has 64 lines: arrays begin on sixteen of them in turn, no two of which are alike.
constexpr std::size_t places = 16, lines_apart = 5;
// Sweeps across planes touch a page every few kilobytes: fields lie in pages of 2 MB where the system has them on request.
constexpr std::size_t huge_page = std::size_t{1} << 21;

std::align_val_t alignment_of(std::size_t bytes) { return std::align_val_t{bytes < huge_page ? line : huge_page}; }
}

void* allocate_staggered(std::size_t bytes)
{
    if (bytes < large) return ::operator new (bytes, std::align_val_t{line});
    static std::atomic<std::size_t> count{0};
    const std::size_t shift = line + lines_apart * line * (count++ % places);
    auto* const memory = static_cast<std::byte*>(::operator new (bytes + shift, alignment_of(bytes)));
#ifdef MADV_HUGEPAGE
    if (bytes >= huge_page) madvise(memory, bytes + shift, MADV_HUGEPAGE);  // a wish: what becomes of it does not matter
#endif
    std::byte* const array = memory + shift;
    std::memcpy(array - sizeof memory, &memory, sizeof memory);  // for free_staggered
    return array;
}

void free_staggered(void* array, std::size_t bytes)
{
    if (bytes < large) return ::operator delete (array, std::align_val_t{line});
    void* memory = nullptr;
    std::memcpy(&memory, static_cast<std::byte*>(array) - sizeof memory, sizeof memory);
    ::operator delete (memory, alignment_of(bytes));
}

}  // namespace detail

Layout::Layout(const Eigen::Vector3i& n) : cells(n)
{
    const auto padded = [](int count) { return std::ptrdiff_t(count) + 2 * ghost + 1; };
    // rows start on cache lines; a pitch that is a multiple of 512 bytes would crowd neighbours into few cache sets
    std::ptrdiff_t pitch = (padded(n.x()) + 7) / 8 * 8;
    if (pitch % 64 == 0) pitch += 8;
    stride = {1, pitch, pitch * padded(n.y())};
    total = std::size_t(stride[2] * padded(n.z()));
}

}  // namespace coral::fluid
