#include "csct2ls/convert.h"

#include <mutex>
#include <numeric>
#include <optional>

#include "core/error.h"
#include "core/parallel_within.h"
#include "core/progress.h"
#include "sdf/mesh_level_set.h"

namespace coral::csct2ls {
namespace {

sdf::GrainMask as_grain_mask(const morph::Mask& mask)
{
    const Eigen::Vector3d first = (mask.offset.cast<double>().array() + 0.5).matrix().cwiseProduct(mask.voxel_size);
    return {mask.size, mask.voxel_size, first, mask.voxels};
}

}  // namespace

sdf::GrainLevelSet convert(const Shapes& shapes, std::size_t g, const sdf::LevelSetOptions& options, Converted& converted)
{
    const morph::Mask solid = shapes.grains[g].solid.unpack(), apparent = shapes.grains[g].apparent.unpack();
    sdf::GrainLevelSet level_set = shapes.surfaces.empty()
                                       ? sdf::grain_from_masks(as_grain_mask(solid), as_grain_mask(apparent), options, &converted.report)
                                       : sdf::grain_from_mesh(shapes.surfaces[g], as_grain_mask(apparent), options, &converted.report);
    converted.voids = sdf::void_retention(as_grain_mask(solid), as_grain_mask(apparent), morph::void_classes(solid, apparent), level_set);
    converted.centre = level_set.centre;
    return level_set;
}

std::vector<Converted> convert_all(const Shapes& shapes, const std::vector<std::size_t>& which, const sdf::LevelSetOptions& options,
                                   const std::string& what, const std::function<void(std::size_t, sdf::GrainLevelSet&)>& take)
{
    std::vector<Converted> converted(which.size());
    std::vector<double> bytes;
    for (const std::size_t g : which) bytes.push_back(morph::working_bytes_per_voxel * double(shapes.grains[g].solid.count()));
    std::mutex lock;
    std::optional<Progress> progress;
    if (!what.empty()) progress.emplace(what, std::accumulate(bytes.begin(), bytes.end(), 0.0));
    double done = 0;
    parallel_within(shapes.budget, bytes, [&](std::size_t n) {
        try {
            sdf::GrainLevelSet level_set = convert(shapes, which[n], options, converted[n]);
            if (take) take(which[n], level_set);
        } catch (const Error& error) {
            throw Error("grain " + std::to_string(which[n] + 1) + " (label " + std::to_string(shapes.grains[which[n]].box.label) + ")", error.what());
        }
        const std::lock_guard guard(lock);
        done += bytes[n];
        if (progress) progress->update(done);
    });
    if (progress) progress->finish();
    return converted;
}

}  // namespace coral::csct2ls
