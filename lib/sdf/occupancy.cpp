#include "sdf/detail/occupancy.h"

#include <array>

#include "core/error.h"
#include "core/parallel.h"
#include "sdf/detail/cubic_field.h"

namespace coral::sdf::detail {
namespace {

struct Box {
    Eigen::Vector3i first, last;  // inclusive
    std::size_t solid = 0;
};

Box solid_box(const GrainMask& mask)
{
    Box box{mask.size, Eigen::Vector3i::Constant(-1), 0};
    const std::uint8_t* voxel = mask.solid.data();
    for (int k = 0; k < mask.size.z(); ++k)
        for (int j = 0; j < mask.size.y(); ++j, voxel += mask.size.x()) {
            int count = 0;
            for (int i = 0; i < mask.size.x(); ++i) count += voxel[i] != 0;
            if (count == 0) continue;
            int a = 0, b = mask.size.x() - 1;
            while (!voxel[a]) ++a;
            while (!voxel[b]) --b;
            box.first = box.first.cwiseMin(Eigen::Vector3i(a, j, k));
            box.last = box.last.cwiseMax(Eigen::Vector3i(b, j, k));
            box.solid += std::size_t(count);
        }
    return box;
}

std::vector<float> gaussian_weights(double sigma, int radius)
{
    std::vector<float> w;
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) sum += std::exp(-0.5 * i * i / (sigma * sigma));
    for (int i = -radius; i <= radius; ++i) w.push_back(float(std::exp(-0.5 * i * i / (sigma * sigma)) / sum));
    return w;
}

/// Separable Gaussian of one mask, plane by plane, so that only one whole array is held.
class Smoother {
public:
    Smoother(const GrainMask& mask, const Box& box, double sigma)
        : mask_(mask), radius_(int(std::ceil(4.0 * sigma))), pad_(radius_ + 3), weights_(gaussian_weights(sigma, radius_)),
          first_(box.first - Eigen::Vector3i::Constant(pad_)),
          size_(box.last - box.first + Eigen::Vector3i::Constant(1 + 2 * pad_))
    {
    }
    const Eigen::Vector3i& size() const { return size_; }
    const Eigen::Vector3i& first() const { return first_; }  ///< mask voxel of value (0,0,0)

    void run(std::vector<float>& values) const
    {
        values.resize(std::size_t(size_.x()) * std::size_t(size_.y()) * std::size_t(size_.z()));
        parallel_blocks(std::size_t(size_.z()), 48, [&](std::size_t begin, std::size_t end) { slab(int(begin), int(end), values); });
    }

private:
    void slab(int begin, int end, std::vector<float>& values) const
    {
        const int slots = 2 * radius_ + 1;
        const std::size_t area = std::size_t(size_.x()) * std::size_t(size_.y());
        std::vector<float> ring(area * std::size_t(slots)), lines(area);
        const auto slot = [&](int k) { return ring.data() + area * std::size_t((k + 2 * slots) % slots); };
        for (int k = begin - radius_; k < begin + radius_; ++k) plane(k, lines, slot(k));
        for (int k = begin; k < end; ++k) {
            plane(k + radius_, lines, slot(k + radius_));
            float* out = values.data() + area * std::size_t(k);
            std::fill(out, out + area, 0.5f);
            for (int c = -radius_; c <= radius_; ++c) subtract(weights_[std::size_t(c + radius_)], slot(k + c), area, out);
        }
    }

    static void subtract(float w, const float* in, std::size_t n, float* out)
    {
        for (std::size_t i = 0; i < n; ++i) out[i] -= w * in[i];
    }

    /// Smoothed in x and y; k counts padded planes.
    void plane(int k, std::vector<float>& lines, float* out) const
    {
        const std::size_t nx = std::size_t(size_.x()), ny = std::size_t(size_.y());
        std::fill(out, out + nx * ny, 0.0f);
        const int mask_k = k + first_.z();
        if (mask_k < 0 || mask_k >= mask_.size.z()) return;
        for (int j = 0; j < size_.y(); ++j) x_line(j + first_.y(), mask_k, lines.data() + nx * std::size_t(j));
        for (int j = radius_; j < size_.y() - radius_; ++j)
            for (int b = -radius_; b <= radius_; ++b)
                subtract(-weights_[std::size_t(b + radius_)], lines.data() + nx * std::size_t(j + b), nx, out + nx * std::size_t(j));
    }

