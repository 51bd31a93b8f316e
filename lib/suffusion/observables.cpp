#include "suffusion/observables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "suffusion/bytes.h"
#include "suffusion/fabric.h"
#include "suffusion/flow_region.h"

namespace coral::suffusion {

using Eigen::Vector3d;

namespace {

struct TrajectoryPart {
    const char *name, *unit;
    std::size_t width;
};
constexpr std::array<TrajectoryPart, 9> trajectory_parts{{{"position", "m", 3}, {"speed", "m s-1", 1}, {"velocity", "m s-1", 3}, {"orientation", "1", 4},
                                                          {"angular_velocity", "rad s-1", 3}, {"fluid_force", "N", 3}, {"fluid_torque", "N m", 3}, {"contact_force", "N", 3}, {"state", "1", 1}}};

constexpr double least_piece = 0.02;       ///< of a path, over the diameter
constexpr double standard_gravity = 9.81;  ///< [m/s2], for the hydraulic gradient where the case has no gravity

double gravity_of(const Case& c) { return c.gravity.norm() > 0 ? c.gravity.norm() : standard_gravity; }

/// Mean kinematic pressure over the open part of one plane of cells.
double plane_pressure(const Simulation& simulation, int axis, int plane)
{
    const fluid::Flow& flow = simulation.flow();
    const Eigen::Vector3i& cells = flow.grid().cells;
    const int other = (axis + 1) % 3, third = (axis + 2) % 3;
    double sum = 0, weight = 0;
    Eigen::Vector3i cell;
    cell[axis] = plane;
    for (cell[third] = 0; cell[third] < cells[third]; ++cell[third])
        for (cell[other] = 0; cell[other] < cells[other]; ++cell[other]) {
            const std::size_t at = flow.layout().index(cell.x(), cell.y(), cell.z());
            const double open = 1 - simulation.solid_fraction(at);
            if (open < 0.5) continue;
            sum += open * flow.pressure()[at];
            weight += open;
        }
    return weight > 0 ? sum / weight : 0;
}

}  // namespace

Observer::Observer(const Simulation& simulation)
{
    const Scene& scene = simulation.scene();
    const Case& c = scene.description;
    layers_ = static_cast<std::size_t>(c.output.layers);
    bottom_ = scene.lower.z();
    height_ = scene.upper.z() - scene.lower.z();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (c.output.track_all || std::ranges::find(c.output.track, i) != c.output.track.end()) results_.tracked.push_back(static_cast<std::int64_t>(i));
        if (!scene.bodies[i].fine) continue;
        initial_fine_mass_ += scene.bodies[i].mass;
        const Vector3d& x = scene.world.position(static_cast<int>(i));
        results_.fines.push_back(static_cast<std::int64_t>(i));
        results_.layer.push_back(static_cast<std::int64_t>(layer_of(x.z())));
        start_.push_back(x);
    }
    last_ = mark_ = start_;
    walked_.assign(start_.size(), 0);
    results_.path_length.assign(start_.size(), 0);
    results_.net_displacement.assign(start_.size(), 0);
    results_.eroded.assign(start_.size(), 0);
    results_.state.assign(start_.size(), 0);
    results_.cloggings.assign(start_.size(), 0);
    motion_.resize(start_.size());
    results_.case_text = c.text;
    if (!simulation.has_flow()) return;

    regions_.emplace(scene);
    axis_ = c.flow_axis();
    const DomainSpec& domain = *c.domain;
    direction_ = c.fluid->body_acceleration[axis_] != 0 ? std::copysign(1.0, c.fluid->body_acceleration[axis_]) : -1;
    for (int face = 0; face < 6; ++face)
        if (c.boundary[face].kind == BoundaryKind::inlet) direction_ = face % 2 == 0 ? 1 : -1, axis_ = face / 2;
    double low = domain.origin[axis_], high = low + domain.size[axis_];
    if (!scene.bodies.empty()) low = std::max(low, scene.lower[axis_]), high = std::min(high, scene.upper[axis_]);
    lower_plane_ = std::clamp(static_cast<int>(std::floor((low - domain.origin[axis_]) / domain.cell)), 0, domain.cells[axis_] - 1);
    upper_plane_ = std::clamp(static_cast<int>(std::floor((high - domain.origin[axis_]) / domain.cell)), 0, domain.cells[axis_] - 1);
    reference_length_ = (upper_plane_ - lower_plane_) * domain.cell;
}

