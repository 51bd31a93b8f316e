// Relaxation of a sample whose grains have new shapes, and what it did.
#include <algorithm>
#include <array>
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
constexpr int iterations_of_fines = 100, iterations_of_all = 300, rounds = 4;
constexpr int steps_between_checks = 100;
constexpr double least_overlap_limit = 0.05;  ///< over the diameter; a sample that is pressed harder may stay so
constexpr double fastest_wall = 0.02;  ///< [m/s]
constexpr double pressure_tolerance = 0.05;

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

/// Overlap over the smaller radius at which fines are free enough: what one contact in a hundred of the old sample had. Its deepest is no measure, a
/// single fine that is wedged in.
double usual_overlap(const dem::World& old)
{
    std::vector<double> depths;
    for (const dem::Contact& c : old.contacts()) {
        double r = old.equivalent_radius(c.first);
        if (c.second >= 0) r = std::min(r, old.equivalent_radius(c.second));
        depths.push_back(c.overlap / r);
    }
    if (depths.empty()) return harmless_overlap;
    const auto at = depths.begin() + std::ptrdiff_t(depths.size() - 1 - depths.size() / 100);
    std::nth_element(depths.begin(), at, depths.end());
    return std::max(*at, harmless_overlap);
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
    dem::World world(world_options(sample));
    ids = add_sample(world, sample);
    restore_springs(world, sample, ids);
    return world;
}

void set_coarse(dem::World& world, const Sample& sample, dem::Motion motion)
{
    for (std::size_t i = 0; i < sample.particles.size(); ++i)
        if (sample.particles[i].role == Role::coarse) world.set_motion(int(i), motion);
}

/// Grains that touch something with more than their weight: they belong to the skeleton, others lie loose.
std::vector<char> loaded_grains(const Sample& sample)
{
    std::vector<double> force(sample.particles.size(), 0);
    std::vector<int> contacts(sample.particles.size(), 0);
    for (const Contact& c : sample.contacts)
        for (const int i : {c.first, c.second})
            if (i >= 0) force[std::size_t(i)] += c.normal_force.norm(), ++contacts[std::size_t(i)];
    std::vector<char> loaded;
    for (std::size_t i = 0; i < force.size(); ++i)
        loaded.push_back(contacts[i] > 1 && force[i] > 2 * mass(sample, sample.particles[i]) * sample.gravity.norm());
    return loaded;
}

/// Fines out of overlaps while coarse grains are held: pushed, turned anew where pushing does not do, and so on.
void free_fines(dem::World& world, Replaced& swapped, double allowed, SwapReport& report)
{
    Sample turned = swapped.sample;
    std::vector<char> is_drawn(turned.particles.size(), 0);
    for (const std::size_t i : swapped.drawn) is_drawn[i] = 1;
    for (int round = 0;; ++round) {
        report.iterations += world.relax(allowed, iterations_of_fines);
        if (round == rounds || world.statistics().max_overlap <= allowed) return;
        std::vector<char> deep_in(turned.particles.size(), 0);
        for (const dem::Contact& c : world.contacts()) {
            double r = world.equivalent_radius(c.first);
            if (c.second >= 0) r = std::min(r, world.equivalent_radius(c.second));
            if (c.overlap <= allowed * r) continue;
            deep_in[std::size_t(c.first)] = 1;
            if (c.second >= 0) deep_in[std::size_t(c.second)] = 1;
        }
        std::vector<std::size_t> again;
        for (std::size_t i = 0; i < turned.particles.size(); ++i) {
            turned.particles[i].position = world.position(int(i));
            turned.particles[i].orientation = world.orientation(int(i));
            if (deep_in[i] && is_drawn[i]) again.push_back(i);
        }
        if (again.empty()) return;
        turn_to_fit(turned, again, swapped.random);
        for (const std::size_t i : again) world.set_pose(int(i), turned.particles[i].position, turned.particles[i].orientation);
    }
}

/// Walls close in or give way until each pair has the pressure it had.
class WallServo {
public:
    WallServo(const dem::World& world, const Box& box, const Sample& before) : box_(box)
    {
        const std::array planes{"x-", "x+", "y-", "y+", "z-", "z+"};
        for (const Wall& wall : before.walls)
            for (std::size_t w = 0; w < planes.size(); ++w)
                if (wall.name == planes[w]) pressure_[w] = wall.pressure;
        mean_ = before.statistics.mean_pressure;
        for (int i = 0; i < world.body_count(); ++i) mass_ += world.mass(i);
        for (const Material& m : before.materials) stiffness_ = std::max(stiffness_, m.normal_stiffness);
    }

