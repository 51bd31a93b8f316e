#include "pack/pack.h"

#include "core/error.h"
#include "core/text.h"
#include "core/units.h"
#include "pack/criteria.h"
#include "pack/detail/keeper.h"
#include "pack/detail/phases.h"
#include "pack/sample_world.h"

namespace coral::pack {
namespace {

void collect_warnings(const Spec& spec, PackReport& report)
{
    report.warnings = spec.warnings;
    if (!report.compressed)
        report.warnings.push_back("the compression ended at its time limit of " + to_text(spec.compression.time_limit) +
                                  " s before its target was met; raise [compression] time_limit or tolerance");
    if (!report.relaxed)
        report.warnings.push_back("the final relaxation ended at its time limit of " + to_text(spec.compression.relaxation_limit) +
                                  " s; raise [compression] relaxation_limit");
    if (report.unsettled_layers > 0)
        report.warnings.push_back(std::to_string(report.unsettled_layers) + " of " + std::to_string(report.layers) +
                                  " batches hit [dropping] time_limit before they had settled");
    if (report.relative_density < 0 || report.relative_density > 1)
        report.warnings.push_back("relative density " + to_text(100 * report.relative_density) + " %: the void ratio lies outside [density] e_min and e_max");
}

/// Refuses a step that the compression would refuse after all of the pouring.
void check_step(const Spec& spec, const Sample& sample)
{
    if (spec.dem_step <= 0 || spec.force_step) return;
    dem::World world(world_options(sample));
    add_sample(world, sample);
    constexpr double highest = 1.5;  // of the critical steps; World::step refuses more
    const double critical = world.critical_time_step();
    if (spec.dem_step > highest * critical)
        throw UsageError(spec.step_location, "key 'time.dem_step': " + format_quantity(spec.dem_step, Dimension::time) + " is above 1.5 of the critical step, " +
                                                 format_quantity(critical, Dimension::time) + " of the lightest grain",
                         "write \"auto\" (" + format_quantity(world.auto_time_step(), Dimension::time) + "), or force_step = true beside it");
}

/// All phases from where the keeper stands.
Sample pack(const Spec& spec, std::uint64_t seed, detail::Keeper& keeper)
{
    PackState& state = keeper.state;
    PackReport& report = state.report;
    Grains grains = [&] {
        const detail::LapClock clock(report.loading_seconds);
        return make_grains(spec, seed, [&] { keeper.visit(); });
    }();
    grains.sample.size = spec.size;
    grains.sample.period = spec.period;
    grains.sample.gravity = spec.gravity;
    check_step(spec, grains.sample);
    if (!keeper.skips(Phase::pouring)) detail::pour(grains, spec, seed, keeper);

    Sample& sample = grains.sample;
    sample.walls = detail::walls_around(spec, sample.size.z());  // the lid touches the highest bounding sphere
    dem::WorldOptions options = world_options(sample);
    options.sphere_scheme = spec.sphere_scheme;
    options.force_step = spec.force_step;
    dem::World world(options);
    const SampleIds ids = add_sample(world, sample);
    const detail::Box box(sample, ids.walls);
    if (keeper.skips(Phase::pouring)) {
        keeper.restore(world);
    } else {
        // contacts have just become stiffer: what overlap the soft ones held would burst the packing
        constexpr double harmless_overlap = 2e-4;
        world.relax(harmless_overlap, 200);
        state.phase = Phase::compression;
        state.start = world.time();
    }
    if (state.phase == Phase::compression) {
        double apparent = 0;
        for (const Particle& p : sample.particles) apparent += apparent_volume(sample, p);
        detail::compress(world, box, spec, apparent, keeper);
        state.phase = Phase::relaxation;
        state.start = world.time();
    }
    const detail::MotionWindow::Means rest = detail::relax(world, spec, keeper);
    report.steps += world.counters().steps;
    report.simulated_time += world.time();
    detail::measure(world, box, rest, spec.dem_step > 0 ? spec.dem_step : world.auto_time_step(), report.steps, sample);
    if (spec.density) report.relative_density = relative_density(sample.statistics.void_ratio, spec.density->e_min, spec.density->e_max);
    collect_warnings(spec, report);
    return std::move(sample);
}

}  // namespace

Sample pack(const Spec& spec, std::uint64_t seed, PackReport& report, const PackControl& control)
{
    detail::Keeper keeper(control, spec, seed);
    Sample sample;
    try {
        sample = pack(spec, seed, keeper);
    } catch (const detail::Stopped&) {
        keeper.state.report.interrupted = true;
    }
    report = keeper.state.report;
    return sample;
}

}  // namespace coral::pack
