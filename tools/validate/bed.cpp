#include "validate/bed.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace coral::validate {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

/// Spheres by cell of an edge of at least the diameter.
class CellList {
public:
    CellList(const std::vector<Vector3d>& points, const Vector3d& size, double edge) : count_((size / edge).cast<int>().cwiseMax(1)), cells_(std::size_t(count_.prod())), size_(size)
    {
        for (std::size_t p = 0; p < points.size(); ++p) cells_[index(cell_of(points[p]))].push_back(p);
    }
    /// Visits the spheres of the 27 cells around a point; in a box without period only those that are in it.
    template <class Visit>
    void around(const Vector3d& x, bool periodic, const Visit& visit) const
    {
        const Vector3i c = cell_of(x);
        for (int n = 0; n < 27; ++n) {
            Vector3i other = c + Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
            if (!periodic && ((other.array() < 0).any() || (other.array() >= count_.array()).any())) continue;
            other = (other + count_).array() - count_.array() * ((other + count_).array() / count_.array());
            for (const std::size_t p : cells_[index(other)]) visit(p);
        }
    }

private:
    Vector3i cell_of(const Vector3d& x) const
    {
        return (x.array() / size_.array() * count_.cast<double>().array()).cast<int>().matrix().cwiseMax(0).cwiseMin(count_ - Vector3i::Ones());
    }
    std::size_t index(const Vector3i& c) const { return std::size_t(c.x() + count_.x() * (c.y() + count_.y() * c.z())); }
    Vector3i count_;
    std::vector<std::vector<std::size_t>> cells_;
    Vector3d size_;
};

}  // namespace

std::vector<Vector3d> random_spheres(int count, double d, const Vector3d& size, bool periodic, unsigned seed)
{
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const auto inside = [&](Vector3d x) -> Vector3d {
        if (periodic) return x - (x.array() / size.array()).floor().matrix().cwiseProduct(size);
        return x.cwiseMax(Vector3d::Constant(0.5 * d)).cwiseMin(size - Vector3d::Constant(0.5 * d));
    };
    std::vector<Vector3d> x;
    for (int i = 0; i < count; ++i) {
        const double a = unit(random), b = unit(random), c = unit(random);
        x.push_back(inside(size.cwiseProduct(Vector3d(a, b, c))));
    }
    const double apart = 1.002 * d;  // aims a little wide, so that the last overlaps vanish
    for (double deepest = d; deepest > 1e-3 * d;) {
        deepest = 0;
        const CellList cells(x, size, apart);
        std::vector<Vector3d> moved = x;
        for (std::size_t a = 0; a < x.size(); ++a)
            cells.around(x[a], periodic, [&](std::size_t b) {
                Vector3d between = x[a] - x[b];
                if (periodic) between -= (between.array() / size.array()).round().matrix().cwiseProduct(size);
                const double distance = between.norm();
                if (a == b || distance >= apart) return;
                deepest = std::max(deepest, d - distance);
                moved[a] += 0.3 * (apart - distance) * between / std::max(distance, 1e-12 * d);
            });
        for (std::size_t a = 0; a < x.size(); ++a) x[a] = inside(moved[a]);
    }
    return x;
}

}  // namespace coral::validate