    /// Sets the speeds; returns the largest relative error of a pressure.
    double serve(dem::World& world)
    {
        const Eigen::Vector3d size = box_.upper(world) - box_.lower(world);
        const auto contacts = box_.contacts(world);
        double worst = 0;
        for (int axis = 0; axis < 3; ++axis) {
            if (!box_.has_planes(axis)) continue;
            const std::size_t low = 2 * std::size_t(axis), high = low + 1;
            const bool both = axis < 2;  // the bottom also carries the weight
            const double wanted = both ? 0.5 * (pressure_[low] + pressure_[high]) : pressure_[high];
            const double now = both ? 0.5 * (box_.pressure(world, int(low)) + box_.pressure(world, int(high))) : box_.pressure(world, int(high));
            worst = std::max(worst, std::abs(wanted - now) / std::max(wanted, 0.1 * mean_));
            const double share = servo_share(gains_[std::size_t(axis)], wanted - now, pressure_tolerance * std::max(wanted, 0.1 * mean_));
            const double speed = share * servo_speed(wanted - now, box_.area(world, axis), size[axis], std::min(contacts[low], contacts[high]), stiffness_, mass_, fastest_wall);
            set_pair_speed(world, box_, axis, speed, both);
        }
        return worst;
    }

private:
    Box box_;
    std::array<double, 6> pressure_{};
    std::array<ServoGain, 3> gains_;
    double mass_ = 0, stiffness_ = 0, mean_ = 0;
};

void settle(dem::World& world, const Sample& sample, const Sample& before, const Box& box, const std::vector<char>& loaded, const SwapOptions& options, SwapReport& report)
{
    const double dt = world.auto_time_step();
    double smallest = 1e300;
    for (const Particle& p : sample.particles) smallest = std::min(smallest, equivalent_diameter(sample, p));
    const double drag = 200 * std::sqrt(std::max(sample.gravity.norm(), 1.0) / smallest);
    // what lay loose would only fall into the gaps that angular shapes leave under it: it is held up until the next tool sets it free
    for (std::size_t i = 0; i < loaded.size(); ++i)
        if (!loaded[i] && sample.particles[i].role == Role::fine) world.set_external_force(int(i), -world.mass(int(i)) * world.gravity(), Eigen::Vector3d::Zero());
    WallServo servo(world, box, before);
    Progress progress("relaxing", options.max_steps);
    double worst = 0;
    while (!report.relaxed && report.steps < options.max_steps) {
        if (options.restore_pressure) worst = servo.serve(world);
        for (int i = 0; i < steps_between_checks; ++i) {
            world.step(dt);
            if (i % 10 == 9) decay_velocities(world, drag, 10 * dt);
        }
        report.steps += steps_between_checks;
        const Balance b = balance(world);
        report.relaxed = b.unbalanced_ratio < 0.05 && b.kinetic_ratio < 1e-4 && worst < pressure_tolerance;
        progress.update(double(report.steps), "unbalanced ratio " + to_text(std::round(1e4 * b.unbalanced_ratio) / 1e4));
    }
    stop_walls(world, box);
    world.clear_external_forces();
    progress.finish();
}

Displacement displacement(std::vector<double> ways)
{
    Displacement d;
    if (ways.empty()) return d;
    std::sort(ways.begin(), ways.end());
    for (const double way : ways) d.mean += way / double(ways.size());
    d.median = 0.5 * (ways[(ways.size() - 1) / 2] + ways[ways.size() / 2]);
    d.largest = ways.back();
    d.grains = int(ways.size());
    return d;
}

void measure_displacements(const dem::World& world, const Sample& sample, const std::vector<char>& moved_out, const std::vector<char>& loaded, double limit, SwapReport& report)
{
    std::vector<double> coarse, fines, carrying;
    for (std::size_t i = 0; i < sample.particles.size(); ++i) {
        if (moved_out[i]) continue;
        const double way = (world.position(int(i)) - sample.particles[i].position).norm() / equivalent_diameter(sample, sample.particles[i]);
        if (sample.particles[i].role == Role::coarse) {
            coarse.push_back(way);
            continue;
        }
        fines.push_back(way);
        if (loaded[i]) carrying.push_back(way);
        report.pushed_fines += way > limit;
    }
    report.coarse = displacement(std::move(coarse));
    report.fine = displacement(std::move(fines));
    report.loaded_fine = displacement(std::move(carrying));
}

