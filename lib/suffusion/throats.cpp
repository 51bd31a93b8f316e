#include "suffusion/throats.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace coral::suffusion {

using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

constexpr int levels = 256;

constexpr int border_width = 2;

/// Largest distance within half a spacing of an inner node. In the middle of a throat distances have a ridge, which means of the nodes around would
/// cut off by up to 0.7 spacings: so it goes on with the slope on either side of the place, and the lesser of the two counts.
float largest_nearby(const sdf::DistanceGrid& grid, std::size_t node)
{
    const std::ptrdiff_t row = grid.size.x(), layer = row * grid.size.y();
    const float* const d = grid.distance.data() + node;
    float largest = *d;
    for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i) {
                const std::ptrdiff_t e = i + j * row + k * layer;
                largest = std::max(largest, std::min(1.5F * d[0] - 0.5F * d[-e], 1.5F * d[e] - 0.5F * d[2 * e]));
            }
    return largest;
}

bool on_border(const Vector3i& at, const Vector3i& size)
{
    return (at.array() < border_width).any() || (at.array() >= size.array() - border_width).any();
}

}  // namespace

Throats::Throats(const sdf::DistanceGrid& grid) : size_(grid.size), origin_(grid.origin), spacing_(grid.spacing), radius_(grid.distance.size(), 0)
{
    step_ = double(*std::max_element(grid.distance.begin(), grid.distance.end())) / (levels - 1);
    if (!(step_ > 0.0)) return;
    const auto level_of = [&](float distance) { return std::uint8_t(std::clamp(double(distance) / step_, 0.0, levels - 1.0)); };
    // The widest ways first: a node is final when it comes out of the highest bucket that holds one.
    std::vector<std::uint8_t> room(radius_.size(), 0);
    std::array<std::vector<std::uint32_t>, levels> buckets;
    Vector3i at;
    std::size_t node = 0;
    for (at.z() = 0; at.z() < size_.z(); ++at.z())
        for (at.y() = 0; at.y() < size_.y(); ++at.y())
            for (at.x() = 0; at.x() < size_.x(); ++at.x(), ++node) {
                const bool border = on_border(at, size_);
                if (!border && double(grid.distance[node]) <= -spacing_) continue;  // nothing near it is open
                room[node] = level_of(border ? grid.distance[node] : largest_nearby(grid, node));
                if (!border || room[node] == 0) continue;
                radius_[node] = room[node];
                buckets[room[node]].push_back(std::uint32_t(node));
            }
    const std::array steps{std::ptrdiff_t(1), std::ptrdiff_t(size_.x()), std::ptrdiff_t(size_.x()) * size_.y()};
    const auto last = std::ptrdiff_t(radius_.size());
    for (int level = levels - 1; level > 0; --level)
        while (!buckets[level].empty()) {
            const auto from = std::ptrdiff_t(buckets[level].back());
            buckets[level].pop_back();
            for (const std::ptrdiff_t step : steps)
                for (const std::ptrdiff_t to : {from - step, from + step}) {
                    // All nodes of the border are known: no way leads around to the other side of the lattice.
                    if (to < 0 || to >= last || radius_[std::size_t(to)] != 0 || room[std::size_t(to)] == 0) continue;
                    const std::uint8_t narrowest = std::min(std::uint8_t(level), room[std::size_t(to)]);
                    radius_[std::size_t(to)] = narrowest;
                    buckets[narrowest].push_back(std::uint32_t(to));
                }
        }
}

double Throats::width(const Vector3d& point, double radius) const
{
    const Vector3d place = (point - origin_) / spacing_;
    const double reach = std::max(0.5 * radius / spacing_, 0.87);  // half the diagonal of a cell: one node at least
    const Vector3i low = (place.array() - reach).ceil().cast<int>().cwiseMax(0), high = (place.array() + reach).floor().cast<int>().cwiseMin(size_.array() - 1);
    std::uint8_t widest = 0;
    for (int k = low.z(); k <= high.z(); ++k)
        for (int j = low.y(); j <= high.y(); ++j)
            for (int i = low.x(); i <= high.x(); ++i)
                if ((Vector3d(i, j, k) - place).squaredNorm() <= reach * reach)
                    widest = std::max(widest, radius_[std::size_t(i) + std::size_t(size_.x()) * (std::size_t(j) + std::size_t(size_.y()) * std::size_t(k))]);
    return 2.0 * step_ * widest;
}

double ThroatLibrary::width(const dem::World& world, int body, const Vector3d& from_centre, double radius)
{
    const auto found = by_shape_.try_emplace(world.shape_id(body), world.shape(body).distance_grid()).first;
    const double scale = world.scale(body);
    return scale * found->second.width(world.orientation(body).conjugate() * from_centre / scale, radius / scale);
}

}  // namespace coral::suffusion
