#include "sdf/level_set.h"

#include <array>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"
#include "sdf/detail/assembly.h"
#include "sdf/detail/closest_point.h"
#include "sdf/detail/occupancy.h"
#include "sdf/mass_properties.h"

namespace coral::sdf {
namespace {

using detail::OccupancyField;

/// Empty grid around the field's solid with room for the outside band, on the lattice of another grid when given.
DistanceGrid empty_grid(const OccupancyField& field, const LevelSetOptions& options, const DistanceGrid* lattice)
{
    const double h = options.spacing, margin = (options.outside_band + 1.5) * h;
    const Eigen::Vector3d lower = field.origin.array() - margin;
    const Eigen::Vector3d upper = field.origin.array() + field.step * (field.size.cast<double>().array() - 1.0) + margin;
    DistanceGrid grid;
    grid.spacing = h;
    grid.origin = lower;
    if (lattice)
        for (int axis = 0; axis < 3; ++axis)
            grid.origin[axis] = lattice->origin[axis] + h * std::floor((lower[axis] - lattice->origin[axis]) / h);
    grid.size = ((upper - grid.origin) / h).array().ceil().cast<int>() + 1;
    grid.distance.resize(grid.node_count());
    return grid;
}

/// Whether each node is solid: sign of the field's interpolant, as the foot points see it.
std::vector<std::uint8_t> node_signs(const detail::Lattice& lattice, const detail::CubicField& field)
{
    std::vector<std::uint8_t> solid(lattice.count(), 0);
    const std::size_t nx = std::size_t(lattice.size.x()), ny = std::size_t(lattice.size.y());
    parallel_blocks(lattice.count() / nx, 64, [&](std::size_t begin, std::size_t end) {
        Eigen::Vector3d gradient;
        for (std::size_t line = begin; line < end; ++line)
            for (std::size_t i = 0; i < nx; ++i) {
                const Eigen::Vector3d p = lattice.origin + lattice.step * Eigen::Vector3d(double(i), double(line % ny), double(line / ny));
                if (field.inside(p)) solid[line * nx + i] = field.value(p, gradient) < 0.0;
            }
    });
    return solid;
}

/// The shift within +-limit that gives the volume wanted (volume falls as the shift grows).
double shift_for_volume(const DistanceGrid& grid, double volume, double limit)
{
    // Only nodes near the surface change their share: the deep ones are counted once.
    DistanceGrid near{Eigen::Vector3i::Zero(), Eigen::Vector3d::Zero(), grid.spacing, {}};
    const float reach = float(1.5 * grid.spacing + limit);
    double deep = 0;
    for (const float d : grid.distance) {
        if (d <= -reach) deep += 1;
        else if (d < reach) near.distance.push_back(d);
    }
    near.size = Eigen::Vector3i(int(near.distance.size()), 1, 1);
    deep *= grid.spacing * grid.spacing * grid.spacing;
    double low = -limit, high = limit;
    if (deep + solid_volume(near, low) <= volume) return low;
    if (deep + solid_volume(near, high) >= volume) return high;
    for (int n = 0; n < 24; ++n) {
        const double middle = 0.5 * (low + high);
        (deep + solid_volume(near, middle) > volume ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

void check(const LevelSetOptions& options, const GrainMask& mask)
{
    if (!(options.smoothing >= 0.3 && options.smoothing <= 1.0))
        throw Error("level set", "smoothing of " + to_text(options.smoothing) + " voxels", "take 0.3 to 1; wider smoothing closes thin walls");
    if (!(options.inside_band >= 2.0 && options.outside_band >= 2.0))
        throw Error("level set", "a band narrower than 2 nodes", "take at least 2,2");
    if (!(options.spacing > 0)) throw Error("level set", "spacing must be positive");
    if (options.spacing < 0.5 * mask.voxel_size.minCoeff())
        throw Error("level set", "spacing is less than half a voxel", "a spacing of the voxel size or more invents no detail");
}

}  // namespace

namespace detail {

int count_components(const DistanceGrid& grid)
{
    std::vector<std::uint8_t> open(grid.node_count());
    for (std::size_t n = 0; n < open.size(); ++n) open[n] = grid.distance[n] < 0;
    std::vector<std::size_t> stack;
    const std::size_t nx = std::size_t(grid.size.x()), layer = nx * std::size_t(grid.size.y());
    int components = 0;
    for (std::size_t seed = 0; seed < open.size(); ++seed) {
        if (!open[seed]) continue;
        ++components;
        open[seed] = 0;
        stack.push_back(seed);
        while (!stack.empty()) {
            const std::size_t n = stack.back();
            stack.pop_back();
            // The outermost nodes are positive, so every neighbour exists.
            for (int c = -1; c <= 1; ++c)
                for (int b = -1; b <= 1; ++b)
                    for (int a = -1; a <= 1; ++a) {
                        const std::size_t m = n + std::size_t(a + std::ptrdiff_t(nx) * b + std::ptrdiff_t(layer) * c);
                        if (!open[m]) continue;
                        open[m] = 0;
                        stack.push_back(m);
                    }
        }
    }
    return components;
}

void clamp_to_band(DistanceGrid& grid, double shift, const LevelSetOptions& options)
{
    const float outside = float(options.outside_band * options.spacing), inside = float(options.inside_band * options.spacing);
    for (float& d : grid.distance) d = std::clamp(float(d + shift), -inside, outside);
    grid.outside_limit = outside;
    grid.inside_limit = inside;
}

void complete(GrainLevelSet& grain)
{
    const MassProperties body = mass_properties(grain.solid);
    if (!(body.volume > 0)) throw Error("level set", "the grain has no volume left on this spacing", "take a finer spacing");
    grain.volume = body.volume;
    grain.inertia = body.inertia;
    grain.centre = body.centroid;
    grain.solid.origin -= body.centroid;
    grain.apparent.origin -= body.centroid;
    grain.apparent_volume = solid_volume(grain.apparent);
    grain.equivalent_diameter = std::cbrt(6.0 * grain.apparent_volume / std::numbers::pi);
    grain.intraparticle_porosity = (grain.apparent_volume - grain.volume) / grain.apparent_volume;
}

}  // namespace detail

DistanceGrid level_set_from_mask(const GrainMask& mask, const LevelSetOptions& options, LevelSetReport* report, const DistanceGrid* lattice)
{
    check(options, mask);
    const OccupancyField occupancy = detail::smoothed_occupancy(mask, options.smoothing);
    const detail::CubicField field{occupancy.size, occupancy.values.data()};
    const double c = occupancy.step, h = options.spacing, largest_shift = 0.2 * c;
    DistanceGrid grid = empty_grid(occupancy, options, lattice);

    const detail::Lattice nodes{grid.size, (grid.origin - occupancy.origin) / c, h / c};
    const std::vector<detail::FootPoint> feet = detail::find_foot_points(field);
    if (feet.empty()) throw Error("level set", "the grain vanishes when smoothed", "leave out grains of a few voxels");
    const std::vector<std::uint8_t> solid = node_signs(nodes, field);
    // What is left after a Newton step goes with its square: after one of 0.02 voxel some 2e-4 times the curvature.
    const auto project = [&field](Eigen::Vector3d& p, Eigen::Vector3d& normal) { return field.inside(p) && field.project(p, normal, 3, 0.02); };
    detail::fill_distances(nodes, feet, solid, {}, (options.inside_band * h + largest_shift) / c + 0.01,
                           (options.outside_band * h + largest_shift) / c + 0.01, 1.0, c, project, grid.distance);

    const double voxel_volume = double(occupancy.solid_voxels) * mask.voxel_size.prod();
    const double shift = options.keep_volume ? shift_for_volume(grid, voxel_volume, largest_shift) : 0.0;
    detail::clamp_to_band(grid, shift, options);
    if (report) {
        report->voxel_volume = voxel_volume;
        report->volume = solid_volume(grid);
        report->shift = shift;
        report->shift_limited = std::abs(shift) >= largest_shift;
        report->foot_points = feet.size();
        report->voxels_smoothed_out = occupancy.smoothed_out;
        report->solid_components = detail::count_components(grid);
    }
    return grid;
}

GrainLevelSet grain_from_masks(const GrainMask& solid, const GrainMask& apparent, const LevelSetOptions& options,
                               LevelSetReport* solid_report, LevelSetReport* apparent_report)
{
    GrainLevelSet grain;
    grain.solid = level_set_from_mask(solid, options, solid_report);
    grain.apparent = level_set_from_mask(apparent, options, apparent_report, &grain.solid);
    detail::complete(grain);
    return grain;
}

}  // namespace coral::sdf
