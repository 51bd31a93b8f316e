#include "suffusion/simulation.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "suffusion/bytes.h"

namespace coral::suffusion {

using Eigen::Vector3d;

namespace {

constexpr double grain_cells = 0.1;                    ///< farthest move of a grain in a flow step [cells; docs/numerics.md]
constexpr int dry_substeps = 256;                      ///< contact steps between two looks at the outside
constexpr double speed_bound = 1e3;                    ///< [m/s]: beyond it a run has blown up

bool has_coupled_fines(const Scene& scene)
{
    return std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyInfo& body) { return body.scheme != Scheme::resolved; });
}

fluid::TimeScheme flow_scheme(const Scene& scene)
{
    using fluid::TimeScheme;
    const TimeSpec& time = scene.description.time;
    bool staged = time.flow_scheme == FlowScheme::runge_kutta;
    if (time.flow_scheme == FlowScheme::automatic) staged = has_coupled_fines(scene) && time.cfl <= fluid::max_cfl(TimeScheme::runge_kutta);
    return staged ? TimeScheme::runge_kutta : TimeScheme::adams_bashforth;
}

fluid::FlowOptions flow_options(const Scene& scene)
{
    const Case& c = scene.description;
    fluid::FlowOptions options;
    options.density = c.fluid->density;
    options.kinematic_viscosity = c.fluid->kinematic_viscosity;
    options.body_acceleration = c.fluid->body_acceleration;
    options.scheme = flow_scheme(scene);
    options.precision = c.fluid->precision;
    options.cfl = c.time.cfl;
    options.max_time_step = c.time.max_step;
    return options;
}

}  // namespace

fluid::GridSpec grid_of(const Case& c)
{
    fluid::GridSpec grid;
    grid.cells = c.domain->cells;
    grid.cell = c.domain->cell;
    grid.origin = c.domain->origin;
    for (int face = 0; face < 6; ++face) {
        const FaceCondition& from = c.boundary[face];
        grid.boundary[face] = {static_cast<fluid::BoundaryKind>(from.kind), from.velocity, from.pressure};
    }
    return grid;
}

Simulation::Simulation(std::unique_ptr<Scene> scene) : scene_(std::move(scene))
{
    static_assert(static_cast<int>(BoundaryKind::periodic) == static_cast<int>(fluid::BoundaryKind::periodic));
    const Stopwatch watch(timing_.setup);
    const Case& c = scene_->description;
    eroded_.assign(scene_->bodies.size(), 0);
    dem_step_ = c.time.dem_step > 0 ? c.time.dem_step : scene_->world.auto_time_step();
    if (!std::isfinite(dem_step_)) dem_step_ = c.time.duration / dry_substeps;  // nothing moves freely
    if (!c.fluid) return;
    const fluid::GridSpec grid = grid_of(c);
    flow_.emplace(grid, flow_options(*scene_));
    if (c.fluid->initial_velocity.norm() > 0) flow_->set_velocity([&](const Vector3d&, int axis) { return c.fluid->initial_velocity[axis]; });
    grains_.emplace(*scene_, grid);
    grains_->place(*scene_);
    fines_.emplace(*scene_, grid);
    check_inlet();
}

/// An inlet behind solid cells has nowhere to send its flow.
void Simulation::check_inlet() const
{
    if (grains_->empty()) return;
    const Case& c = scene_->description;
    for (int face = 0; face < 6; ++face) {
        if (c.boundary[face].kind != BoundaryKind::inlet) continue;
        const int axis = face / 2, other = (axis + 1) % 3, third = (axis + 2) % 3;
        Eigen::Vector3i cell;
        cell[axis] = face % 2 == 0 ? 0 : c.domain->cells[axis] - 1;
        double open = 0;
        for (cell[other] = 0; cell[other] < c.domain->cells[other]; ++cell[other])
            for (cell[third] = 0; cell[third] < c.domain->cells[third]; ++cell[third])
                open += 1 - solid_fraction(flow_->layout().index(cell.x(), cell.y(), cell.z()));
        if (open < 1e-3 * c.domain->cells[other] * c.domain->cells[third])
            throw UsageError(std::string("boundary.\"") + face_names[face] + "\"", "the inlet is closed: solid covers it",
                             "move the grains or the plate away from the face");
    }
}

double Simulation::next_flow_step(double remaining) const
{
    double dt = flow_->stable_time_step();
    const double cell = scene_->description.domain->cell;
    const double grain_speed = grains_->max_speed(*scene_);
    if (grain_speed > 0) dt = std::min(dt, grain_cells * cell / grain_speed);
    dt = std::min(dt, fines_->longest_step(*scene_, cell));
    if (dt < 1e-9 * scene_->description.time.max_step)
        throw Error("t = " + to_text(time_) + " s", "the flow step collapsed to " + to_text(dt) + " s",
                    "look at the last frame; a lower cfl, a finer dem_step or softer contacts may help");
    return fluid::fit_time_step(dt, remaining);
}

