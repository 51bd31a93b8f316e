#include "suffusion/observables.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "suffusion/bytes.h"

namespace coral::suffusion {

using Eigen::Vector3d;

namespace {

struct TrajectoryPart {
    const char *name, *unit;
    std::size_t width;
};
constexpr std::array<TrajectoryPart, 8> trajectory_parts{{{"position", "m", 3}, {"speed", "m s-1", 1}, {"velocity", "m s-1", 3}, {"orientation", "1", 4},
                                                          {"angular_velocity", "rad s-1", 3}, {"fluid_force", "N", 3}, {"fluid_torque", "N m", 3}, {"contact_force", "N", 3}}};

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

/// sqrt(3/2 a:a) with a = 15/2 (F - I/3), F the mean of n n^T: 0 for an even spread of contact normals.
double anisotropy(const Eigen::Matrix3d& sum, double count)
{
    if (count == 0) return 0;
    const Eigen::Matrix3d a = 7.5 * (sum / count - Eigen::Matrix3d::Identity() / 3);
    return std::sqrt(1.5 * a.squaredNorm());
}

}  // namespace

Observer::Observer(const Simulation& simulation)
{
    const Scene& scene = simulation.scene();
    const Case& c = scene.description;
    const double height = scene.upper.z() - scene.lower.z();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (c.output.track_all || std::ranges::find(c.output.track, i) != c.output.track.end()) results_.tracked.push_back(static_cast<std::int64_t>(i));
        if (!scene.bodies[i].fine) continue;
        initial_fine_mass_ += scene.bodies[i].mass;
        const Vector3d& x = scene.world.position(static_cast<int>(i));
        results_.fines.push_back(static_cast<std::int64_t>(i));
        results_.layer.push_back(height > 0 ? std::clamp(static_cast<int>(3 * (x.z() - scene.lower.z()) / height), 0, 2) : 0);
        start_.push_back(x);
    }
    last_ = start_;
    results_.path_length.assign(start_.size(), 0);
    results_.net_displacement.assign(start_.size(), 0);
    results_.eroded.assign(start_.size(), 0);
    results_.case_text = c.text;
    if (!simulation.has_flow()) return;

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

void Observer::put(const char* name, const char* unit, std::initializer_list<double> values)
{
    Column& column = results_.column(name);
    column.unit = unit;
    column.width = values.size();
    column.values.insert(column.values.end(), values);
}

void Observer::record(Simulation& simulation)
{
    put("time", "s", simulation.time());
    record_erosion(simulation);
    if (simulation.has_flow()) {
        record_flow(simulation);
        record_flow_split(simulation);
    }
    record_forces(simulation);
    record_contacts(simulation);
    const Balance balance = simulation.take_balance();
    put("mass_balance_error", "1", balance.mass);
    put("momentum_balance_error", "1", balance.momentum);
    record_trajectories(simulation);
    record_migration(simulation);
}

void Observer::record_erosion(const Simulation& simulation)
{
    const Scene& scene = simulation.scene();
    double mass = 0, count = 0, trapped = 0;
    std::array<double, 3> layers{};
    const double height = scene.upper.z() - scene.lower.z();
    for (const std::int64_t id : results_.fines) {
        const std::size_t i = static_cast<std::size_t>(id);
        if (simulation.eroded(i)) {
            mass += scene.bodies[i].mass;
            count += 1;
            continue;
        }
        const Vector3d& x = scene.world.position(static_cast<int>(i));
        layers[static_cast<std::size_t>(height > 0 ? std::clamp(static_cast<int>(std::floor(3 * (x.z() - scene.lower.z()) / height)), 0, 2) : 0)] += 1;
        for (std::size_t g = 0; g < scene.bodies.size(); ++g) {
            const BodyInfo& grain = scene.bodies[g];
            const int body = static_cast<int>(g);
            if (!grain.apparent || !scene.world.active(body)) continue;
            const Vector3d r = x - scene.world.position(body);
            if (r.squaredNorm() > std::pow(scene.world.bounding_radius(body), 2)) continue;
            if (!grain.apparent->contains(scene.world.orientation(body).conjugate() * r / scene.world.scale(body))) continue;
            trapped += 1;
            break;
        }
    }
    put("eroded_mass_fraction", "1", initial_fine_mass_ > 0 ? mass / initial_fine_mass_ : 0);
    put("eroded_count", "1", count);
    put("fines_count", "1", {layers[0], layers[1], layers[2]});
    put("trapped_count", "1", trapped);
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
    put("mean_velocity", "m s-1", {mean.x(), mean.y(), mean.z()});
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
    const std::size_t count = flow.grid().cell_count();
    std::vector<std::uint8_t> inside(count, 0);
    for (std::size_t g = 0; g < scene.bodies.size(); ++g) {
        const int body = static_cast<int>(g);
        const BodyInfo& grain = scene.bodies[g];
        if (!grain.apparent || !scene.world.active(body)) continue;
        const double reach = scene.world.bounding_radius(body);
        const Vector3d x = scene.world.position(body);
        const Eigen::Matrix3d turn = scene.world.orientation(body).conjugate().toRotationMatrix() / scene.world.scale(body);
        const Eigen::Vector3i first = ((x - domain.origin).array() / domain.cell - reach / domain.cell - 1).floor().cast<int>().max(0);
        const Eigen::Vector3i last = ((x - domain.origin).array() / domain.cell + reach / domain.cell + 1).ceil().cast<int>().min(cells.array() - 1);
        for (int k = first.z(); k <= last.z(); ++k)
            for (int j = first.y(); j <= last.y(); ++j)
                for (int i = first.x(); i <= last.x(); ++i)
                    if (grain.apparent->contains(turn * (flow.cell_centre(i, j, k) - x)))
                        inside[static_cast<std::size_t>(i) + static_cast<std::size_t>(cells.x()) * (static_cast<std::size_t>(j) + static_cast<std::size_t>(cells.y()) * static_cast<std::size_t>(k))] = 1;
    }
    const bool sample = !scene.bodies.empty();
    Eigen::Array4d total = parallel_sum(static_cast<std::size_t>(cells.z()), 1, Eigen::Array4d::Zero().eval(), [&](std::size_t k, std::size_t) {
        Eigen::Array4d sum = Eigen::Array4d::Zero();
        const double z = domain.origin.z() + (static_cast<double>(k) + 0.5) * domain.cell;
        if (sample && (z < scene.lower.z() || z > scene.upper.z())) return sum;
        std::size_t n = k * static_cast<std::size_t>(cells.x()) * static_cast<std::size_t>(cells.y());
        for (int j = 0; j < cells.y(); ++j)
            for (int i = 0; i < cells.x(); ++i, ++n) {
                const double open = 1 - simulation.solid_fraction(flow.layout().index(i, j, static_cast<int>(k)));
                if (open < 0.5) continue;
                const double speed = flow.cell_velocity(i, j, static_cast<int>(k)).norm();
                const int part = inside[n] ? 2 : 0;
                sum[part] += open * speed;
                sum[part + 1] += open;
            }
        return sum;
    });
    put("velocity_interparticle", "m s-1", total[1] > 0 ? total[0] / total[1] : 0);
    put("velocity_intraparticle", "m s-1", total[3] > 0 ? total[2] / total[3] : 0);
    put("intraparticle_volume", "m3", total[3] * std::pow(domain.cell, 3));
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
    Eigen::Matrix3d all = Eigen::Matrix3d::Zero(), coarse = all;
    double all_count = 0, coarse_count = 0;
    for (const dem::Contact& contact : scene.world.contacts()) {
        if (contact.second < 0) continue;
        const Eigen::Matrix3d n = contact.normal * contact.normal.transpose();
        all += n, all_count += 1;
        if (!scene.bodies[static_cast<std::size_t>(contact.first)].coarse || !scene.bodies[static_cast<std::size_t>(contact.second)].coarse) continue;
        coarse += n, coarse_count += 1;
    }
    put("contact_anisotropy", "1", anisotropy(all, all_count));
    put("contact_anisotropy_coarse", "1", anisotropy(coarse, coarse_count));
    const int active = scene.world.active_count();
    put("coordination", "1", active > 0 ? 2 * all_count / active : 0);
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
    }
}

