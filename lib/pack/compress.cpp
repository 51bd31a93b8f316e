#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/error.h"
#include "core/progress.h"
#include "core/text.h"
#include "core/units.h"
#include "pack/detail/phases.h"

namespace coral::pack::detail {
namespace {

constexpr int steps_between_checks = 50;  ///< walls keep their velocity in between
constexpr int checks_per_window = 10;     ///< of the means that the stop rules look at
constexpr double lid_first = 0.05;        ///< side walls wait until the lid carries this share of the pressure
constexpr double deepest_overlap = 0.5;   ///< of the smaller radius; from here on forces are capped (dem::WorldOptions::overlap_cap)

void step_some(dem::World& world, double dt, double drag)
{
    for (int i = 0; i < steps_between_checks; ++i) {
        world.step(dt);
        if (i % 10 == 0) decay_velocities(world, drag, 10 * dt);
    }
}

[[noreturn]] void throw_deepest(const dem::World& world)
{
    const auto smaller = [&](const dem::Contact& c) {
        return std::min(world.equivalent_radius(c.first), c.second < 0 ? 1e300 : world.equivalent_radius(c.second));
    };
    const std::vector<dem::Contact> contacts = world.contacts();
    const dem::Contact& worst = *std::max_element(contacts.begin(), contacts.end(), [&](const dem::Contact& s, const dem::Contact& t) {
        return s.overlap / smaller(s) < t.overlap / smaller(t);
    });
    const auto name = [&](int body) {
        if (body < 0) return "wall " + std::to_string(-1 - body);
        return world.role(body) + " grain " + std::to_string(body) + " (diameter " + to_text(2e3 * world.equivalent_radius(body)) + " mm)";
    };
    throw Error("compression", name(worst.first) + " and " + name(worst.second) + " are pressed into each other by " +
                    std::to_string(int(100 * worst.overlap / smaller(worst))) + " % of the smaller radius, with a force of " + to_text(worst.normal_force.norm()) + " N",
                "lower the pressure, raise the void ratio, or raise normal_stiffness");
}

void check_sound(const dem::World& world, const Box& box)
{
    if (world.statistics().max_overlap > deepest_overlap) throw_deepest(world);
    for (int i = 0; i < world.body_count(); ++i) box.check_inside(world, i, i, "compression", "lower max_velocity or the pressure");
}

bool moves(const Box& box, const Compression& rule, int axis) { return box.has_planes(axis) && (axis == 2 || rule.walls == MovingWalls::all); }

double axis_pressure(const dem::World& world, const Box& box, int axis)
{
    return 0.5 * (box.pressure(world, 2 * axis) + box.pressure(world, 2 * axis + 1));
}

double total_mass(const dem::World& world)
{
    double sum = 0;
    for (int i = 0; i < world.body_count(); ++i) sum += world.mass(i);
    return sum;
}

double stiffest(const Spec& spec)
{
    double k = 0;
    for (const Material& m : spec.materials) k = std::max(k, m.normal_stiffness);
    return k;
}

double step_of(const dem::World& world, const Spec& spec) { return spec.dem_step > 0 ? spec.dem_step : world.auto_time_step(); }

/// Mean speed below which grains have landed [m/s]: forces are those of the skeleton and say nothing about loose fines.
double settled_speed(const dem::World& world, const Spec& spec)
{
    double smallest = 1e300;
    for (int i = 0; i < world.body_count(); ++i) smallest = std::min(smallest, 2 * world.equivalent_radius(i));
    return spec.dropping.speed_ratio * std::sqrt(spec.gravity.norm() * smallest);
}

void set_frictions(dem::World& world, const Spec& spec, double friction)
{
    for (std::size_t m = 0; m < spec.materials.size(); ++m)
        world.set_friction(int(m), friction >= 0 ? friction : spec.materials[m].friction);
}

/// Sets the speeds of all pairs for the next few steps. Returns the worst relative error of a pressure; `mean` is their mean.
double serve(dem::World& world, const Box& box, const Spec& spec, const std::array<int, 6>& contacts, double stiffness, double mass,
             PackState& state, double& mean)
{
    const Compression& rule = spec.compression;
    const Eigen::Vector3d size = box.upper(world) - box.lower(world);
    const bool both = rule.walls != MovingWalls::top;
    double worst = 0, pairs = 0;
    mean = 0;
    state.lid_touches = state.lid_touches || box.pressure(world, 5) > lid_first * rule.pressure;
    for (int axis = 0; axis < 3; ++axis) {
        if (!moves(box, rule, axis)) continue;
        // the top alone pushes against a bottom that also carries the weight
        const double p = both ? axis_pressure(world, box, axis) : box.pressure(world, 5);
        const double missing = rule.pressure - p;
        worst = std::max(worst, std::abs(missing) / rule.pressure);
        mean += p, pairs += 1;
        const int touching = std::min(contacts[std::size_t(2 * axis)], contacts[std::size_t(2 * axis + 1)]);
        const double share = servo_share(state.gains[std::size_t(axis)], missing, rule.tolerance * rule.pressure);
        const double speed = share * servo_speed(missing, box.area(world, axis), size[axis], touching, stiffness, mass, rule.max_velocity);
        set_pair_speed(world, box, axis, axis < 2 && !state.lid_touches ? 0.0 : speed, both);
    }
    mean /= pairs;
    return worst;
}

bool to_pressure(dem::World& world, const Box& box, const Spec& spec, Keeper& keeper, LapClock& clock)
{
    const Compression& rule = spec.compression;
    PackState& state = keeper.state;
    const double dt = step_of(world, spec), kn = stiffest(spec), mass = total_mass(world), slow = settled_speed(world, spec);
    state.own_friction = state.own_friction || rule.friction < 0;
    set_frictions(world, spec, state.own_friction ? -1 : rule.friction);
    Progress progress("compressing", 1);
    Approach approach;
    MotionWindow window(world);
    while (world.time() - state.start < rule.time_limit) {
        clock.lap();
        keeper.visit(world);
        double worst = 0, mean = 0;
        const auto contacts = box.contacts(world);
        window.start(world);
        for (int check = 0; check < checks_per_window; ++check) {
            double now = 0;
            worst = std::max(worst, serve(world, box, spec, contacts, kn, mass, state, now));
            mean += now / checks_per_window;
            step_some(world, dt, rule.drag);
        }
        check_sound(world, box);
        const MotionWindow::Means means = window.means(world);
        const double rest = std::max({worst / rule.tolerance, means.unbalanced_ratio / rule.unbalanced_ratio, means.kinetic_ratio / (10 * rule.kinetic_ratio), means.speed / slow});
        const double share = 0.7 * std::clamp(mean / rule.pressure, 0.0, 1.0) + (worst < 0.1 ? 0.3 * approach.share(rest) : 0.0);
        progress.update(std::clamp(share, (world.time() - state.start) / rule.time_limit, 0.99),
                        "mean pressure " + format_quantity(std::round(mean), Dimension::pressure) + ", " + describe(means));
        if (!state.own_friction && worst < 0.1) {
            set_frictions(world, spec, -1);
            state.own_friction = true;
        }
        if (state.own_friction && worst < rule.tolerance && means.unbalanced_ratio < rule.unbalanced_ratio && means.kinetic_ratio < 10 * rule.kinetic_ratio &&
            means.speed < slow) {
            progress.finish();
            return true;
        }
    }
    return false;
}

bool to_void_ratio(dem::World& world, const Box& box, const Spec& spec, double apparent_volume, Keeper& keeper, LapClock& clock)
{
    const Compression& rule = spec.compression;
    const double dt = step_of(world, spec), start = keeper.state.start, target = apparent_volume * (1 + rule.void_ratio);
    const double first = box.volume(world);
    if (first < target)
        throw Error("compression", "the poured sample has void ratio " + to_text(first / apparent_volume - 1) + ", below the target of " + to_text(rule.void_ratio),
                    "raise [dropping] friction or void_ratio");
    set_frictions(world, spec, rule.friction);
    Progress progress("compressing", 1);
    while (world.time() - start < rule.time_limit) {
        const Eigen::Vector3d size = box.upper(world) - box.lower(world);
        const double volume = box.volume(world), excess = volume / target - 1;
        if (excess < 1e-4) {
            progress.finish();
            return true;
        }
        clock.lap();
        keeper.visit(world);
        // relative closing rate of every moving edge; the last part takes a few hundred steps
        double edges = 0, longest = 0;
        for (int axis = 0; axis < 3; ++axis)
            if (moves(box, rule, axis)) edges += 1, longest = std::max(longest, size[axis]);
        const double rate = std::min(2 * rule.max_velocity / longest, excess / (edges * 500 * dt));
        for (int axis = 0; axis < 3; ++axis)
            if (moves(box, rule, axis)) set_pair_speed(world, box, axis, 0.5 * rate * size[axis], rule.walls != MovingWalls::top);
        step_some(world, dt, rule.drag);
        check_sound(world, box);
        progress.update(first > target ? std::min((first - volume) / (first - target), 0.99) : 0.99, "void ratio " + to_text(std::round(1e4 * (volume / apparent_volume - 1)) / 1e4));
    }
    return false;
}

}  // namespace

// The stiffness of the sample between the walls is that of its wall contacts in parallel, K_w, in series over n = gap/s layers with
// s = sqrt(A/contacts) the spacing of those contacts: K = K_w/n. The time constant is 2 sqrt(M/K): slower than the sample's own motion.
double servo_speed(double missing, double area, double gap, int wall_contacts, double stiffness, double mass, double limit)
{
    const int contacts = std::max(wall_contacts, 1);
    const double layers = std::max(gap / std::sqrt(area / contacts), 1.0);
    const double k = contacts * stiffness / layers;
    return std::clamp(missing * area / (2 * std::sqrt(k * mass)), -limit, limit);
}

double servo_share(ServoGain& gain, double missing, double allowed)
{
    constexpr double least = 1e-3, return_rate = 1.02;  // a share that was too small is forgotten within some hundred looks
    const bool swung = missing * gain.missing < 0 && std::min(std::abs(missing), std::abs(gain.missing)) > allowed;
    gain.share = swung ? std::max(0.5 * gain.share, least) : std::min(return_rate * gain.share, 1.0);
    gain.missing = missing;
    return gain.share;
}

void set_pair_speed(dem::World& world, const Box& box, int axis, double speed, bool both)
{
    const int low = box.plane[2 * std::size_t(axis)], high = box.plane[2 * std::size_t(axis) + 1];
    world.set_wall_velocity(low, both ? Eigen::Vector3d(speed * world.wall_normal(low)) : Eigen::Vector3d(Eigen::Vector3d::Zero()));
    world.set_wall_velocity(high, speed * (both ? 1.0 : 2.0) * world.wall_normal(high));
}

void stop_walls(dem::World& world, const Box& box)
{
    for (const int wall : box.plane)
        if (wall >= 0) world.set_wall_velocity(wall, Eigen::Vector3d::Zero());
}

std::string describe(const MotionWindow::Means& means)
{
    char text[80];
    std::snprintf(text, sizeof text, "unbalanced ratio %.2g, kinetic ratio %.1e", means.unbalanced_ratio, means.kinetic_ratio);
    return text;
}

double Approach::share(double ratio)
{
    if (!(ratio > 1)) return 1;
    first_ = std::max(first_, ratio);
    return 1 - std::log(ratio) / std::log(first_);
}

void compress(dem::World& world, const Box& box, const Spec& spec, double apparent_volume, Keeper& keeper)
{
    if (spec.compression.target == CompressionTarget::none) return;
    PackReport& report = keeper.state.report;
    LapClock clock(report.compression_seconds);
    report.compressed = spec.compression.target == CompressionTarget::pressure ? to_pressure(world, box, spec, keeper, clock)
                                                                               : to_void_ratio(world, box, spec, apparent_volume, keeper, clock);
    stop_walls(world, box);
}

MotionWindow::Means relax(dem::World& world, const Spec& spec, Keeper& keeper)
{
    PackReport& report = keeper.state.report;
    LapClock clock(report.relaxation_seconds);
    const Compression& rule = spec.compression;
    const double dt = step_of(world, spec), start = keeper.state.start;
    set_frictions(world, spec, -1);
    Progress progress("relaxing", 1);
    Approach approach;
    const double slow = settled_speed(world, spec);
    MotionWindow window(world);
    MotionWindow::Means means;
    report.relaxed = false;
    while (!report.relaxed && world.time() - start < rule.relaxation_limit) {
        clock.lap();
        keeper.visit(world);
        window.start(world);
        for (int check = 0; check < checks_per_window; ++check) step_some(world, dt, rule.drag);
        means = window.means(world);
        report.relaxed = means.unbalanced_ratio < rule.unbalanced_ratio && means.kinetic_ratio < rule.kinetic_ratio &&
                         means.speed < slow;
        const double rest = std::max({means.unbalanced_ratio / rule.unbalanced_ratio, means.kinetic_ratio / rule.kinetic_ratio, means.speed / slow});
        progress.update(std::min(std::max((world.time() - start) / rule.relaxation_limit, approach.share(rest)), 0.99), describe(means));
    }
    progress.finish();
    return means;
}

}  // namespace coral::pack::detail
