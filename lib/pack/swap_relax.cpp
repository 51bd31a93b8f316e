// Relaxation of a sample whose grains have new shapes, and what it did.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/progress.h"
#include "core/text.h"
#include "pack/detail/phases.h"
#include "pack/detail/swap.h"
#include "pack/sample_world.h"

namespace coral::pack::detail {
namespace {

constexpr double deep = 0.01;              ///< overlap / diameter that counts as deep
constexpr double harmless_overlap = 1e-3;  ///< over the radius; what the sample had may be more
constexpr int iterations_of_fines = 300, iterations_of_all = 300;
constexpr int steps_between_checks = 100;

std::string percent(double share) { return to_text(std::round(1000 * share) / 10) + " %"; }

/// Evaluates contacts as they stand: bodies at rest, springs as given.
void evaluate(dem::World& world) { world.relax(1e300, 0); }

Overlaps overlaps(const dem::World& world)
{
    Overlaps result;
    for (const dem::Contact& c : world.contacts()) {
        double d = 2 * world.equivalent_radius(c.first);
        if (c.second >= 0) d = std::min(d, 2 * world.equivalent_radius(c.second));
        ++result.contacts;
        result.deep += c.overlap > deep * d;
        result.largest = std::max(result.largest, c.overlap / d);
    }
    return result;
}

struct Balance {
    double unbalanced_ratio = 0, kinetic_ratio = 0;
};

Balance balance(const dem::World& world)
{
    std::vector<char> touching(std::size_t(world.body_count()), 0);
    double contact_force = 0, count = 0, net = 0, grains = 0;
    for (const dem::Contact& c : world.contacts()) {
        contact_force += c.normal_force.norm();
        count += 1;
        touching[std::size_t(c.first)] = 1;
        if (c.second >= 0) touching[std::size_t(c.second)] = 1;
    }
    for (int i = 0; i < world.body_count(); ++i) {
        if (!touching[std::size_t(i)]) continue;
        net += (world.contact_forces()[std::size_t(i)] + world.mass(i) * world.gravity()).norm();
        grains += 1;
    }
    const dem::Energy energy = world.energy();
    const double elastic = energy.elastic_normal + energy.elastic_tangential;
    Balance b;
    if (contact_force > 0) b.unbalanced_ratio = net / grains / (contact_force / count);
    if (elastic > 0) b.kinetic_ratio = energy.kinetic / elastic;
    return b;
}

/// Largest difference of contact forces over the largest force.
double change_of_forces(const dem::World& a, const dem::World& b)
{
    if (a.body_count() != b.body_count()) return 1;
    double change = 0, largest = 0;
    for (std::size_t i = 0; i < a.contact_forces().size(); ++i) {
        change = std::max(change, (a.contact_forces()[i] - b.contact_forces()[i]).norm());
        largest = std::max(largest, a.contact_forces()[i].norm());
    }
    return largest > 0 ? change / largest : change;
}

dem::World world_of(const Sample& sample, SampleIds& ids)
{
    dem::WorldOptions options;
    options.gravity = sample.gravity;
    dem::World world(options);
    ids = add_sample(world, sample);
    restore_springs(world, sample, ids);
    return world;
}

void set_coarse(dem::World& world, const Sample& sample, dem::Motion motion)
{
    for (std::size_t i = 0; i < sample.particles.size(); ++i)
        if (sample.particles[i].role == Role::coarse) world.set_motion(int(i), motion);
}

void settle(dem::World& world, const Sample& sample, const SwapOptions& options, SwapReport& report)
{
    const double dt = world.auto_time_step();
    double smallest = 1e300;
    for (const Particle& p : sample.particles) smallest = std::min(smallest, equivalent_diameter(sample, p));
    const double drag = 200 * std::sqrt(std::max(sample.gravity.norm(), 1.0) / smallest);
    Progress progress("relaxing", options.max_steps);
    while (!report.relaxed && report.steps < options.max_steps) {
        for (int i = 0; i < steps_between_checks; ++i) {
            world.step(dt);
            if (i % 10 == 9) decay_velocities(world, drag, 10 * dt);
        }
        report.steps += steps_between_checks;
        const Balance b = balance(world);
        report.relaxed = b.unbalanced_ratio < 0.05 && b.kinetic_ratio < 1e-4;
        progress.update(double(report.steps), "unbalanced ratio " + to_text(std::round(1e4 * b.unbalanced_ratio) / 1e4));
    }
    progress.finish();
}

void measure_displacements(const dem::World& world, const Sample& sample, const std::vector<char>& moved_out, double limit, SwapReport& report)
{
    double coarse = 0, fines = 0;
    for (std::size_t i = 0; i < sample.particles.size(); ++i) {
        if (moved_out[i]) continue;
        const bool fine = sample.particles[i].role == Role::fine;
        const double way = (world.position(int(i)) - sample.particles[i].position).norm() / equivalent_diameter(sample, sample.particles[i]);
        Displacement& d = fine ? report.fine : report.coarse;
        d.mean += way;
        d.largest = std::max(d.largest, way);
        (fine ? fines : coarse) += 1;
        report.pushed_fines += fine && way > limit;
    }
    if (coarse > 0) report.coarse.mean /= coarse;
    if (fines > 0) report.fine.mean /= fines;
}

/// Refuses what would burst the sample, or is no longer the same sample.
void check(const dem::World& world, const Box& box, const SwapOptions& options, const SwapReport& report)
{
    const std::string help = report.trapped.empty() || options.drop_trapped ? "take shapes nearer to the old ones (a higher --degree, more --faces), or raise the limit"
                                                                           : "add --drop-trapped, or take shapes nearer to the old ones";
    if (report.after.largest > options.overlap_limit)
        throw Error("swap", "grains still overlap by " + percent(report.after.largest) + " of the smaller diameter after the relaxation (" +
                                percent(report.swapped.largest) + " before it; --overlap-limit is " + percent(options.overlap_limit) + ")", help);
    if (report.coarse.largest > options.limit)
        throw Error("swap", "the skeleton does not hold: a coarse grain moved by " + percent(report.coarse.largest) + " of its diameter (--limit is " + percent(options.limit) + ")", help);
    if (report.fine.mean > options.limit)
        throw Error("swap", "fine grains moved by " + percent(report.fine.mean) + " of their diameter on average (--limit is " + percent(options.limit) + ")", help);
    const Eigen::Vector3d lower = box.lower(world), upper = box.upper(world);
    for (int i = 0; i < world.body_count(); ++i)
        if (!((world.position(i).array() > lower.array()).all() && (world.position(i).array() < upper.array()).all()))
            throw Error("swap", "grain " + std::to_string(i) + " was pushed through a wall", help);
}

}  // namespace

void relax_swapped(Sample& sample, const Sample& before, const std::vector<char>& moved_out, const SwapOptions& options, SwapReport& report)
{
    report.pressure_before = before.statistics.mean_pressure;
    SampleIds ids;
    dem::World old = world_of(before, ids), world = world_of(sample, ids);
    evaluate(old);
    evaluate(world);
    const double allowed = std::max(2 * old.statistics().max_overlap, harmless_overlap);
    report.before = overlaps(old);
    report.swapped = overlaps(world);
    const bool moved = std::find(moved_out.begin(), moved_out.end(), 1) != moved_out.end();
    if (!moved && change_of_forces(old, world) < 1e-9) {
        report.unchanged = report.relaxed = true;
        report.after = report.swapped;
        report.pressure_after = report.pressure_before;
        report.unbalanced_ratio = balance(old).unbalanced_ratio;
        report.kinetic_energy = before.statistics.kinetic_energy;
        return;
    }
    set_coarse(world, sample, dem::Motion::fixed);
    report.iterations = world.relax(allowed, iterations_of_fines);
    set_coarse(world, sample, dem::Motion::free);
    report.iterations += world.relax(allowed, iterations_of_all);
    settle(world, sample, options, report);

    const Balance b = balance(world);
    report.unbalanced_ratio = b.unbalanced_ratio;
    report.kinetic_energy = world.statistics().kinetic_energy;
    report.after = overlaps(world);
    measure_displacements(world, sample, moved_out, options.limit, report);
    const Box box{ids.walls.front()};
    check(world, box, options, report);
    if (!report.relaxed)
        report.warnings.push_back("the damped run ended after " + std::to_string(report.steps) + " steps with an unbalanced ratio of " +
                                  to_text(std::round(1e4 * b.unbalanced_ratio) / 1e4) + "; raise --steps");
    evaluate(world);  // leaves the grains at rest: what moves is the drag's, not the sample's
    MotionWindow::Means rest;
    rest.unbalanced_ratio = b.unbalanced_ratio;
    rest.kinetic_ratio = b.kinetic_ratio;
    measure(world, box, rest, world.auto_time_step(), std::int64_t(before.statistics.dem_steps) + world.counters().steps, sample);
    report.pressure_after = sample.statistics.mean_pressure;
}

}  // namespace coral::pack::detail
