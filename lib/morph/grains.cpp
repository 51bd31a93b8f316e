#include "morph/grains.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

namespace coral::morph {
namespace {

/// Whether two rows hold different labels side by side. Without branches, many voxels at a time: most rows hold none.
template <class T>
bool any_touch(const T* row, const T* other, int begin, int end)
{
    unsigned any = 0;
    for (int i = begin; i < end; ++i) any |= unsigned(row[i] != other[i]) & unsigned(row[i] != 0) & unsigned(other[i] != 0);
    return any != 0;
}

/// Labels with a neighbour of another label. Thirteen offsets see every pair of the 26-neighbourhood once.
template <class T>
std::unordered_set<std::uint32_t> touching_labels(std::span<const T> labels, const Eigen::Vector3i& size)
{
    std::unordered_set<std::uint32_t> touching;
    T last_a = 0, last_b = 0;
    const std::ptrdiff_t dy = size.x(), dz = dy * size.y();
    for (int k = 0; k < size.z(); ++k)
        for (int j = 0; j < size.y(); ++j)
            for (int n = 14; n < 27; ++n) {
                const int di = n % 3 - 1, dj = n / 3 % 3 - 1, dk = n / 9 - 1;
                if (j + dj < 0 || j + dj >= size.y() || k + dk >= size.z()) continue;
                const T* row = labels.data() + dz * k + dy * j;
                const T* other = row + di + dy * dj + dz * dk;
                const int begin = std::max(0, -di), end = size.x() - std::max(0, di);
                if (!any_touch(row, other, begin, end)) continue;
                for (int i = begin; i < end; ++i) {
                    if (row[i] == other[i] || row[i] == 0 || other[i] == 0 || (row[i] == last_a && other[i] == last_b)) continue;
                    last_a = row[i];
                    last_b = other[i];
                    touching.insert(last_a);
                    touching.insert(last_b);
                }
            }
    return touching;
}

template <class T>
std::vector<LabelBox> boxes_of(std::span<const T> labels, const Eigen::Vector3i& size)
{
    std::unordered_map<std::uint32_t, LabelBox> boxes;
    for (int k = 0; k < size.z(); ++k)
        for (int j = 0; j < size.y(); ++j) {
            const T* row = labels.data() + (std::size_t(k) * std::size_t(size.y()) + std::size_t(j)) * std::size_t(size.x());
            for (int i = 0; i < size.x();) {
                const int begin = i;
                while (i < size.x() && row[i] == row[begin]) ++i;
                if (row[begin] == 0) continue;
                const Eigen::Vector3i low(begin, j, k), high(i, j + 1, k + 1);
                const auto [at, fresh] = boxes.try_emplace(row[begin], LabelBox{row[begin], low, high, 0, false, false});
                LabelBox& box = at->second;
                if (!fresh) {
                    box.low = box.low.cwiseMin(low);
                    box.high = box.high.cwiseMax(high);
                }
                box.voxels += std::size_t(i - begin);
            }
        }
    const std::unordered_set<std::uint32_t> touching = touching_labels(labels, size);
    std::vector<LabelBox> out;
    for (auto& [label, box] : boxes) {
        box.touches_border = box.low.minCoeff() == 0 || (size - box.high).minCoeff() == 0;
        box.touches_neighbour = touching.contains(label);
        out.push_back(box);
    }
    std::sort(out.begin(), out.end(), [](const LabelBox& a, const LabelBox& b) { return a.label < b.label; });
    return out;
}

}  // namespace

std::vector<LabelBox> label_boxes(const VoxelValues& labels, const Eigen::Vector3i& size)
{
    return labels.visit([&](auto values) { return boxes_of(values, size); });
}

Mask cut_out(const VoxelValues& labels, const Eigen::Vector3i& size, const Eigen::Vector3d& voxel_size, const LabelBox& box)
{
    Mask mask = make_mask(box.high - box.low, voxel_size);
    mask.offset = box.low;
    labels.visit([&](auto values) {
        std::size_t v = 0;
        for (int k = box.low.z(); k < box.high.z(); ++k)
            for (int j = box.low.y(); j < box.high.y(); ++j) {
                const auto* row = values.data() + (std::size_t(k) * std::size_t(size.y()) + std::size_t(j)) * std::size_t(size.x());
                for (int i = box.low.x(); i < box.high.x(); ++i) mask.voxels[v++] = row[i] == box.label;
            }
    });
    return mask;
}

PackedMask::PackedMask(const Mask& mask) : bits_((mask.voxels.size() + 63) / 64, 0)
{
    frame_.size = mask.size;
    frame_.voxel_size = mask.voxel_size;
    frame_.offset = mask.offset;
    for (std::size_t v = 0; v < mask.voxels.size(); ++v) bits_[v / 64] |= std::uint64_t(mask.voxels[v] != 0) << (v % 64);
}

Mask PackedMask::unpack() const
{
    Mask mask = frame_;
    mask.voxels.resize(mask.count());
    for (std::size_t v = 0; v < mask.voxels.size(); ++v) mask.voxels[v] = bits_[v / 64] >> (v % 64) & 1;
    return mask;
}

}  // namespace coral::morph
