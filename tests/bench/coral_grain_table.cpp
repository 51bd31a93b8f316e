// Level sets of synthetic coral grains: node spacing against what is lost of solid and voids, memory and time.
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "core/parallel.h"
#include "morph/apparent_shape.h"
#include "morph/components.h"
#include "phantom/grain.h"
#include "phantom/random.h"
#include "sdf/level_set.h"

namespace {

using namespace coral;
using Eigen::Vector3d;

/// Voxels of one grain of 8 mm with 30 % of voids, as in data/samples, and its apparent shape by the default ball.
struct Voxels {
    morph::Mask solid;
    morph::ApparentShape apparent;
};

Voxels image_grain(std::uint64_t number, double voxel)
{
    phantom::RandomSource random(1, number);
    phantom::GrainSpec spec;
    spec.outline.equivalent_diameter = 8e-3;
    spec.outline.sphericity = random.uniform(0.80, 0.95);
    const phantom::GrainImage image = phantom::Grain(spec, random).image(Vector3d::Constant(voxel), 1);
    Voxels out;
    out.solid = morph::make_mask(image.size, Vector3d::Constant(voxel));
    out.solid.voxels = image.solid;
    morph::keep_largest_component(out.solid);
    out.apparent = morph::close_with_ball(out.solid, morph::default_closing_radius(out.solid));
    return out;
}

sdf::GrainMask view(const morph::Mask& mask) { return {mask.size, mask.voxel_size, 0.5 * mask.voxel_size, mask.voxels}; }

struct Row {
    double solid = 0, voids = 0, lost_void = 0, lost_solid = 0, megabytes = 0, seconds = 0;
    int components = 0;
    bool limited = false;
};

/// Shares of the voxels of each phase that the level set gives to the other.
void compare_places(const Voxels& voxels, const sdf::GrainLevelSet& grain, Row& row)
{
    double solid = 0, voids = 0, lost_solid = 0, lost_void = 0;
    const morph::Mask& mask = voxels.solid;
    for (int k = 0; k < mask.size.z(); ++k)
        for (int j = 0; j < mask.size.y(); ++j)
            for (int i = 0; i < mask.size.x(); ++i) {
                const std::size_t v = mask.index(i, j, k);
                if (!voxels.apparent.apparent.voxels[v]) continue;
                const Vector3d x = (Eigen::Array3d(i, j, k) + 0.5).matrix().cwiseProduct(mask.voxel_size) - grain.centre;
                const bool is_solid = grain.solid.sample(x) < 0;
                (mask.voxels[v] ? solid : voids) += 1;
                if (mask.voxels[v] && !is_solid) ++lost_solid;
                if (!mask.voxels[v] && is_solid) ++lost_void;
            }
    row.lost_solid = lost_solid / solid;
    row.lost_void = lost_void / voids;
}

Row measure(const Voxels& voxels, double spacing)
{
    Row row;
    sdf::LevelSetReport report;
    sdf::LevelSetOptions options;
    options.spacing = spacing;
    const std::clock_t start = std::clock();
    const sdf::GrainLevelSet grain = sdf::grain_from_masks(view(voxels.solid), view(voxels.apparent.apparent), options, &report);
    row.seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
    const double voxel = voxels.solid.voxel_volume(), solid = double(voxels.apparent.solid) * voxel, filled = double(voxels.apparent.filled) * voxel;
    row.solid = grain.volume / solid - 1;
    row.voids = (grain.apparent_volume - grain.volume) / (filled - solid) - 1;
    row.megabytes = 4e-6 * double(grain.solid.node_count() + grain.apparent.node_count());
    row.components = report.solid_components;
    row.limited = report.shift_limited;
    compare_places(voxels, grain, row);
    return row;
}

}  // namespace

/// coral_grain_table [GRAINS [VOXEL_um]]
int main(int argc, char** argv)
{
    set_thread_count(1);
    const int grains = argc > 1 ? std::max(1, std::atoi(argv[1])) : 3;
    const double voxel = 1e-6 * (argc > 2 ? std::atof(argv[2]) : 30.0);
    std::printf("Coral-like grains of 8 mm, porosity 0.3, voxels of %g um; both level sets of a grain, one thread.\n\n"
                "| grain | voxels [10^6] | spacing [um] | solid %% | void volume %% | void taken for solid %% | solid taken for void %% | pieces | grids [MB] | CPU [s] |\n"
                "|---|---|---|---|---|---|---|---|---|---|\n",
                1e6 * voxel);
    for (int n = 0; n < grains; ++n) {
        const Voxels voxels = image_grain(std::uint64_t(n), voxel);
        for (const double spacing : {100e-6, 150e-6, 200e-6, 300e-6, 400e-6}) {
            const Row row = measure(voxels, spacing);
            std::printf("| %d | %.1f | %g | %+.3f%s | %+.2f | %.2f | %.2f | %d | %.1f | %.2f |\n", n + 1, 1e-6 * double(voxels.solid.count()), 1e6 * spacing,
                        100 * row.solid, row.limited ? " (shift limited)" : "", 100 * row.voids, 100 * row.lost_void, 100 * row.lost_solid, row.components,
                        row.megabytes, row.seconds);
            std::fflush(stdout);
        }
    }
}