void Simulation::flow_step(double event)
{
    const double dt = next_flow_step(event - time_);
    {
        const Stopwatch watch(timing_.fines);
        if (!fines_->empty()) fines_->deposit(*flow_, dt, *scene_, grains_->empty() ? nullptr : &grains_->immersed().cell_solid_fraction());
    }
    {
        const Stopwatch watch(timing_.flow);
        flow_->predict(dt);
    }
    {
        const Stopwatch watch(timing_.fines);
        if (!fines_->empty()) fines_->give_forces(*flow_, dt, *scene_);
    }
    {
        const Stopwatch watch(timing_.grains);
        grains_->measure(*flow_, dt, *scene_);
    }
    {
        const Stopwatch watch(timing_.contact);
        if (!scene_->bodies.empty()) scene_->world.advance(dt, dem_step_);
    }
    Vector3d owed;
    {
        const Stopwatch watch(timing_.grains);
        if (!fines_->empty()) fines_->learn(dt, *scene_);
        owed = grains_->apply(*flow_, dt, *scene_);
    }
    {
        const Stopwatch watch(timing_.flow);
        flow_->project(dt);
    }
    last_step_ = dt;
    time_ = dt >= (event - time_) * (1 - 1e-12) ? event : time_ + dt;
    book_balance(owed);
    sort_out_leavers();
    const Stopwatch watch(timing_.grains);
    grains_->place(*scene_);
}

void Simulation::contact_step(double event)
{
    const Stopwatch watch(timing_.contact);
    const double dt = fluid::fit_time_step(dry_substeps * dem_step_, event - time_);
    scene_->world.advance(dt, dem_step_);
    last_step_ = dt;
    time_ = dt >= (event - time_) * (1 - 1e-12) ? event : time_ + dt;
    sort_out_leavers();
}

void Simulation::step(double event)
{
    if (flow_) flow_step(event);
    else contact_step(event);
    ++steps_;
    check_motion();
}

void Simulation::check_motion() const
{
    double fastest = flow_ ? flow_->mass().velocity_scale : 0;
    const std::span<const Vector3d> velocities = scene_->world.velocities();
    for (std::size_t i = 0; i < velocities.size(); ++i) {
        if (!scene_->world.active(static_cast<int>(i))) continue;
        const double speed = velocities[i].norm();
        if (!(speed < speed_bound))
            throw Error("t = " + to_text(time_) + " s, body " + std::to_string(i), "moves at " + to_text(speed) + " m/s: the run has blown up",
                        "take a shorter dem_step, or look for deep overlaps in the sample");
        fastest = std::max(fastest, speed);
    }
    if (!(fastest < speed_bound))
        throw Error("t = " + to_text(time_) + " s", "the flow reached " + to_text(fastest) + " m/s: the run has blown up", "take a lower cfl");
}

/// Counts fines below the filter as eroded; takes bodies out that have left through an outlet.
void Simulation::sort_out_leavers()
{
    const Case& c = scene_->description;
    dem::World& world = scene_->world;
    const WallSpec* plate = c.plate();
    for (std::size_t i = 0; i < scene_->bodies.size(); ++i) {
        const int id = static_cast<int>(i);
        if (!world.active(id)) continue;
        const Vector3d& x = world.position(id);
        const BodyInfo& body = scene_->bodies[i];
        if (body.fine && plate && x.z() < plate->z - plate->thickness) eroded_[i] = 1;
        if (!c.domain) continue;
        for (int face = 0; face < 6; ++face) {
            if (c.boundary[face].kind != BoundaryKind::outlet) continue;
            const int axis = face / 2;
            // Fines leave with their centre; a resolved grain when all of it is out.
            const double margin = body.scheme == Scheme::resolved ? world.bounding_radius(id) : 0;
            const bool out = face % 2 == 0 ? x[axis] < c.domain->origin[axis] - margin : x[axis] > c.domain->origin[axis] + c.domain->size[axis] + margin;
            if (!out) continue;
            if (body.fine) eroded_[i] = 1;
            world.remove_body(id);
            break;
        }
    }
}

/// Closes the balance of the step over both phases: the fluid's own account of every impulse, against what the bodies say they got.
void Simulation::book_balance(const Vector3d& owed)
{
    const fluid::MomentumTally& tally = flow_->momentum();
    balance_.mass = std::max(balance_.mass, flow_->mass().relative_error());
    const Vector3d missing = tally.after - tally.before - tally.boundary_flux - tally.boundary_pressure - tally.body - tally.drag - tally.forcing + tally.fines_pressure;
    const double scale = (tally.after - tally.before).norm() + tally.boundary_flux.norm() + tally.boundary_pressure.norm() + tally.body.norm() +
                         tally.drag.norm() + tally.forcing.norm() + tally.fines_pressure.norm();
    const Vector3d grains = tally.forcing - owed;
    const Vector3d drag = tally.drag + fines_->drag_impulse();
    const Vector3d pressure = tally.fines_pressure - fines_->pressure_impulse();
    if (scale > 0) balance_.momentum = std::max(balance_.momentum, (missing.norm() + grains.norm() + drag.norm() + pressure.norm()) / scale);
}

