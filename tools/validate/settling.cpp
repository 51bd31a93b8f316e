// Free bodies through the whole solver, contact included, as suffuse runs them: a light sphere, two spheres, a grain of coral sand.
#include <fmt/format.h>

#include <numbers>

#include "core/table.h"
#include "suffusion/simulation.h"
#include "validate/check.h"

namespace coral::validate {

namespace {

using Eigen::Vector3d;
using suffusion::Case;
using suffusion::Simulation;

/// A closed box of liquid.
Case closed_box(const Vector3d& size, double cell, double density, double kinematic_viscosity)
{
    Case c;
    c.domain.emplace();
    c.domain->cell = cell;
    c.domain->cells = (size / cell).array().round().cast<int>();
    c.domain->size = c.domain->cells.cast<double>() * cell;
    for (suffusion::FaceCondition& face : c.boundary) face.kind = suffusion::BoundaryKind::wall;
    c.fluid.emplace();
    c.fluid->density = density;
    c.fluid->kinematic_viscosity = kinematic_viscosity;
    suffusion::MaterialSpec material;
    material.normal_stiffness = 2e3, material.tangential_stiffness = 1e3, material.friction = 0.2;
    c.materials["default"] = material;
    return c;
}

suffusion::BodySpec sphere(double diameter, const Vector3d& position, double density)
{
    suffusion::BodySpec body;
    body.shape = suffusion::ShapeKind::sphere;
    body.diameter = diameter;
    body.position = position;
    body.density = density;
    body.scheme = suffusion::Scheme::resolved;
    body.location = "validate";
    return body;
}

struct Track {
    std::vector<double> time;
    std::vector<Vector3d> position, velocity;
    double peak = 0, momentum_error = 0, seconds = 0;
};

/// Runs until `end` or until stop(simulation) says so, and follows the first bodies.
template <class Stop>
std::vector<Track> follow(Case c, double end, const Stop& stop)
{
    const double begin = processor_seconds();
    c.time.duration = end;
    c.output.interval = end;
    c.fluid->precision = precision;
    Simulation simulation(suffusion::build_scene(std::move(c)));
    std::vector<Track> tracks(simulation.scene().bodies.size());
    while (simulation.time() < end && !stop(simulation)) {
        simulation.step(end);
        for (std::size_t b = 0; b < tracks.size(); ++b) {
            Track& track = tracks[b];
            track.time.push_back(simulation.time());
            track.position.push_back(simulation.scene().world.position(static_cast<int>(b)));
            track.velocity.push_back(simulation.scene().world.velocities()[b]);
            track.peak = std::max(track.peak, std::abs(track.velocity.back().z()));
            track.momentum_error = std::max(track.momentum_error, simulation.balance().momentum);
        }
    }
    for (Track& track : tracks) track.seconds = processor_seconds() - begin;
    return tracks;
}

void write_tracks(const std::filesystem::path& file, const std::vector<Track>& tracks)
{
    Table table{{"time", "body", "x", "y", "z", "vx", "vy", "vz"}, {}};
    const std::size_t stride = std::max<std::size_t>(1, tracks[0].time.size() / 400);
    for (std::size_t n = 0; n < tracks[0].time.size(); n += stride)
        for (std::size_t b = 0; b < tracks.size(); ++b) {
            const Vector3d &x = tracks[b].position[n], &v = tracks[b].velocity[n];
            table.add({tracks[b].time[n], static_cast<long long>(b), x.x(), x.y(), x.z(), v.x(), v.y(), v.z()});
        }
    table.write(file);
}

}  // namespace

/// A sphere of half the liquid's density rises as fast, in the end, as one of one and a half times it sinks: turned over, the steady problems are the same.
std::vector<Check> rising_sphere(const StudyOptions& options)
{
    std::vector<Check> checks;
    const double d = 0.01, nu = 4e-5, rho = 1000;
    for (const int cells : {6, 9, 12, 16}) {
        if (cells > 12 && !options.heavy) continue;
        const auto fall = [&](double ratio) {
            Case c = closed_box({4 * d, 4 * d, 16 * d}, d / cells, rho, nu);
            c.bodies.push_back(sphere(d, {2.013 * d, 1.987 * d, ratio < 1 ? 2 * d : 14 * d}, ratio * rho));
            return follow(std::move(c), 1.0, [&](const Simulation& s) {
                const double z = s.scene().world.position(0).z();
                return ratio < 1 ? z > 13 * d : z < 3 * d;
            })[0];
        };
        const Track heavy = fall(1.5), light = fall(0.5);
        write_tracks(options.output / fmt::format("rising-sphere-{}.csv", cells), {light});
        checks.push_back({"light sphere rising, greatest speed", "m/s", heavy.peak, light.peak, cells < 9 ? shown_only : 0.01, true, "heavy one sinking", cells * 1.0, light.seconds + heavy.seconds});
        checks.push_back({"light sphere rising, momentum balance", "1", 0, light.momentum_error, balance_tolerance(1e-8), false, "conservation", cells * 1.0, light.seconds});
    }
    return checks;
}

/// Drafting, kissing, tumbling: two equal spheres one above the other. The one behind catches up in the wake, they touch, the pair turns across and parts.
/// What follows contact is a bifurcation: the order of events is checked, times are shown.
std::vector<Check> two_spheres(const StudyOptions& options)
{
    std::vector<Check> checks;
    const double d = 1e-2 / 6;
    double kissing_before = 0, across_before = 0;
    for (const int cells : {6, 8, 10, 12}) {
        if (cells > 8 && !options.heavy) continue;
        Case c = closed_box({6 * d, 6 * d, 24 * d}, d / cells, 1000, 1e-6);
        c.bodies.push_back(sphere(d, {3 * d, 3 * d, 19 * d}, 1140));
        c.bodies.push_back(sphere(d, {3.05 * d, 3 * d, 20.5 * d}, 1140));
        const std::vector<Track> tracks = follow(std::move(c), 0.9, [&](const Simulation& s) { return std::min(s.scene().world.position(0).z(), s.scene().world.position(1).z()) < 0.8 * d; });
        write_tracks(options.output / fmt::format("two-spheres-{}.csv", cells), tracks);
        double kissing = 0, across = 0, apart = 0, drafting = 0;
        for (std::size_t n = 0; n < tracks[0].time.size(); ++n) {
            const Vector3d r = tracks[1].position[n] - tracks[0].position[n];
            const double t = tracks[0].time[n];
            if (!drafting && -tracks[1].velocity[n].z() > -1.02 * tracks[0].velocity[n].z() && -tracks[0].velocity[n].z() > 0.01) drafting = t;
            if (!kissing && r.norm() < 1.02 * d) kissing = t;
            if (kissing > 0 && !across && std::abs(r.z()) < 0.5 * r.norm()) across = t;
            if (across > 0 && !apart && r.norm() > 1.3 * d) apart = t;
        }
        const bool in_order = 0 < drafting && drafting < kissing && kissing < across && across < apart;
        const double seconds = tracks[0].seconds;
        checks.push_back({"drafts, kisses, tumbles and parts, in this order", "1", 1, in_order ? 1. : 0., 0, false, "Fortes, Joseph & Lundgren 1987", cells * 1.0, seconds});
        checks.push_back({"time of kissing", "s", kissing_before > 0 ? kissing_before : kissing, kissing, shown_only, true, "the coarser run", cells * 1.0, seconds});
        checks.push_back({"time of lying across (60 deg from the fall)", "s", across_before > 0 ? across_before : across, across, shown_only, true, "the coarser run", cells * 1.0, seconds});
        checks.push_back({"momentum balance", "1", 0, std::max(tracks[0].momentum_error, tracks[1].momentum_error), balance_tolerance(1e-8), false, "conservation", cells * 1.0, seconds});
        kissing_before = kissing, across_before = across;
    }
    return checks;
}

/// The paper's settling test: a grain with its voids, 15 mm, 1200 kg/m3, in water in a box of 50 mm, from 20 mm above the floor to a diameter above it.
std::vector<Check> coral_grain(const StudyOptions& options)
{
    std::vector<Check> checks;
    if (options.grains.empty()) return checks;
    std::vector<double> speeds, cell_sizes;
    for (const int cells_across : {45, 67, 100, 133}) {
        if (cells_across > 100 && !options.heavy) continue;
        const double cell = 0.05 / cells_across;
        Case c = closed_box({0.05, 0.05, 0.05}, cell, 1000, 1e-6);
        c.materials["default"].normal_stiffness = 2e4, c.materials["default"].tangential_stiffness = 1e4;
        suffusion::BodySpec grain = sphere(0, {0.0251, 0.0249, 0.035}, 1200);
        grain.shape = suffusion::ShapeKind::level_set;
        grain.file = std::filesystem::absolute(options.grains);
        grain.grid = "grain_1";
        grain.scale = 1;
        Case probe = c;
        probe.bodies = {grain};
        grain.scale = 0.015 / suffusion::build_scene(std::move(probe))->bodies[0].diameter;
        c.bodies = {grain};
        const Track track = follow(std::move(c), 0.6, [](const Simulation& s) { return s.scene().world.position(0).z() < 0.015; })[0];
        write_tracks(options.output / fmt::format("coral-grain-{}.csv", cells_across), {track});
        // speed when it has sunk by half a diameter: the body no longer starts, and is not braked by the floor yet
        double speed = 0;
        for (std::size_t n = 0; n < track.time.size() && track.position[n].z() > 0.0275; ++n) speed = -track.velocity[n].z();
        speeds.push_back(speed), cell_sizes.push_back(cell);
        const double before = speeds.size() > 1 ? speeds[speeds.size() - 2] : speed;
        checks.push_back({"coral grain, speed half a diameter down", "m/s", before, speed, shown_only, true, "the coarser run", 0.015 / cell, track.seconds});
        checks.push_back({"coral grain, momentum balance", "1", 0, track.momentum_error, balance_tolerance(1e-8), false, "conservation", 0.015 / cell, track.seconds});
    }
    if (speeds.size() < 3) return checks;
    // Aitken over the last three, whose cells shrink by nearly the same factor
    const std::size_t n = speeds.size() - 1;
    const double a = speeds[n - 2] - speeds[n - 1], b = speeds[n - 1] - speeds[n];
    const double order = std::log(std::abs(a / b)) / std::log(cell_sizes[n - 1] / cell_sizes[n]);
    checks.push_back({"coral grain, change from the last refinement", "1", 0, std::abs(b) / speeds[n], 0.03, false, "three resolutions", 0.015 / cell_sizes[n]});
    checks.push_back({"coral grain, order of convergence", "1", 2, order, shown_only, true, "three resolutions", 0.015 / cell_sizes[n]});
    return checks;
}

}  // namespace coral::validate
