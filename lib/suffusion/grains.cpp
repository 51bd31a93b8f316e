#include "suffusion/grains.h"

#include <algorithm>
#include <cmath>

namespace coral::suffusion {

using Eigen::Vector3d;

namespace {

constexpr double light_ratio = 0.8;   ///< below this density ratio the lagged added mass needs a virtual mass [docs/numerics.md]
constexpr double virtual_share = 0.5; ///< c_v
constexpr double reshape_cells = 0.02;

fluid::BodyShape flow_shape(const dem::Shape& shape, double scale)
{
    if (shape.kind() == dem::ShapeKind::sphere) return fluid::sphere_shape(2 * shape.radius() * scale);
    fluid::BodyShape result;
    if (shape.kind() == dem::ShapeKind::polyhedron) {
        const dem::Polyhedron& body = shape.polyhedron();
        for (const Vector3d& v : body.vertices()) {
            result.box_min = result.box_min.cwiseMin(scale * v);
            result.box_max = result.box_max.cwiseMax(scale * v);
        }
        result.distance = [&body, scale](std::span<const Vector3d> points, std::span<double> distances) {
            for (std::size_t i = 0; i < points.size(); ++i) distances[i] = scale * body.distance(points[i] / scale);
        };
        return result;
    }
    const sdf::DistanceGrid& grid = shape.distance_grid();
    const double reach = shape.bounding_radius();
    result.box_min = scale * grid.origin.cwiseMax(Vector3d::Constant(-reach));
    result.box_max = scale * grid.upper().cwiseMin(Vector3d::Constant(reach));
    result.distance = [&grid, scale](std::span<const Vector3d> points, std::span<double> distances) {
        for (std::size_t i = 0; i < points.size(); ++i) distances[i] = scale * grid.sample(points[i] / scale);
    };
    return result;
}

/// Pose of a body that has left: beyond the low side of an axis that does not wrap.
fluid::RigidMotion far_away(const DomainSpec& domain)
{
    fluid::RigidMotion motion;
    motion.position = domain.origin - 100 * domain.size;
    return motion;
}

}  // namespace

Grains::Grains(const Scene& scene, const fluid::GridSpec& grid)
    : density_(scene.description.fluid->density), immersed_(grid, [] {
          fluid::ForcingOptions options;
          options.reshape_distance = reshape_cells;
          return options;
      }())
{
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (scene.bodies[i].scheme != Scheme::resolved) continue;
        const int id = static_cast<int>(i);
        bodies_.push_back(id);
        immersed_.add(flow_shape(scene.world.shape(id), scene.world.scale(id)), motion_of(scene, id), scene.world.motion(id) == dem::Motion::fixed);
        const double displaced = density_ * scene.bodies[i].volume;
        virtual_mass_.push_back(scene.bodies[i].mass < light_ratio * displaced ? virtual_share * displaced : 0);
    }
    if (const WallSpec* plate = scene.description.plate()) {
        const Eigen::Vector2d half = 1.5 * grid.size().head<2>();
        // The frame's origin is a hole centre near the middle of the domain.
        const Eigen::Vector2d middle = grid.origin.head<2>() + 0.5 * grid.size().head<2>();
        const Eigen::Vector2d hole = scene.hole_centre();
        for (int axis = 0; axis < 2; ++axis) plate_.position[axis] = hole[axis] + plate->pitch * std::round((middle[axis] - hole[axis]) / plate->pitch);
        plate_.position.z() = plate->z - 0.5 * plate->thickness;
        immersed_.add(fluid::plate_shape(plate->thickness, plate->hole, plate->pitch, half), plate_, true);
    }
    motions_.resize(immersed_.size());
    before_.assign(bodies_.size(), Vector3d::Zero());
    change_ = carried_ = before_;
    forces_.assign(scene.bodies.size(), Vector3d::Zero());
    torques_ = forces_;
}

