#pragma once
/// \file dem/world.h
/// The discrete element world: bodies, walls, contact, motion in time.
///
/// One step (velocity Verlet; velocities are in step with positions between calls):
///     v += dt/2 F/m,  L += dt/2 T;   x += dt v,  orientation by exact rotations about the principal axes;
///     contacts at the new positions, friction springs += dt v_t;   v += dt/2 F/m,  L += dt/2 T
/// Contact laws: docs/numerics.md. Spheres and planes: F = kn delta; sphere on grid or polyhedron: F = kn (R - Phi) grad Phi at
/// the centre; nodes on a distance field: F_i = k_a A_i u (2 + u^2)/(1 + u^2)^1.5 grad Phi, u = 100 d/d*.
/// Steps give the same bits for any number of threads and after restore().
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dem/body.h"
#include "dem/shape.h"

namespace coral::dem {

struct WorldOptions {
    Eigen::Vector3d gravity{0, 0, -9.81};  ///< [m/s2]
    /// Periodic lengths along x, y, z [m]; 0 is not periodic. Positions are kept unwrapped; differences take the nearest image.
    Eigen::Vector3d period = Eigen::Vector3d::Zero();
    double step_fraction = 0.3;   ///< omega dt of the automatic step, omega = sqrt(2 kn/m) of the stiffest, lightest pair
    double skin = 0;              ///< of the sphere lists [m]; 0 takes a quarter of the median radius
    double overlap_cap = 0.5;     ///< sphere forces grow no more beyond this overlap / smaller radius [-]
    bool two_way_nodes = false;   ///< grid pairs: nodes of both bodies, half each (energy error 1.7 times lower, cost 2 times)
    bool force_step = false;      ///< allows omega dt > 1.5
    SphereScheme sphere_scheme = SphereScheme::automatic;
};

class World {
public:
    explicit World(const WorldOptions& options = {});
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    ~World();

    /// \name Building. Ids count from 0 and are never reused.
    ///@{
    int add_shape(std::shared_ptr<const Shape> shape);
    int add_material(const Material& material);
    /// \throws Error  unknown shape or material, scale not positive, a number that is not finite
    int add_body(const BodySpec& spec);
    /// Takes a body out (eroded); its id stays and its contacts vanish. Its last state can still be read.
    void remove_body(int body);
    /// Half space behind a plane; the normal points to the bodies.
    int add_plane(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, int material = 0);
    /// Six planes x-, x+, y-, y+, z-, z+ facing inwards; returns the first of six ids in a row.
    int add_box(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper, int material = 0);
    /// Unlimited horizontal plate with square holes: solid for top - thickness <= z <= top, except holes of edge `hole` centred at
    /// `hole_centre` + (i, j) pitch. hole = 0 is a plate without holes. \throws Error  hole not below pitch, thickness not positive
    int add_plate(double top, double thickness, double hole, double pitch, const Eigen::Vector2d& hole_centre, int material = 0);
    /// Vertical cylinder of radius R with the bodies inside, unlimited along z: distance R - |x - centre| across. It stands still.
    /// Nodes press with kn/(2 pi R*) per area, 1/R* = sqrt(1/r (1/r - 1/R)) for a body of equivalent radius r, so that a ball of nodes is as
    /// stiff as a sphere. \throws Error  radius not positive
    int add_cylinder(const Eigen::Vector2d& centre, double radius, int material = 0);
    ///@}

    /// \name Bodies
    ///@{
    int body_count() const;    ///< ids given, removed ones included
    int active_count() const;  ///< bodies that are in
    bool active(int body) const;
    const Shape& shape(int body) const;
    int shape_id(int body) const;
    int material_id(int body) const;
    const std::string& role(int body) const;
    Motion motion(int body) const;
    double scale(int body) const;
    double mass(int body) const;               ///< [kg]
    double equivalent_radius(int body) const;  ///< of the apparent volume [m]
    double bounding_radius(int body) const;    ///< [m]
    Eigen::Matrix3d inertia(int body) const;   ///< about the centre of mass, world frame [kg m2]
    /// Indexed by body; valid until the next add_body.
    std::span<const Eigen::Vector3d> positions() const;
    std::span<const Eigen::Vector3d> velocities() const;
    std::span<const Eigen::Vector3d> angular_velocities() const;  ///< [rad/s]
    std::span<const Eigen::Quaterniond> orientations() const;     ///< shape frame to world
    std::span<const Eigen::Vector3d> contact_forces() const;      ///< of contacts alone, at the end of the last step [N]
    std::span<const Eigen::Vector3d> contact_torques() const;     ///< [N m]
    const Eigen::Vector3d& position(int body) const { return positions()[std::size_t(body)]; }
    const Eigen::Vector3d& velocity(int body) const { return velocities()[std::size_t(body)]; }
    const Eigen::Vector3d& angular_velocity(int body) const { return angular_velocities()[std::size_t(body)]; }
    const Eigen::Quaterniond& orientation(int body) const { return orientations()[std::size_t(body)]; }