std::size_t Observer::layer_of(double z) const
{
    if (!(height_ > 0)) return 0;
    const double layer = std::floor(static_cast<double>(layers_) * (z - bottom_) / height_);
    return static_cast<std::size_t>(std::clamp(layer, 0.0, static_cast<double>(layers_ - 1)));
}

void Observer::put(const char* name, const char* unit, std::span<const double> values)
{
    Column& column = results_.column(name);
    column.unit = unit;
    column.width = values.size();
    // A version that did not know the series began the run.
    if (column.values.empty()) column.values.assign(rows_before_ * column.width, std::numeric_limits<double>::quiet_NaN());
    column.values.insert(column.values.end(), values.begin(), values.end());
}

void Observer::follow(const Simulation& simulation)
{
    const Scene& scene = simulation.scene();
    for (std::size_t n = 0; n < mark_.size(); ++n) {
        const auto body = static_cast<std::size_t>(results_.fines[n]);
        const Vector3d& x = scene.world.position(static_cast<int>(body));
        const double piece = (x - mark_[n]).norm();
        if (piece < least_piece * scene.bodies[body].diameter) continue;
        walked_[n] += piece;
        mark_[n] = x;
    }
}

void Observer::record(Simulation& simulation)
{
    follow(simulation);
    rows_before_ = results_.rows();
    put("time", "s", simulation.time());
    record_erosion(simulation);
    record_trapping(simulation);
    if (simulation.has_flow()) {
        record_flow(simulation);
        record_flow_split(simulation);
    }
    record_forces(simulation);
    record_contacts(simulation);
    const Balance balance = simulation.take_balance();
    put("mass_balance_error", "1", balance.mass);
    put("momentum_balance_error", "1", balance.momentum);
    record_migration(simulation);  // first: the trajectories hold the states
    record_trajectories(simulation);
    last_time_ = simulation.time();
}

void Observer::record_erosion(const Simulation& simulation)
{
    const Scene& scene = simulation.scene();
    double mass = 0, count = 0;
    std::vector<double> layers(layers_, 0.0);
    for (const std::int64_t id : results_.fines) {
        const std::size_t i = static_cast<std::size_t>(id);
        if (simulation.eroded(i)) {
            mass += scene.bodies[i].mass;
            count += 1;
        } else {
            layers[layer_of(scene.world.position(static_cast<int>(i)).z())] += 1;
        }
    }
    put("eroded_mass_fraction", "1", initial_fine_mass_ > 0 ? mass / initial_fine_mass_ : 0);
    put("eroded_count", "1", count);
    put("fines_count", "1", layers);
}

void Observer::record_trapping(const Simulation& simulation)
{
    std::vector<std::int64_t> here;
    for (const std::int64_t id : results_.fines)
        if (!simulation.eroded(static_cast<std::size_t>(id))) here.push_back(id);
    trapped_ = find_trapped(simulation.scene(), here, simulation.time(), trapped_, throats_);
    put("trapped_count", "1", static_cast<double>(trapped_.size()));
    put("trapped_enclosed", "1", static_cast<double>(std::ranges::count(trapped_, true, &Trapped::enclosed)));
    put("trapped_entered", "1", static_cast<double>(std::ranges::count_if(trapped_, [](const Trapped& t) { return t.since > 0; })));
    results_.trapped = trapped_;
}

