#pragma once
/// \file fluid/detail/fines.h
/// How the work on fines is cut up; the pieces do not depend on the number of threads.
#include <cstddef>

namespace coral::fluid::detail {

inline constexpr std::size_t particles_per_chunk = 64;
inline constexpr std::size_t planes_per_slab = 8;

inline int wrap(int i, int n)
{
    return ((i % n) + n) % n;
}

}  // namespace coral::fluid::detail
