#pragma once
/// \file morph/distance_transform.h
/// Exact Euclidean distance transform of a binary image with any voxel edges.
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace coral::morph {

/// Squared distance from each voxel centre to the nearest feature voxel centre:
///     d^2(x) = min over features y of |x - y|^2        [Meijster et al. 2000; Felzenszwalb & Huttenlocher 2012]
/// \param voxels   [nz, ny, nx], x fastest
/// \param feature  value of the voxels distances are taken to
/// \param edges    voxel edges in any unit; with unit edges the result is exact integers up to 2^24
/// \return squared distances [unit of edges, squared]; infinity everywhere when there is no feature
/// \note Same bits for any number of threads.
std::vector<float> squared_distances(std::span<const std::uint8_t> voxels, const Eigen::Vector3i& size, std::uint8_t feature,
                                     const Eigen::Vector3d& edges);

}  // namespace coral::morph