void Observer::record_flow(const Simulation& simulation)
{
    const fluid::Flow& flow = simulation.flow();
    const Case& c = simulation.scene().description;
    const double density = c.fluid->density, g = gravity_of(c);
    // Pressure falls along the flow; a body acceleration drives like a fall of pressure.
    const double fall = direction_ * (plane_pressure(simulation, axis_, lower_plane_) - plane_pressure(simulation, axis_, upper_plane_)) +
                        direction_ * c.fluid->body_acceleration[axis_] * reference_length_;
    const double gradient = reference_length_ > 0 ? fall / (g * reference_length_) : 0;
    const Vector3d mean = flow.mean_superficial_velocity();
    const double flux = direction_ * mean[axis_];
    put("hydraulic_gradient", "1", gradient);
    put("hydraulic_conductivity", "m s-1", gradient != 0 ? flux / gradient : 0);
    put("mean_velocity", "m s-1", std::span(mean.data(), 3));
    double inlet = 0, outlet = 0;
    bool has_inlet = false, has_outlet = false;
    for (int face = 0; face < 6; ++face) {
        const fluid::Face side = static_cast<fluid::Face>(face);
        if (c.boundary[face].kind == BoundaryKind::inlet && !has_inlet) inlet = flow.mean_boundary_pressure(side), has_inlet = true;
        if (c.boundary[face].kind == BoundaryKind::outlet && !has_outlet) outlet = flow.mean_boundary_pressure(side), has_outlet = true;
    }
    put("pressure_drop", "Pa", has_inlet && has_outlet ? density * (inlet - outlet) : 0);
    put("flow_step", "s", simulation.last_flow_step());
    put("felt_void_fraction", "1", simulation.fines().mean_felt_void_fraction());
}

/// Mean speeds between the grains and inside their voids, over the height of the sample.
void Observer::record_flow_split(const Simulation& simulation)
{
    const fluid::Flow& flow = simulation.flow();
    const Scene& scene = simulation.scene();
    const DomainSpec& domain = *scene.description.domain;
    const Eigen::Vector3i& cells = domain.cells;
    constexpr double least_open = 0.5;
    const std::vector<Region> regions = regions_->find(simulation, least_open);
    const bool sample = !scene.bodies.empty();
    using Sums = Eigen::Array<double, 6, 1>;  // of speed and of weight: between grains, in open voids, in sealed ones
    const Sums total = parallel_sum(static_cast<std::size_t>(cells.z()), 1, Sums::Zero().eval(), [&](std::size_t k, std::size_t) {
        Sums sum = Sums::Zero();
        const double z = domain.origin.z() + (static_cast<double>(k) + 0.5) * domain.cell;
        if (sample && (z < scene.lower.z() || z > scene.upper.z())) return sum;
        std::size_t n = k * static_cast<std::size_t>(cells.x()) * static_cast<std::size_t>(cells.y());
        for (int j = 0; j < cells.y(); ++j)
            for (int i = 0; i < cells.x(); ++i, ++n) {
                const double open = 1 - simulation.solid_fraction(flow.layout().index(i, j, static_cast<int>(k)));
                if (open < least_open || regions[n] == Region::surface) continue;
                const int part = regions[n] == Region::between ? 0 : regions[n] == Region::open ? 2 : 4;
                sum[part] += open * flow.cell_velocity(i, j, static_cast<int>(k)).norm();
                sum[part + 1] += open;
            }
        return sum;
    });
    const auto mean = [&](int part) { return total[part + 1] > 0 ? total[part] / total[part + 1] : 0; };
    put("velocity_interparticle", "m s-1", mean(0));
    put("velocity_intraparticle", "m s-1", mean(2));
    put("velocity_sealed", "m s-1", mean(4));
    put("intraparticle_volume", "m3", total[3] * std::pow(domain.cell, 3));
    put("sealed_volume", "m3", total[5] * std::pow(domain.cell, 3));
}

void Observer::record_forces(const Simulation& simulation)
{
    const Scene& scene = simulation.scene();
    double coarse = 0, coarse_count = 0, fine = 0, fine_count = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (!scene.world.active(static_cast<int>(i)) || simulation.eroded(i)) continue;
        const double force = simulation.fluid_force(i).norm();
        if (scene.bodies[i].coarse) coarse += force, coarse_count += 1;
        if (scene.bodies[i].fine) fine += force, fine_count += 1;
    }
    put("fluid_force_coarse", "N", coarse_count > 0 ? coarse / coarse_count : 0);
    put("fluid_force_fine", "N", fine_count > 0 ? fine / fine_count : 0);
}

