#pragma once
/// \file phantom/components.h
/// Connected pieces of a lattice, counted here on their own so that the truth does not rest on the code that it is to
/// check.
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace coral::phantom {

/// Pieces of the points whose `state` equals `wanted`, numbered 1.. in `piece` (0 elsewhere); returns the points per
/// piece (entry 0 unused). \param corners  neighbours across faces, edges and corners (26) instead of faces alone (6)
std::vector<std::size_t> label_pieces(std::span<const std::uint8_t> state, std::uint8_t wanted,
                                      const Eigen::Vector3i& size, bool corners, std::vector<std::int32_t>& piece);

}  // namespace coral::phantom
