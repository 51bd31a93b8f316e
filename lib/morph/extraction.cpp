#include "morph/extraction.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "core/parallel_within.h"

namespace coral::morph {
namespace {

double sphere_diameter(double volume) { return std::cbrt(6.0 / std::numbers::pi * volume); }

double least_diameter(const ExtractionOptions& options, const Eigen::Vector3d& voxel_size)
{
    return options.minimum_diameter > 0 ? options.minimum_diameter : 8.0 * voxel_size.maxCoeff();
}

/// One grain measured, or the reason why it is dropped.
struct Outcome {
    std::optional<Grain> grain;
    DropReason reason = DropReason::small;
};

Outcome measure_label(const VoxelValues& labels, const Eigen::Vector3i& size, const Eigen::Vector3d& voxel_size,
                      const LabelBox& box, const ExtractionOptions& options)
{
    const double least = least_diameter(options, voxel_size);
    // No shape in a box is larger than the box: the cheap test spares most specks the work.
    const double box_volume = (box.high - box.low).cast<double>().cwiseProduct(voxel_size).prod();
    if (box.touches_border && !options.keep_border) return {{}, DropReason::border};
    if (box.voxels < options.minimum_voxels || sphere_diameter(box_volume) < least) return {{}, DropReason::small};

    Outcome outcome;
    outcome.grain = measure_grain(cut_out(labels, size, voxel_size, box), options, outcome.reason);
    if (outcome.grain) outcome.grain->box = box;
    return outcome;
}

}  // namespace

std::optional<Grain> measure_grain(Mask solid, const ExtractionOptions& options, DropReason& reason)
{
    Grain grain;
    grain.islands = keep_largest_component(solid);
    const double radius = options.closing_radius > 0 ? options.closing_radius : default_closing_radius(solid);
    ApparentShape closed = close_with_ball(solid, radius, options.list_voids ? &grain.voids : nullptr);
    const double diameter = sphere_diameter(double(closed.filled) * solid.voxel_volume());
    reason = DropReason::small;
    if (closed.solid < options.minimum_voxels || diameter < least_diameter(options, solid.voxel_size)) return {};
    try {
        grain.shape = measure(solid, closed);
    } catch (const Error&) {  // no surface left, or all of it in one plane
        reason = DropReason::thin;
        return {};
    }
    if (options.scale_to > 0) grain.scale = options.scale_to / diameter;
    grain.shape = scaled(grain.shape, grain.scale);
    for (Void& v : grain.voids) v = scaled(v, grain.scale);
    solid.voxel_size *= grain.scale;
    closed.apparent.voxel_size *= grain.scale;
    grain.solid = PackedMask(solid);
    grain.apparent = PackedMask(closed.apparent);
    return grain;
}

Descriptors scaled(Descriptors d, double factor)
{
    const double area = factor * factor, volume = area * factor;
    d.volume *= volume;
    d.apparent_volume *= volume;
    d.surface_area *= area;
    d.apparent_surface_area *= area;
    d.equivalent_diameter *= factor;
    d.largest_throat *= factor;
    d.closing_radius *= factor;
    return d;
}

Extraction extract_grains(const VoxelValues& labels, const Eigen::Vector3i& size, const Eigen::Vector3d& voxel_size,
                          const ExtractionOptions& options, const std::function<void(double)>& done)
{
    const std::vector<LabelBox> boxes = label_boxes(labels, size);
    std::vector<double> bytes;
    for (const LabelBox& box : boxes) bytes.push_back(working_bytes_per_voxel * (box.high - box.low).cast<double>().prod());
    const double budget = std::max(0.7 * double(labels.size()), 256.0 * 1024 * 1024);

    std::vector<Outcome> outcomes(boxes.size());
    std::mutex report;
    double finished = 0;
    parallel_within(budget, bytes, [&](std::size_t i) {
        outcomes[i] = measure_label(labels, size, voxel_size, boxes[i], options);
        if (!done) return;
        const std::lock_guard lock(report);
        done(finished += double(boxes[i].voxels));
    });

    Extraction out;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        if (outcomes[i].grain) out.grains.push_back(std::move(*outcomes[i].grain));
        else out.dropped.push_back({boxes[i], outcomes[i].reason});
    }
    std::stable_sort(out.grains.begin(), out.grains.end(), [](const Grain& a, const Grain& b) { return a.shape.volume > b.shape.volume; });
    return out;
}

}  // namespace coral::morph