void Observer::record_contacts(const Simulation& simulation)
{
    const Scene& scene = simulation.scene();
    std::vector<Vector3d> all, coarse;
    for (const dem::Contact& contact : scene.world.contacts()) {
        if (contact.second < 0) continue;
        all.push_back(contact.normal);
        if (scene.bodies[static_cast<std::size_t>(contact.first)].coarse && scene.bodies[static_cast<std::size_t>(contact.second)].coarse) coarse.push_back(contact.normal);
    }
    const Fabric fabric = fabric_of(all), of_coarse = fabric_of(coarse);
    const Eigen::Matrix3d& f = fabric.tensor;
    const std::array<double, 6> components{f(0, 0), f(1, 1), f(2, 2), f(0, 1), f(0, 2), f(1, 2)};
    put("contact_count", "1", fabric.count);
    put("contact_fabric", "1", components);
    put("contact_anisotropy", "1", fabric.anisotropy);
    put("contact_anisotropy_error", "1", fabric.error);
    put("contact_anisotropy_floor", "1", fabric.floor);
    put("contact_anisotropy_coarse", "1", of_coarse.anisotropy);
    put("contact_anisotropy_coarse_error", "1", of_coarse.error);
    const int active = scene.world.active_count();
    put("coordination", "1", active > 0 ? 2 * fabric.count / active : 0);
    put("swallowed_count", "1", static_cast<double>(scene.world.swallowed().size()));
    const dem::Energy energy = scene.world.energy();
    put("kinetic_energy", "J", energy.kinetic);
    put("elastic_energy", "J", energy.elastic_normal + energy.elastic_tangential);
    put("energy_closure", "J", energy.closure);
}

void Observer::record_trajectories(const Simulation& simulation)
{
    const Scene& scene = simulation.scene();
    if (results_.trajectories.empty())
        for (const TrajectoryPart& part : trajectory_parts) results_.trajectories.push_back({part.name, part.unit, part.width, {}});
    const auto add = [&](std::size_t part, const Vector3d& v) {
        std::vector<double>& values = results_.trajectories[part].values;
        values.insert(values.end(), v.data(), v.data() + 3);
    };
    for (const std::int64_t id : results_.tracked) {
        const int body = static_cast<int>(id);
        const dem::World& world = scene.world;
        const Eigen::Quaterniond& q = world.orientation(body);
        add(0, world.position(body));
        results_.trajectories[1].values.push_back(world.velocity(body).norm());
        add(2, world.velocity(body));
        results_.trajectories[3].values.insert(results_.trajectories[3].values.end(), {q.w(), q.x(), q.y(), q.z()});
        add(4, world.angular_velocity(body));
        const bool in = world.active(body);
        add(5, in ? simulation.fluid_force(static_cast<std::size_t>(id)) : Vector3d::Zero().eval());
        add(6, in ? simulation.fluid_torque(static_cast<std::size_t>(id)) : Vector3d::Zero().eval());
        add(7, in ? world.contact_forces()[static_cast<std::size_t>(id)] : Vector3d::Zero().eval());
        const auto fine = std::ranges::lower_bound(results_.fines, id);
        const bool is_fine = fine != results_.fines.end() && *fine == id;
        results_.trajectories[8].values.push_back(is_fine ? static_cast<double>(results_.state[static_cast<std::size_t>(fine - results_.fines.begin())]) : -1.0);
    }
}

