// Speed against error of the two shape models: spacing of the level set, degree of the harmonics.
#include "bench/grains.h"
#include "bench/table.h"
#include "sdf/mass_properties.h"
#include "sh/fit.h"

namespace {

using namespace coral;
using bench::heading;
using bench::line;
using bench::seconds;

/// Solid volume by counting points on a lattice of 50 um: the truth to 1e-4.
double true_volume()
{
    const bench::VoxelGrain fine(50e-6);
    double count = 0;
    for (std::uint8_t v : fine.voxels) count += v;
    return count * std::pow(50e-6, 3);
}

/// Points of the true surface: the outside away from the neck, and the wall of the void below it.
std::vector<Eigen::Vector3d> surface_points()
{
    std::vector<Eigen::Vector3d> points;
    const int n = 4000;
    for (int i = 0; i < n; ++i) {
        const double z = -1 + (2 * i + 1.0) / n, phi = i * std::numbers::pi * (3 - std::sqrt(5.0)), s = std::sqrt(1 - z * z);
        const Eigen::Vector3d u(s * std::cos(phi), s * std::sin(phi), z);
        if (z < 0.95) points.push_back(bench::grain_radius(u) * u);
        if (z < 0.7) points.push_back(Eigen::Vector3d(0, 0, 2e-3) + 2e-3 * u);
    }
    return points;
}

void level_sets(double truth)
{
    heading("Level set of a 15 mm grain with an open void, from voxels of 60 um: spacing against error and cost; `raw` without the shift that keeps the volume",
            {"spacing [um]", "volume error", "raw volume error", "surface rms [um]", "surface max [um]", "memory [MB]", "seconds"});
    const bench::VoxelGrain grain(60e-6);
    const auto points = surface_points();
    for (double spacing : {1.2e-4, 2e-4, 3e-4, 4e-4, 6e-4}) {
        sdf::DistanceGrid grid;
        sdf::LevelSetOptions options;
        options.spacing = spacing;
        const double time = seconds([&] { grid = sdf::level_set_from_mask(grain.mask, options); });
        options.keep_volume = false;
        const double raw = sdf::solid_volume(sdf::level_set_from_mask(grain.mask, options));
        double square = 0, worst = 0;
        for (const Eigen::Vector3d& p : points) {
            const double d = std::abs(grid.sample(p));
            square += d * d / static_cast<double>(points.size());
            worst = std::max(worst, d);
        }
        line({1e6 * spacing, sdf::solid_volume(grid) / truth - 1, raw / truth - 1, 1e6 * std::sqrt(square), 1e6 * worst, 4e-6 * static_cast<double>(grid.node_count()), time});
    }
}

void harmonics()
{
    heading("Spherical harmonics of the apparent shape of that grain: degree against error and cost",
            {"degree", "rms error", "max error", "volume error", "area error", "fit [s]"});
    // The void is filled: harmonics stand for the apparent shape.
    bench::VoxelGrain grain(100e-6);
    for (std::size_t at = 0; at < grain.voxels.size(); ++at) {
        const int n = grain.mask.size.x(), i = static_cast<int>(at) % n, j = static_cast<int>(at) / n % n, k = static_cast<int>(at) / n / n;
        const Eigen::Vector3d p = grain.mask.first_centre + 100e-6 * Eigen::Vector3d(i, j, k);
        grain.voxels[at] = p.norm() == 0 || p.norm() < bench::grain_radius(p.normalized());
    }
    const sdf::DistanceGrid grid = sdf::level_set_from_mask(grain.mask, {});
    const sh::FitReference reference(grid);
    for (int degree : {2, 4, 6, 8, 10, 15, 20}) {
        sh::RadialSamples samples;
        sh::Surface surface;
        const double time = seconds([&] {
            samples = sh::cast_rays(grid, degree);
            surface = sh::fit(samples, degree, reference.volume());
        });
        const sh::FitErrors errors = reference.errors(surface, samples);
        line({static_cast<double>(degree), errors.rms_error, errors.max_error, errors.volume_error, errors.area_error, time});
    }
}

}  // namespace

int main()
{
    const double truth = true_volume();
    level_sets(truth);
    harmonics();
}
