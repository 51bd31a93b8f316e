#pragma once
/// Voxel bodies with known answers, drawn off-centre so that no symmetry of the lattice helps.
#include <cmath>
#include <functional>

#include "morph/voxel_stack.h"

namespace coral::morph::test {

/// Voxels of edge 1 (or `edges`) whose centres satisfy `inside`; positions in metres.
inline Mask draw(const Eigen::Vector3i& size, const std::function<bool(const Eigen::Vector3d&)>& inside, const Eigen::Vector3d& edges = Eigen::Vector3d::Ones())
{
    Mask mask = make_mask(size, edges);
    for (int k = 0; k < size.z(); ++k)
        for (int j = 0; j < size.y(); ++j)
            for (int i = 0; i < size.x(); ++i)
                mask.voxels[mask.index(i, j, k)] = inside((Eigen::Vector3d(i, j, k).array() + 0.5).matrix().cwiseProduct(edges));
    return mask;
}

inline Mask draw_sphere(int size, double radius)
{
    const Eigen::Vector3d centre(0.5 * size + 0.21, 0.5 * size - 0.33, 0.5 * size + 0.12);
    return draw(Eigen::Vector3i::Constant(size), [=](const Eigen::Vector3d& p) { return (p - centre).norm() <= radius; });
}

}  // namespace coral::morph::test