void Observer::record_migration(const Simulation& simulation)
{
    const double elapsed = simulation.time() - last_time_;
    std::array<double, 4> count{};
    double cloggings = 0, uncloggings = 0;
    for (std::size_t n = 0; n < results_.fines.size(); ++n) {
        const std::size_t body = static_cast<std::size_t>(results_.fines[n]);
        const Vector3d& x = simulation.scene().world.position(static_cast<int>(body));
        const double moved = (x - last_[n]).norm();
        motion_[n].update(elapsed > 0 ? moved / elapsed : 0, simulation.scene().bodies[body].diameter, simulation.eroded(body));
        results_.path_length[n] = walked_[n] + (x - mark_[n]).norm();
        results_.net_displacement[n] = (x - start_[n]).norm();
        results_.eroded[n] = simulation.eroded(body);
        results_.state[n] = static_cast<std::int64_t>(motion_[n].state());
        results_.cloggings[n] = motion_[n].cloggings();
        count[static_cast<std::size_t>(motion_[n].state())] += 1;
        cloggings += static_cast<double>(motion_[n].cloggings());
        uncloggings += static_cast<double>(motion_[n].uncloggings());
        last_[n] = x;
    }
    put("moving_count", "1", count[static_cast<std::size_t>(FineState::moving)]);
    put("clogged_count", "1", count[static_cast<std::size_t>(FineState::clogged)]);
    put("clogging_events", "1", cloggings);
    put("unclogging_events", "1", uncloggings);
}

std::vector<std::uint8_t> Observer::save() const
{
    ByteWriter out;
    for (const std::vector<Vector3d>* of : {&last_, &mark_}) out.vectors(*of);
    for (const std::vector<double>* of : {&walked_, &results_.path_length}) out.array<double>(*of);
    out.number(last_time_);
    for (const MotionState& m : motion_) out.integer(static_cast<std::int64_t>(m.state())), out.integer(m.cloggings()), out.integer(m.uncloggings());
    out.integer(static_cast<std::int64_t>(trapped_.size()));
    for (const Trapped& t : trapped_) out.integer(t.fine), out.integer(t.grain), out.integer(t.enclosed), out.number(t.since);
    return out.bytes();
}

void Observer::resume(Results stored, std::size_t rows, std::span<const std::uint8_t> state)
{
    ByteReader in(state);
    std::vector<Vector3d> last = in.vectors(), mark = in.vectors();
    std::vector<double> walked = in.array<double>(), paths = in.array<double>();
    const std::size_t parts = stored.trajectories.size();
    if (stored.tracked != results_.tracked || stored.fines != results_.fines || stored.rows() < rows || last.size() != last_.size() ||
        mark.size() != last.size() || walked.size() != last.size() || paths.size() != last.size() || parts != trajectory_parts.size() || stored.column("fines_count").width != layers_)
        throw Error("results.h5", "is of another case or of an older version, or damaged", "run without --resume to start anew");
    last_time_ = in.number();
    for (MotionState& m : motion_) {
        const auto known = static_cast<FineState>(in.integer());
        const std::int64_t cloggings = in.integer();
        m = MotionState::restored(known, cloggings, in.integer());
    }
    trapped_.resize(static_cast<std::size_t>(std::clamp<std::int64_t>(in.integer(), 0, static_cast<std::int64_t>(last.size()))));
    for (Trapped& t : trapped_) t.fine = in.integer(), t.grain = in.integer(), t.enclosed = in.integer() != 0, t.since = in.number();
    stored.truncate(rows);
    results_.series = std::move(stored.series);
    // The file lists its columns by name; rows are appended by place.
    for (const TrajectoryPart& part : trajectory_parts)
        for (Column& column : stored.trajectories)
            if (column.name == part.name) results_.trajectories.push_back(std::move(column));
    results_.path_length = std::move(paths);
    mark_ = std::move(mark);
    walked_ = std::move(walked);
    last_ = std::move(last);
    for (std::size_t n = 0; n < last_.size(); ++n) {
        results_.net_displacement[n] = (last_[n] - start_[n]).norm();
        results_.state[n] = static_cast<std::int64_t>(motion_[n].state());
        results_.cloggings[n] = motion_[n].cloggings();
    }
    results_.eroded = std::move(stored.eroded);
    // Where the file is of this very output, it knows the throats, which are no part of the state.
    for (Trapped& t : trapped_)
        for (const Trapped& known : stored.trapped)
            if (known.fine == t.fine && known.grain == t.grain) t.throat = known.throat;
    results_.trapped = trapped_;
}

}  // namespace coral::suffusion