Balance Simulation::take_balance()
{
    const Balance taken = balance_;
    balance_ = {};
    return taken;
}

Vector3d Simulation::fluid_force(std::size_t body) const
{
    if (!flow_) return Vector3d::Zero();
    return scene_->bodies[body].scheme == Scheme::resolved ? grains_->forces()[body] : fines_->forces()[body];
}

Vector3d Simulation::fluid_torque(std::size_t body) const
{
    if (!flow_ || scene_->bodies[body].scheme != Scheme::resolved) return Vector3d::Zero();
    return grains_->torques()[body];
}

std::vector<std::uint8_t> Simulation::save() const
{
    ByteWriter out;
    out.number(time_), out.number(dem_step_), out.number(last_step_);
    out.integer(steps_);
    out.number(balance_.mass), out.number(balance_.momentum);
    out.array<std::uint8_t>(eroded_);
    out.array<std::uint8_t>(scene_->world.save());
    if (!flow_) return out.take();
    const fluid::FlowState state = flow_->save();
    const fluid::Precision precision = flow_->options().precision;
    out.reserve(2 * out.bytes().size() + 8 * sizeof(double) * state.pressure.size());  // what follows the fields is less than what is before them
    const auto field = [&](const fluid::FlowField& from) {
        fluid::in_precision(precision, [&]<class Real>(Real) {
            out.array<Real>(from.empty() ? std::span<const Real>() : std::span<const Real>(from.data<Real>(), from.size()));
        });
    };
    out.integer(static_cast<std::int64_t>(precision));
    for (int axis = 0; axis < 3; ++axis) field(state.velocity[axis]), field(state.previous_rate[axis]);
    field(state.pressure), field(state.void_fraction);
    out.array<double>(state.scalars);
    std::vector<double> poses;
    for (const fluid::RigidMotion& m : grains_->immersed().placed_motions()) {
        for (const Vector3d& v : {m.position, m.velocity, m.angular_velocity}) poses.insert(poses.end(), v.data(), v.data() + 3);
        poses.insert(poses.end(), m.orientation.coeffs().data(), m.orientation.coeffs().data() + 4);
    }
    out.array<double>(poses);
    for (const std::vector<Vector3d>& part : grains_->state()) out.vectors(part);
    out.vectors(fines_->forces()), out.vectors(fines_->other_acceleration());
    return out.take();
}

void Simulation::restore(std::span<const std::uint8_t> state)
{
    ByteReader in(state);
    time_ = in.number(), dem_step_ = in.number(), last_step_ = in.number();
    if (const double given = scene_->description.time.dem_step; given > 0) dem_step_ = given;  // by itself it stays what it was, though grains leave
    steps_ = in.integer();
    balance_.mass = in.number(), balance_.momentum = in.number();
    eroded_ = in.array<std::uint8_t>();
    if (eroded_.size() != scene_->bodies.size()) throw Error("checkpoint.h5", "is of another case: it has " + std::to_string(eroded_.size()) + " bodies", "run without --resume");
    scene_->world.restore(in.array<std::uint8_t>());
    if (!flow_) return;
    fluid::FlowState flow;
    const auto precision = in.integer() == 0 ? fluid::Precision::float64 : fluid::Precision::float32;
    const auto field = [&](fluid::FlowField& to) {
        to = fluid::in_precision(precision, [&]<class Real>(Real) { return fluid::FlowField(std::span<const Real>(in.array<Real>())); });
    };
    for (int axis = 0; axis < 3; ++axis) field(flow.velocity[axis]), field(flow.previous_rate[axis]);
    field(flow.pressure), field(flow.void_fraction);
    flow.scalars = in.array<double>();
    flow_->restore(flow);
    const std::vector<double> poses = in.array<double>();
    std::vector<fluid::RigidMotion> motions(poses.size() / 13);
    for (std::size_t b = 0; b < motions.size(); ++b) {
        const double* p = poses.data() + 13 * b;
        motions[b].position = Vector3d(p[0], p[1], p[2]), motions[b].velocity = Vector3d(p[3], p[4], p[5]);
        motions[b].angular_velocity = Vector3d(p[6], p[7], p[8]);
        motions[b].orientation = Eigen::Quaterniond(p[12], p[9], p[10], p[11]);
    }
    if (motions.size() != grains_->immersed().size()) throw Error("checkpoint.h5", "is of another case: other resolved grains", "run without --resume");
    grains_->immersed().restore(motions);
    std::array<std::vector<Vector3d>, 4> grains;
    for (std::vector<Vector3d>& part : grains) part = in.vectors();
    grains_->restore(std::move(grains));
    std::vector<Vector3d> forces = in.vectors();
    fines_->restore(std::move(forces), in.vectors());
}

}  // namespace coral::suffusion
