#include "sdf/extend.h"

#include <limits>

#include "core/error.h"
#include "sdf/detail/closest_point.h"

namespace coral::sdf {
namespace {

/// The grid on a lattice with `extra` more nodes on each side; new nodes get `outside`.
DistanceGrid grown(const DistanceGrid& grid, const Eigen::Vector3i& lower, const Eigen::Vector3i& upper, float outside)
{
    DistanceGrid result;
    result.spacing = grid.spacing;
    result.size = grid.size + lower + upper;
    result.origin = grid.origin - grid.spacing * lower.cast<double>();
    result.distance.assign(result.node_count(), outside);
    for (int k = 0; k < grid.size.z(); ++k)
        for (int j = 0; j < grid.size.y(); ++j)
            std::copy_n(grid.distance.data() + grid.index(0, j, k), grid.size.x(),
                        result.distance.data() + result.index(lower.x(), j + lower.y(), k + lower.z()));
    return result;
}

/// Box of the solid nodes, in node numbers.
void solid_box(const DistanceGrid& grid, Eigen::Vector3i& first, Eigen::Vector3i& last)
{
    first = grid.size;
    last = Eigen::Vector3i::Constant(-1);
    for (int k = 0; k < grid.size.z(); ++k)
        for (int j = 0; j < grid.size.y(); ++j)
            for (int i = 0; i < grid.size.x(); ++i)
                if (grid.distance[grid.index(i, j, k)] < 0) {
                    first = first.cwiseMin(Eigen::Vector3i(i, j, k));
                    last = last.cwiseMax(Eigen::Vector3i(i, j, k));
                }
}

}  // namespace

DistanceGrid extended(const DistanceGrid& grid, double outside_distance)
{
    if (std::min(grid.outside_limit, grid.inside_limit) < 2.0 * grid.spacing * (1 - 1e-6))
        throw Error("level set", "its band is narrower than 2 nodes, too narrow to extend", "write it with a wider band");
    Eigen::Vector3i first, last;
    solid_box(grid, first, last);
    if (last.x() < 0) throw Error("level set", "no solid node to extend from");

    // A surface lies less than one node beyond its outermost solid node; Catmull-Rom wants two more around it.
    const int reach = std::max(int(std::ceil(outside_distance / grid.spacing)) + 1, 3);
    const Eigen::Vector3i lower = (Eigen::Vector3i::Constant(reach) - first).cwiseMax(0);
    const Eigen::Vector3i upper = (last + Eigen::Vector3i::Constant(reach + 1) - grid.size).cwiseMax(0);
    const double outside = std::min(grid.outside_limit, std::numeric_limits<double>::max());
    DistanceGrid result = grown(grid, lower, upper, float(std::isfinite(grid.outside_limit) ? outside : 1e30));

    std::vector<std::uint8_t> solid(result.node_count()), keep(result.node_count());
    std::vector<float> values(result.node_count());  // in node spacings, for Newton's steps
    for (std::size_t n = 0; n < solid.size(); ++n) {
        const float d = result.distance[n];
        solid[n] = d < 0;
        keep[n] = d < 0 ? -d < grid.inside_limit * (1 - 1e-6) : d < std::min(outside, 1e29) * (1 - 1e-6);
        values[n] = float(std::min(d / grid.spacing, 1e6));
    }
    const detail::CubicField field{result.size, values.data()};
    const detail::Lattice nodes{result.size, Eigen::Vector3d::Zero(), 1.0};
    const auto project = [&field](Eigen::Vector3d& p, Eigen::Vector3d& normal) { return field.inside(p) && field.project(p, normal, 3); };
    const double everywhere = 1e15;
    detail::fill_distances(nodes, detail::find_foot_points(field), solid, keep, everywhere, everywhere, 1.0, grid.spacing, project,
                           result.distance);
    result.outside_limit = result.inside_limit = std::numeric_limits<double>::infinity();
    return result;
}

DistanceGrid part(const DistanceGrid& grid, const Eigen::Vector3i& low, const Eigen::Vector3i& high)
{
    DistanceGrid result;
    result.spacing = grid.spacing;
    result.outside_limit = grid.outside_limit;
    result.inside_limit = grid.inside_limit;
    result.size = high - low + Eigen::Vector3i::Ones();
    result.origin = grid.node(low.x(), low.y(), low.z());
    result.distance.reserve(result.node_count());
    for (int k = low.z(); k <= high.z(); ++k)
        for (int j = low.y(); j <= high.y(); ++j) {
            const auto row = grid.distance.begin() + std::ptrdiff_t(grid.index(low.x(), j, k));
            result.distance.insert(result.distance.end(), row, row + result.size.x());
        }
    return result;
}

DistanceGrid trimmed(const DistanceGrid& grid, int margin)
{
    Eigen::Vector3i low = grid.size, high = Eigen::Vector3i::Constant(-1);
    for (int k = 0; k < grid.size.z(); ++k)
        for (int j = 0; j < grid.size.y(); ++j)
            for (int i = 0; i < grid.size.x(); ++i) {
                if (grid.distance[grid.index(i, j, k)] > 0) continue;
                low = low.cwiseMin(Eigen::Vector3i(i, j, k));
                high = high.cwiseMax(Eigen::Vector3i(i, j, k));
            }
    if (high.x() < 0) return grid;
    return part(grid, (low.array() - margin).max(0), (high.array() + margin).min(grid.size.array() - 1));
}

}  // namespace coral::sdf