    void set_motion(int body, Motion motion);
    void set_pose(int body, const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation);
    void set_velocity(int body, const Eigen::Vector3d& velocity, const Eigen::Vector3d& angular_velocity);
    /// Replaces the shape in place (shape frame unmoved, velocities kept). Its contacts start anew.
    void set_shape(int body, int shape, double scale);
    /// Force [N] and torque about the centre of mass [N m] of something outside (the fluid); kept until set again.
    void set_external_force(int body, const Eigen::Vector3d& force, const Eigen::Vector3d& torque);
    void clear_external_forces();
    /// Inertia that a free body carries besides its own mass, per component: fluid that moves with it [kg]. It has no weight and takes no
    /// part in contact laws; may be negative while the sum stays positive. Not part of save(): set it again with the forces.
    void set_added_mass(int body, const Eigen::Vector3d& added);
    ///@}

    /// \name Walls
    ///@{
    int wall_count() const;
    /// Planes only; plates and cylinders stay. [m/s]
    void set_wall_velocity(int wall, const Eigen::Vector3d& velocity);
    const Eigen::Vector3d& wall_velocity(int wall) const;
    Eigen::Vector3d wall_point(int wall) const;   ///< of a plane; of a cylinder, on its axis at z = 0 [m]
    Eigen::Vector3d wall_normal(int wall) const;  ///< of a plane; of a cylinder, its axis
    const Eigen::Vector3d& wall_force(int wall) const;  ///< of the bodies on the wall, last step [N]
    ///@}

    void set_gravity(const Eigen::Vector3d& gravity);
    const Eigen::Vector3d& gravity() const;
    const Eigen::Vector3d& period() const;  ///< lengths of WorldOptions::period [m]
    void set_friction(int material, double friction);
    const Material& material(int id) const;

    /// \name Time
    ///@{
    double time() const;  ///< [s]
    /// 1/omega of the stiffest, lightest pair: sqrt(m_min/(2 kn)) [s]; infinite without free bodies. Stable below 2 of it.
    double critical_time_step() const;
    double auto_time_step() const;  ///< step_fraction times that, less for shapes with flat sides [s]
    /// \throws Error  dt above 1.5 critical steps (unless force_step), a body whose state is no number, a grid whose exterior distances
    ///                do not reach the radius of a sphere at it
    void step(double dt);
    /// Whole steps of equal length, at most `dt` each (0: automatic), that end `duration` later. Returns their number.
    int advance(double duration, double dt = 0);
    /// Overdamped relaxation of overlaps: bodies move by their contact force / kn, at most a twentieth of their radius at a time, and end at
    /// rest. Stops when the greatest overlap / radius is below `overlap` or after `max_iterations`; returns the iterations used.
    int relax(double overlap, int max_iterations);
    ///@}

    /// \name Reports
    ///@{
    std::vector<Contact> contacts() const;  ///< ordered by first, then second
    Energy energy() const;
    /// Starts the energy ledger anew.
    void reset_energy();
    Statistics statistics() const;
    /// Spheres that lie wholly inside the solid of another body: the greatest force of the contact law could not hold them, and they feel
    /// nothing of that body any more. Ordered.
    std::vector<int> swallowed() const;
    const Counters& counters() const;
    ///@}

    /// \name Restart
    ///@{
    /// Friction springs of all touching pairs, ordered; with positions and velocities they continue a packing elsewhere.
    std::vector<ContactSpring> contact_springs() const;
    void set_contact_springs(std::span<const ContactSpring> springs);
    /// Complete state (bodies, walls, springs, forces, time, ledger) as bytes. restore() on a world built by the same calls goes on bit
    /// for bit. \throws Error  bytes of another world, or damaged
    std::vector<std::uint8_t> save() const;
    void restore(std::span<const std::uint8_t> state);
    ///@}

    struct Impl;  ///< of this module alone

private:
    std::unique_ptr<Impl> impl_;
};

}  // namespace coral::dem
