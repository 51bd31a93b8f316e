#include "suffusion/apparent.h"

#include <cmath>

#include "morph/components.h"
#include "morph/distance_transform.h"

namespace coral::suffusion {

ApparentShape::ApparentShape(const sdf::DistanceGrid& grid, double diameter) : spacing_(grid.spacing)
{
    const double radius = 0.1 * diameter;
    const int margin = static_cast<int>(std::ceil(radius / grid.spacing)) + 2;  // so that the outermost layer is outside
    size_ = grid.size.array() + 2 * margin;
    origin_ = grid.origin.array() - margin * grid.spacing;
    const std::size_t row = static_cast<std::size_t>(size_.x()), layer = row * static_cast<std::size_t>(size_.y());
    std::vector<std::uint8_t> far(layer * static_cast<std::size_t>(size_.z()));
    std::vector<std::uint8_t> solid(far.size());
    for (int k = 0; k < size_.z(); ++k)
        for (int j = 0; j < size_.y(); ++j)
            for (int i = 0; i < size_.x(); ++i) {
                const double d = grid.sample(origin_ + spacing_ * Eigen::Vector3d(i, j, k));
                const std::size_t n = static_cast<std::size_t>(i) + row * static_cast<std::size_t>(j) + layer * static_cast<std::size_t>(k);
                far[n] = d > radius;
                solid[n] = d <= 0;
            }
    const std::vector<std::uint8_t> reached = morph::connected_to_border(far, size_, 1);
    const std::vector<float> squared = morph::squared_distances(reached, size_, 1, Eigen::Vector3d::Constant(spacing_));
    const double limit = std::pow(radius + 0.5 * spacing_, 2);
    inside_.resize(far.size());
    for (std::size_t n = 0; n < far.size(); ++n) inside_[n] = solid[n] || squared[n] > limit;
}

double ApparentShape::volume() const
{
    std::size_t count = 0;
    for (const std::uint8_t v : inside_) count += v;
    return static_cast<double>(count) * spacing_ * spacing_ * spacing_;
}

}  // namespace coral::suffusion