    void x_line(int j, int k, float* out) const
    {
        std::fill(out, out + size_.x(), 0.0f);
        if (j < 0 || j >= mask_.size.y()) return;
        const std::uint8_t* in = mask_.solid.data() + std::size_t(mask_.size.x()) * (std::size_t(j) + std::size_t(mask_.size.y()) * std::size_t(k));
        std::vector<float> occupied(std::size_t(size_.x()), 0.0f);
        const int from = std::max(0, -first_.x()), to = std::min(size_.x(), mask_.size.x() - first_.x());
        for (int i = from; i < to; ++i) occupied[std::size_t(i)] = in[i + first_.x()] ? 1.0f : 0.0f;
        for (int a = -radius_; a <= radius_; ++a) {
            const float w = weights_[std::size_t(a + radius_)];
            for (int i = radius_; i < size_.x() - radius_; ++i) out[i] += w * occupied[std::size_t(i + a)];
        }
    }

    const GrainMask& mask_;
    int radius_, pad_;
    std::vector<float> weights_;
    Eigen::Vector3i first_, size_;
};

/// One axis resampled from steps of `from` to steps of `to`, Catmull-Rom.
void resample_axis(OccupancyField& field, int axis, double from, double to)
{
    Eigen::Vector3i size = field.size;
    size[axis] = int(std::floor((field.size[axis] - 1) * from / to)) + 1;
    std::vector<float> values(std::size_t(size.x()) * std::size_t(size.y()) * std::size_t(size.z()));
    const std::ptrdiff_t stride = axis == 0 ? 1 : axis == 1 ? field.size.x() : std::ptrdiff_t(field.size.x()) * field.size.y();
    std::size_t n = 0;
    for (int k = 0; k < size.z(); ++k)
        for (int j = 0; j < size.y(); ++j)
            for (int i = 0; i < size.x(); ++i, ++n) {
                Eigen::Vector3i at(i, j, k);
                Eigen::Array4f w, slope;
                at[axis] = CubicField::weights(at[axis] * to / from, field.size[axis], w, slope);
                const float* a = field.values.data() + at.x() + std::ptrdiff_t(field.size.x()) * (at.y() + std::ptrdiff_t(field.size.y()) * at.z());
                values[n] = w[0] * a[0] + w[1] * a[stride] + w[2] * a[2 * stride] + w[3] * a[3 * stride];
            }
    field.size = size;
    field.values = std::move(values);
}

std::size_t count_smoothed_out(const GrainMask& mask, const Smoother& smoother, const std::vector<float>& values)
{
    std::size_t count = 0, n = 0;
    const Eigen::Vector3i size = smoother.size(), first = smoother.first();
    for (int k = 0; k < size.z(); ++k)
        for (int j = 0; j < size.y(); ++j)
            for (int i = 0; i < size.x(); ++i, ++n) {
                const Eigen::Vector3i v = first + Eigen::Vector3i(i, j, k);
                if (values[n] <= 0 || values[n] >= 0.5f || (v.array() < 0).any() || (v.array() >= mask.size.array()).any()) continue;
                count += mask.solid[std::size_t(v.x()) + std::size_t(mask.size.x()) * (std::size_t(v.y()) + std::size_t(mask.size.y()) * std::size_t(v.z()))] != 0;
            }
    return count;
}

}  // namespace

OccupancyField smoothed_occupancy(const GrainMask& mask, double sigma)
{
    if ((mask.size.array() < 1).any() || mask.solid.size() != std::size_t(mask.size.x()) * std::size_t(mask.size.y()) * std::size_t(mask.size.z()))
        throw Error("grain mask", "the number of voxels does not fit its size");
    if (!(mask.voxel_size.array() > 0).all()) throw Error("grain mask", "voxel edges must be positive");
    const Box box = solid_box(mask);
    if (box.solid == 0) throw Error("grain mask", "no solid voxel");

    OccupancyField field;
    const Smoother smoother(mask, box, sigma);
    smoother.run(field.values);
    field.size = smoother.size();
    field.solid_voxels = box.solid;
    field.smoothed_out = count_smoothed_out(mask, smoother, field.values);
    field.step = mask.voxel_size.minCoeff();
    field.origin = mask.first_centre + smoother.first().cast<double>().cwiseProduct(mask.voxel_size);
    for (int axis = 0; axis < 3; ++axis)
        if (mask.voxel_size[axis] > field.step * (1 + 1e-9)) resample_axis(field, axis, mask.voxel_size[axis], field.step);
    return field;
}

}  // namespace coral::sdf::detail