void Observer::record_migration(const Simulation& simulation)
{
    for (std::size_t n = 0; n < results_.fines.size(); ++n) {
        const int body = static_cast<int>(results_.fines[n]);
        const Vector3d& x = simulation.scene().world.position(body);
        results_.path_length[n] += (x - last_[n]).norm();
        results_.net_displacement[n] = (x - start_[n]).norm();
        results_.eroded[n] = simulation.eroded(static_cast<std::size_t>(body));
        last_[n] = x;
    }
}

std::vector<std::uint8_t> Observer::save() const
{
    ByteWriter out;
    out.vectors(last_);
    out.array<double>(results_.path_length);
    return out.bytes();
}

void Observer::resume(Results stored, std::size_t rows, std::span<const std::uint8_t> state)
{
    ByteReader in(state);
    std::vector<Vector3d> last = in.vectors();
    std::vector<double> paths = in.array<double>();
    const std::size_t parts = stored.trajectories.size();
    if (stored.tracked != results_.tracked || stored.fines != results_.fines || stored.rows() < rows || last.size() != last_.size() ||
        paths.size() != last.size() || parts == 0)
        throw Error("results.h5", "is of another case or damaged", "run without --resume to start anew");
    stored.truncate(rows);
    results_.series = std::move(stored.series);
    // The file lists its columns by name; rows are appended by place.
    for (const TrajectoryPart& part : trajectory_parts)
        for (Column& column : stored.trajectories)
            if (column.name == part.name) results_.trajectories.push_back(std::move(column));
    results_.path_length = std::move(paths);
    last_ = std::move(last);
    for (std::size_t n = 0; n < last_.size(); ++n) results_.net_displacement[n] = (last_[n] - start_[n]).norm();
    results_.eroded = std::move(stored.eroded);
}

}  // namespace coral::suffusion
