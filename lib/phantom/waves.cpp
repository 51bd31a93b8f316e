#include "phantom/waves.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace coral::phantom {

WaveField::WaveField(double wavelength, int count, RandomSource& random)
{
    for (int m = 0; m < count; ++m) {
        wave_vectors_.push_back(2 * std::numbers::pi / wavelength * random.direction());
        phases_.push_back(random.uniform(0, 2 * std::numbers::pi));
    }
}

double WaveField::at(const Eigen::Vector3d& point) const
{
    double sum = 0;
    for (std::size_t m = 0; m < phases_.size(); ++m) sum += std::cos(wave_vectors_[m].dot(point) + phases_[m]);
    return std::sqrt(2.0 / static_cast<double>(phases_.size())) * sum;
}

WaveField::OnLattice::OnLattice(const WaveField& field, const Lattice& lattice)
    : waves_(static_cast<int>(field.phases_.size())), size_(lattice.size)
{
    const double amplitude = std::sqrt(2.0 / waves_);
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t entries = static_cast<std::size_t>(waves_) * size_[axis];
        real_[axis].resize(entries);
        imaginary_[axis].resize(entries);
        for (int m = 0; m < waves_; ++m) {
            const Eigen::Vector3d k = lattice.frame.transpose() * field.wave_vectors_[m];
            for (int n = 0; n < size_[axis]; ++n) {
                double angle = k[axis] * (lattice.origin[axis] + n * lattice.step[axis]);
                if (axis == 0) angle += field.phases_[m];
                const std::size_t at =
                    axis == 0 ? static_cast<std::size_t>(m) * size_[0] + n : static_cast<std::size_t>(n) * waves_ + m;
                const double scale = axis == 0 ? amplitude : 1.0;
                real_[axis][at] = static_cast<float>(scale * std::cos(angle));
                imaginary_[axis][at] = static_cast<float>(scale * std::sin(angle));
            }
        }
    }
}

void WaveField::OnLattice::row(int j, int k, std::span<float> values) const
{
    std::fill(values.begin(), values.end(), 0.0f);
    for (int m = 0; m < waves_; ++m) {
        const std::size_t y = static_cast<std::size_t>(j) * waves_ + m, z = static_cast<std::size_t>(k) * waves_ + m;
        const float re = real_[1][y] * real_[2][z] - imaginary_[1][y] * imaginary_[2][z];
        const float im = real_[1][y] * imaginary_[2][z] + imaginary_[1][y] * real_[2][z];
        const float* x_re = real_[0].data() + static_cast<std::size_t>(m) * size_[0];
        const float* x_im = imaginary_[0].data() + static_cast<std::size_t>(m) * size_[0];
        for (int i = 0; i < size_[0]; ++i) values[i] += re * x_re[i] - im * x_im[i];
    }
}

}  // namespace coral::phantom
