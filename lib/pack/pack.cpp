#include "pack/pack.h"

#include <chrono>

#include "core/text.h"
#include "pack/criteria.h"
#include "pack/detail/phases.h"
#include "pack/sample_world.h"

namespace coral::pack {
namespace {

/// Smooth walls around the poured grains; the lid touches the highest bounding sphere.
std::vector<Wall> box_walls(const Eigen::Vector3d& size)
{
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    return {{"x-", zero, Eigen::Vector3d::UnitX()},  {"x+", size, -Eigen::Vector3d::UnitX()}, {"y-", zero, Eigen::Vector3d::UnitY()},
            {"y+", size, -Eigen::Vector3d::UnitY()}, {"z-", zero, Eigen::Vector3d::UnitZ()},  {"z+", size, -Eigen::Vector3d::UnitZ()}};
}

}  // namespace

Sample pack(const Spec& spec, std::uint64_t seed, PackReport& report)
{
    const auto clock = std::chrono::steady_clock::now();
    report = {};
    report.warnings = spec.warnings;
    Grains grains = make_grains(spec, seed);
    report.loading_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - clock).count();
    detail::pour(grains, spec, seed, report);

    Sample& sample = grains.sample;
    sample.walls = box_walls(sample.size);
    dem::WorldOptions options;
    options.gravity = spec.gravity;
    dem::World world(options);
    const SampleIds ids = add_sample(world, sample);
    const detail::Box box{ids.walls.front()};
    // contacts have just become stiffer: what overlap the soft ones held would burst the packing
    constexpr double harmless_overlap = 2e-4;
    world.relax(harmless_overlap, 200);
    double apparent = 0;
    for (const Particle& p : sample.particles) apparent += apparent_volume(sample, p);
    detail::compress(world, box, spec, apparent, report);
    const detail::MotionWindow::Means rest = detail::relax(world, spec, report);
    report.steps += world.counters().steps;
    report.simulated_time += world.time();
    if (report.unsettled_layers > 0)
        report.warnings.push_back(std::to_string(report.unsettled_layers) + " of " + std::to_string(report.layers) +
                                  " batches hit [dropping] time_limit before they had settled");
    detail::measure(world, box, rest, spec.dem_step > 0 ? spec.dem_step : world.auto_time_step(), report.steps, sample);
    if (spec.density) {
        report.relative_density = relative_density(sample.statistics.void_ratio, spec.density->e_min, spec.density->e_max);
        if (report.relative_density < 0 || report.relative_density > 1)
            report.warnings.push_back("relative density " + to_text(100 * report.relative_density) + " %: the void ratio lies outside [density] e_min and e_max");
    }
    return std::move(sample);
}

}  // namespace coral::pack
