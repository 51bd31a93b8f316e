#include "suffusion/fines.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/parallel.h"

namespace coral::suffusion {

using Eigen::Vector3d;

namespace {

// Farthest move in a flow step [cells; docs/numerics.md]. One fine in a thousand may be faster: squeezed between grains it shoots out for a millisecond.
constexpr double fine_cells = 0.3, outlier_cells = 1.0;
constexpr std::size_t outlier_share = 1000;

fluid::KernelOptions kernel_options(const FluidSpec& spec)
{
    fluid::KernelOptions options;
    options.volume_support = spec.kernel_support[0];
    options.felt_support = spec.kernel_support[1];
    options.self_disturbance = spec.self_disturbance == "removed"          ? fluid::SelfDisturbance::removed
                               : spec.self_disturbance == "volume-removed" ? fluid::SelfDisturbance::volume_removed
                                                                           : fluid::SelfDisturbance::kept;
    return options;
}

}  // namespace

Fines::Fines(const Scene& scene, const fluid::GridSpec& grid)
    : density_(scene.description.fluid->density), viscosity_(scene.description.fluid->kinematic_viscosity),
      law_(fluid::drag_law_from_name(scene.description.fluid->drag)), kernel_(grid, kernel_options(*scene.description.fluid))
{
    for (std::size_t i = 0; i < scene.bodies.size(); ++i)
        if (scene.bodies[i].scheme != Scheme::resolved) all_.push_back(static_cast<int>(i));
    total_ = all_.size();
    if (law_ == fluid::DragLaw::hoelzer_sommerfeld || law_ == fluid::DragLaw::ganser)
        for (const int id : all_)
            if (const int shape = scene.world.shape_id(id); !outlines_.contains(shape)) outlines_.emplace(shape, Outline(scene.world.shape(id)));
    forces_.assign(scene.bodies.size(), Vector3d::Zero());
    other_.assign(scene.bodies.size(), Vector3d::Zero());
}

void Fines::collect(const Scene& scene)
{
    ids_.clear();
    positions_.clear();
    velocities_.clear();
    diameters_.clear();
    volumes_.clear();
    for (const int id : all_) {
        if (!scene.world.active(id)) {
            forces_[static_cast<std::size_t>(id)].setZero();
            continue;
        }
        ids_.push_back(id);
        positions_.push_back(scene.wrapped(scene.world.position(id)));
        velocities_.push_back(scene.world.velocity(id));
        diameters_.push_back(scene.bodies[static_cast<std::size_t>(id)].diameter);
        volumes_.push_back(scene.bodies[static_cast<std::size_t>(id)].volume);
    }
    felt_.resize(ids_.size());
    drag_.resize(ids_.size());
    lag_.resize(ids_.size());
    coefficients_.resize(ids_.size());
}

fluid::DragShape Fines::drag_shape(const Scene& scene, int id, const Vector3d& slip) const
{
    if (outlines_.empty()) return {};
    const Vector3d along = slip.squaredNorm() > 0 ? slip : Vector3d::UnitZ().eval();
    return outlines_.at(scene.world.shape_id(id)).along(scene.world.orientation(id).conjugate() * along);
}

void Fines::deposit(fluid::Flow& flow, double dt, const Scene& scene, const fluid::Field* cell_solid)
{
    collect(scene);
    kernel_.place(positions_, diameters_, cell_solid);
    kernel_.deposit_volume(flow, volumes_, velocities_);
    kernel_.feel(flow, felt_);
    mean_felt_ = 0;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
        const std::size_t id = static_cast<std::size_t>(ids_[i]);
        const fluid::FineParticle particle{velocities_[i], diameters_[i], volumes_[i], drag_shape(scene, ids_[i], felt_[i].velocity - velocities_[i])};
        const fluid::FineForce now = fluid::fine_force(law_, particle, felt_[i], density_, viscosity_);
        // Force at the velocity the body will have: linear in it, so solved at once. Stable for any dt, exact at rest and at terminal speed.
        const bool moves = scene.world.motion(ids_[i]) == dem::Motion::free;
        const double response = moves ? 1 / (1 + dt * now.coefficient / scene.bodies[id].mass) : 1;
        coefficients_[i] = now.coefficient * response;
        drag_[i] = response * (moves ? (now.force - dt * now.coefficient * other_[id]).eval() : now.force);
        mean_felt_ += felt_[i].void_fraction / static_cast<double>(ids_.size());
    }
    kernel_.deposit_drag(flow, coefficients_, drag_);
}

void Fines::give_forces(const fluid::Flow& flow, double dt, Scene& scene)
{
    kernel_.drag_lag(flow, coefficients_, lag_);
    drag_impulse_.setZero();
    pressure_impulse_.setZero();
    for (std::size_t i = 0; i < ids_.size(); ++i) {
        const std::size_t id = static_cast<std::size_t>(ids_[i]);
        drag_[i] += lag_[i];
        const Vector3d pressure = -density_ * volumes_[i] * felt_[i].pressure_gradient;
        forces_[id] = drag_[i] + pressure;
        drag_impulse_ += dt * drag_[i];
        pressure_impulse_ += dt * pressure;
        scene.world.set_external_force(ids_[i], forces_[id] - density_ * volumes_[i] * scene.description.gravity, Vector3d::Zero());
    }
}

void Fines::learn(double dt, const Scene& scene)
{
    for (std::size_t i = 0; i < ids_.size(); ++i) {
        const std::size_t id = static_cast<std::size_t>(ids_[i]);
        other_[id] = (scene.world.velocity(ids_[i]) - velocities_[i]) / dt - drag_[i] / scene.bodies[id].mass;
    }
}

double Fines::longest_step(const Scene& scene, double cell) const
{
    std::vector<double> speeds;
    speeds.reserve(all_.size());
    for (const int id : all_)
        if (scene.world.active(id)) speeds.push_back(scene.world.velocity(id).norm());
    if (speeds.empty()) return std::numeric_limits<double>::infinity();
    const auto most = speeds.begin() + static_cast<std::ptrdiff_t>(speeds.size() / outlier_share);
    std::nth_element(speeds.begin(), most, speeds.end(), std::greater<>());
    const double fastest = *std::max_element(speeds.begin(), most + 1);
    return cell * std::min(fine_cells / *most, outlier_cells / fastest);
}

}  // namespace coral::suffusion
