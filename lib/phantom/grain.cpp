#include "phantom/grain.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "phantom/components.h"

namespace coral::phantom {

namespace {
enum State : std::uint8_t { outside, solid, empty };

/// Extent of the rotated outline along the stack axes [m].
void bounds(const Outline& outline, const Eigen::Matrix3d& rotation, Eigen::Vector3d& low, Eigen::Vector3d& high)
{
    low.setConstant(std::numeric_limits<double>::infinity());
    high = -low;
    for (const auto& p : outline.surface_points()) {
        const Eigen::Vector3d q = rotation * p;
        low = low.cwiseMin(q);
        high = high.cwiseMax(q);
    }
}

std::vector<std::uint8_t> sample(const Outline& outline, const Voids& voids, const Lattice& lattice)
{
    std::vector<std::uint8_t> state(lattice.count(), outside);
    const WaveField::OnLattice waves(voids.field(), lattice);
    parallel_blocks(lattice.size.z(), 1, [&](std::size_t begin, std::size_t end) {
        std::vector<float> field(lattice.size.x());
        for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k) {
            for (int j = 0; j < lattice.size.y(); ++j) {
                waves.row(j, k, field);
                for (int i = 0; i < lattice.size.x(); ++i) {
                    const Eigen::Vector3d p = lattice.point(i, j, k);
                    const double depth = outline.depth(p);
                    if (depth < 0) continue;
                    state[lattice.index(i, j, k)] = voids.is_void(p, depth, field[i]) ? empty : solid;
                }
            }
        }
    });
    return state;
}

/// Solid that hangs free inside a void is no part of a grain: it becomes void. Keeps the largest piece.
void drop_islands(std::vector<std::uint8_t>& state, const Eigen::Vector3i& size)
{
    std::vector<std::int32_t> piece;
    const auto counts = label_pieces(state, solid, size, true, piece);
    const auto largest = std::max_element(counts.begin(), counts.end()) - counts.begin();
    for (std::size_t n = 0; n < state.size(); ++n) {
        if (state[n] == solid && piece[n] != largest) state[n] = empty;
    }
}

/// Void pieces: open when a point of theirs has a neighbour outside the outline.
void count_voids(const std::vector<std::uint8_t>& state, const Eigen::Vector3i& size, double point_volume,
                 std::size_t least_points, Truth& truth)
{
    std::vector<std::int32_t> piece;
    const auto counts = label_pieces(state, empty, size, false, piece);
    std::vector<bool> open(counts.size(), false);
    const std::size_t steps[3] = {1, static_cast<std::size_t>(size.x()), static_cast<std::size_t>(size.x()) * size.y()};
    for (std::size_t n = 0; n < state.size(); ++n) {
        if (piece[n] == 0) continue;  // the box has a margin of outside points, so that neighbours exist
        for (const std::size_t step : steps) {
            if (state[n - step] == outside || state[n + step] == outside) open[piece[n]] = true;
        }
    }
    for (std::size_t v = 1; v < counts.size(); ++v) {
        (open[v] ? truth.open_void_volume : truth.closed_void_volume) += point_volume * static_cast<double>(counts[v]);
        if (counts[v] < least_points) continue;
        ++truth.void_count;
        ++(open[v] ? truth.open_void_count : truth.closed_void_count);
    }
}
}  // namespace

Grain::Grain(const GrainSpec& spec, RandomSource& random)
    : outline_(std::make_unique<Outline>(spec.outline, random)),
      voids_(std::make_unique<Voids>(spec.voids, *outline_, random)),
      rotation_(random.rotation())
{
    for (double& s : shift_) s = random.uniform();
}

GrainImage Grain::image(const Eigen::Vector3d& voxel_size, int supersample) const
{
    Eigen::Vector3d low, high;
    bounds(*outline_, rotation_, low, high);
    constexpr int margin = 1;
    GrainImage result;
    result.size = ((high - low).cwiseQuotient(voxel_size) + shift_).array().ceil().cast<int>() + 2 * margin;
    const Eigen::Vector3d corner = low - voxel_size.cwiseProduct(shift_ + Eigen::Vector3d::Constant(margin));

    Lattice lattice;
    lattice.frame = rotation_.transpose();
    lattice.step = voxel_size / supersample;
    lattice.origin = corner + 0.5 * lattice.step;
    lattice.size = result.size * supersample;
    std::vector<std::uint8_t> state = sample(*outline_, *voids_, lattice);
    drop_islands(state, lattice.size);

    const std::size_t voxels = static_cast<std::size_t>(result.size.x()) * result.size.y() * result.size.z();
    result.solid.assign(voxels, 0);
    result.apparent.assign(voxels, 0);
    result.fraction.assign(voxels, 0.0f);
    Truth& truth = result.truth;
    const double points_per_voxel = std::pow(supersample, 3);
    const int middle = supersample / 2;
    std::size_t solid_points = 0, n = 0;
    Eigen::Vector3d first_moment = Eigen::Vector3d::Zero();
    for (int k = 0; k < lattice.size.z(); ++k) {
        for (int j = 0; j < lattice.size.y(); ++j) {
            for (int i = 0; i < lattice.size.x(); ++i, ++n) {
                if (state[n] == outside) continue;
                const std::size_t voxel =
                    (static_cast<std::size_t>(k / supersample) * result.size.y() + j / supersample) * result.size.x() +
                    i / supersample;
                result.apparent[voxel] = 1;
                if (state[n] != solid) continue;
                ++solid_points;
                first_moment += Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5);
                result.fraction[voxel] += static_cast<float>(1 / points_per_voxel);
                if (i % supersample == middle && j % supersample == middle && k % supersample == middle)
                    result.solid[voxel] = 1;
            }
        }
    }
    const double point_volume = lattice.step.prod();
    result.centre = lattice.step.cwiseProduct(first_moment) / static_cast<double>(solid_points);
    truth.volume = point_volume * static_cast<double>(solid_points);
    truth.apparent_volume = outline_->volume();
    truth.equivalent_diameter = outline_->equivalent_diameter();
    truth.surface_area = outline_->area();
    truth.sphericity = outline_->sphericity();
    truth.intraparticle_porosity = (truth.apparent_volume - truth.volume) / truth.apparent_volume;
    count_voids(state, lattice.size, point_volume, static_cast<std::size_t>(8 * points_per_voxel), truth);
    for (const auto& c : voids_->channels()) truth.throat_diameters.push_back(2 * c.throat_radius);
    for (const auto& c : voids_->chambers()) truth.chamber_radii.push_back(c.radius);
    return result;
}

}  // namespace coral::phantom
