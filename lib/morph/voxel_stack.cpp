#include "morph/voxel_stack.h"

#include <algorithm>

namespace coral::morph {

Mask make_mask(const Eigen::Vector3i& size, const Eigen::Vector3d& voxel_size)
{
    Mask mask;
    mask.size = size;
    mask.voxel_size = voxel_size;
    mask.voxels.assign(mask.count(), 0);
    return mask;
}

std::size_t solid_count(const Mask& mask)
{
    std::size_t sum = 0;
    for (std::uint8_t v : mask.voxels) sum += v;
    return sum;
}

Mask padded(const Mask& mask, const Eigen::Vector3i& margin)
{
    Mask out = make_mask(mask.size + 2 * margin, mask.voxel_size);
    out.offset = mask.offset - margin;
    for (int k = 0; k < mask.size.z(); ++k)
        for (int j = 0; j < mask.size.y(); ++j)
            std::copy_n(mask.voxels.begin() + std::ptrdiff_t(mask.index(0, j, k)), mask.size.x(),
                        out.voxels.begin() + std::ptrdiff_t(out.index(margin.x(), j + margin.y(), k + margin.z())));
    return out;
}

}  // namespace coral::morph