/// Overlap over the smaller diameter above which a swap is refused.
double deepest_allowed(const SwapOptions& options, const SwapReport& report)
{
    return options.overlap_limit > 0 ? options.overlap_limit : std::max(least_overlap_limit, 2 * report.before.largest);
}

/// Fines that are still deeper than allowed in a grain or a wall; of two fines the smaller.
std::vector<char> wedged_fines(const dem::World& world, const Sample& sample, double allowed)
{
    std::vector<char> wedged(sample.particles.size(), 0);
    const auto is_fine = [&](int i) { return i >= 0 && sample.particles[std::size_t(i)].role == Role::fine; };
    for (const dem::Contact& c : world.contacts()) {
        double d = 2 * world.equivalent_radius(c.first);
        if (c.second >= 0) d = std::min(d, 2 * world.equivalent_radius(c.second));
        if (c.overlap <= allowed * d) continue;
        const bool second = is_fine(c.second) && (!is_fine(c.first) || world.equivalent_radius(c.second) < world.equivalent_radius(c.first));
        if (second || is_fine(c.first)) wedged[std::size_t(second ? c.second : c.first)] = 1;
    }
    return wedged;
}

/// Refuses what would burst the sample, or is no longer the same sample.
void check(const dem::World& world, const Box& box, const SwapOptions& options, const SwapReport& report)
{
    const std::string help = options.drop_trapped ? "take shapes nearer to the old ones (a higher --degree, more --faces), or raise the limit"
                                                                           : "add --drop-trapped, or take shapes nearer to the old ones";
    const double deepest = deepest_allowed(options, report);
    if (report.after.largest > deepest)
        throw Error("swap", "grains still overlap by " + percent(report.after.largest) + " of the smaller diameter after the relaxation (" +
                                percent(report.swapped.largest) + " before it; --overlap-limit is " + percent(deepest) + ")", help);
    if (report.coarse.largest > options.limit)
        throw Error("swap", "the skeleton does not hold: a coarse grain moved by " + percent(report.coarse.largest) + " of its diameter (--limit is " + percent(options.limit) + ")", help);
    if (report.fine.mean > options.limit)
        throw Error("swap", "fine grains moved by " + percent(report.fine.mean) + " of their diameter on average (--limit is " + percent(options.limit) + ")", help);
    for (int i = 0; i < world.body_count(); ++i) box.check_inside(world, i, i, "swap", help.c_str());
}

}  // namespace

std::vector<char> relax_swapped(Replaced& swapped, const Sample& before, const std::vector<char>& moved_out, const SwapOptions& options, SwapReport& report)
{
    Sample& sample = swapped.sample;
    report.pressure_before = before.statistics.mean_pressure;
    SampleIds ids;
    dem::World old = world_of(before, ids), world = world_of(sample, ids);
    evaluate(old);
    evaluate(world);
    const Box box(sample, ids.walls);
    report.before = overlaps(old);
    report.swapped = overlaps(world);
    const bool moved = std::find(moved_out.begin(), moved_out.end(), 1) != moved_out.end();
    if (!moved && change_of_forces(old, world) < 1e-9) {
        report.unchanged = report.relaxed = true;
        report.after = report.swapped;
        report.pressure_after = report.pressure_before;
        report.unbalanced_ratio = balance(old).unbalanced_ratio;
        report.kinetic_energy = before.statistics.kinetic_energy;
        return std::vector<char>(sample.particles.size(), 0);
    }
    const std::vector<char> loaded = loaded_grains(before);
    set_coarse(world, sample, dem::Motion::fixed);
    free_fines(world, swapped, usual_overlap(old), report);
    set_coarse(world, sample, dem::Motion::free);
    // the skeleton moves only where it is deeper in itself than before; what is left is for the damped run
    report.iterations += world.relax(std::max(2 * old.statistics().max_overlap, harmless_overlap), iterations_of_all);
    settle(world, sample, before, box, loaded, options, report);

    const Balance b = balance(world);
    report.unbalanced_ratio = b.unbalanced_ratio;
    report.kinetic_energy = world.statistics().kinetic_energy;
    report.after = overlaps(world);
    measure_displacements(world, sample, moved_out, loaded, options.limit, report);
    report.strain = (before.size - (box.upper(world) - box.lower(world))).cwiseQuotient(before.size);
    std::vector<char> wedged = wedged_fines(world, sample, deepest_allowed(options, report));
    if (options.drop_trapped && std::find(wedged.begin(), wedged.end(), 1) != wedged.end()) return wedged;
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
    return wedged;
}

}  // namespace coral::pack::detail