fluid::RigidMotion Grains::motion_of(const Scene& scene, int body)
{
    return {scene.wrapped(scene.world.position(body)), scene.world.orientation(body), scene.world.velocity(body), scene.world.angular_velocity(body)};
}

void Grains::collect_motions(const Scene& scene)
{
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        motions_[b] = scene.world.active(bodies_[b]) ? motion_of(scene, bodies_[b]) : far_away(*scene.description.domain);
    if (motions_.size() > bodies_.size()) motions_.back() = plate_;
}

void Grains::place(const Scene& scene)
{
    if (empty()) return;
    collect_motions(scene);
    immersed_.place(motions_);
}

void Grains::measure(fluid::Flow& flow, double dt, Scene& scene)
{
    if (empty()) return;
    collect_motions(scene);
    const std::span<const fluid::FluidAction> actions = immersed_.measure(flow, dt, motions_);
    actions_.assign(actions.begin(), actions.end());
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        const int id = bodies_[b];
        if (!scene.world.active(id)) continue;
        const double displaced = density_ * scene.bodies[static_cast<std::size_t>(id)].volume;
        before_[b] = scene.world.velocity(id);
        // Eq. 11: the forced fluid moves with the grain and carries inertia M_w instead of the displaced mass; the virtual mass acts on both sides.
        scene.world.set_added_mass(id, actions_[b].forced_mass.array() - displaced + virtual_mass_[b]);
        const Vector3d force = actions_[b].force + carried_[b] / dt - displaced * scene.description.gravity + virtual_mass_[b] / dt * change_[b];
        scene.world.set_external_force(id, force, actions_[b].torque);
    }
}

Vector3d Grains::apply(fluid::Flow& flow, double dt, const Scene& scene)
{
    Vector3d owed = Vector3d::Zero();
    if (empty()) return owed;
    collect_motions(scene);
    immersed_.apply(flow, motions_);
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        const std::size_t id = static_cast<std::size_t>(bodies_[b]);
        if (!scene.world.active(bodies_[b])) {
            forces_[id].setZero(), torques_[id].setZero();
            continue;
        }
        change_[b] = scene.world.velocity(bodies_[b]) - before_[b];
        // Impulse the body got, beside contacts and weight: the force, less the inertia of the forced fluid, and what was owed to it.
        const Vector3d inertia = actions_[b].forced_mass.cwiseProduct(change_[b]);
        const Vector3d got = dt * actions_[b].force + carried_[b] - inertia;
        // The fluid got a little more or less than its reaction (turning, and arms of the faces that moved, are no part of M_w dU).
        // The rest is in transit: the body gets it in the next step.
        const Vector3d before = carried_[b];
        carried_[b] = scene.world.motion(bodies_[b]) == dem::Motion::free ? Vector3d(before - got - immersed_.impulses()[b]) : Vector3d(Vector3d::Zero());
        owed += scene.world.motion(bodies_[b]) == dem::Motion::free ? Vector3d(before - carried_[b] - got) : immersed_.impulses()[b];
        forces_[id] = (got + density_ * scene.bodies[id].volume * change_[b]) / dt;
        torques_[id] = actions_[b].torque;
    }
    // Faces that the plate shares with a moving grain take part of its motion: the plate stands still and takes whatever that needs.
    if (immersed_.size() > bodies_.size()) owed += immersed_.impulses().back();
    return owed;
}

void Grains::restore(std::array<std::vector<Vector3d>, 4> state)
{
    change_ = std::move(state[0]);
    carried_ = std::move(state[1]);
    forces_ = std::move(state[2]);
    torques_ = std::move(state[3]);
}

double Grains::max_speed(const Scene& scene) const
{
    double fastest = 0;
    for (const int id : bodies_)
        if (scene.world.active(id))
            fastest = std::max(fastest, scene.world.velocity(id).norm() + scene.world.angular_velocity(id).norm() * scene.world.bounding_radius(id));
    return fastest;
}

}  // namespace coral::suffusion
