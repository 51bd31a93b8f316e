#pragma once
/// \file dem/body.h
/// What a World is built from (bodies, materials, walls) and what it reports (contacts, energies, statistics).
/// SI units; all vectors in the world frame unless said otherwise.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

namespace coral::dem {

/// free: moves by the forces on it; fixed: never moves; prescribed: keeps its velocities whatever the forces.
enum class Motion : std::uint8_t { free, fixed, prescribed };

/// Contact law of one material (Table 2 of the paper). Two materials in contact: stiffness harmonic mean, damping ratio mean,
/// friction the smaller.
struct Material {
    std::string name = "default";
    double density = 2780;              ///< [kg/m3]
    double normal_stiffness = 2e5;      ///< kn [N/m]
    double tangential_stiffness = 1e5;  ///< kt [N/m]
    double friction = 0.7;              ///< mu [-]
    double damping = 0.3;               ///< ratio zeta to critical [-]: c_n = 2 zeta sqrt(m* kn), c_t = 2 zeta sqrt(m* kt)
};

/// Damping ratio that gives the coefficient of restitution e in (0, 1] to two spheres of the linear law whose force never pulls:
///     e = exp(-(zeta/w) (pi - atan2(2 zeta w, 1 - 2 zeta^2))), w = sqrt(1 - zeta^2)      [linear spring and dashpot without tension]
/// \throws Error  e outside (0, 1]
double damping_of_restitution(double restitution);
/// The e of that equation, for 0 <= zeta < 1.
double restitution_of_damping(double damping);

struct BodySpec {
    int shape = 0;     ///< from World::add_shape
    int material = 0;  ///< from World::add_material
    std::string role = "coarse";
    double scale = 1;  ///< multiplies the lengths of the shape [-]
    Eigen::Vector3d position = Eigen::Vector3d::Zero();               ///< of the centre of mass [m]
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< shape frame to world
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();               ///< [m/s]
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();       ///< [rad/s]
    Motion motion = Motion::free;
    std::optional<double> density;  ///< [kg/m3]; else that of the material
};

/// One touching pair, summed over its nodes. `second` >= 0 is a body; -1 - w is wall w.
struct Contact {
    int first = 0, second = 0;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< force-weighted centre [m]
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from second towards first
    Eigen::Vector3d normal_force = Eigen::Vector3d::Zero();      ///< on first, elastic and damping [N]
    Eigen::Vector3d tangential_force = Eigen::Vector3d::Zero();  ///< on first [N]
    double overlap = 0;  ///< greatest depth [m]
    int points = 1;      ///< touching nodes
};

/// How a sphere feels a grid.
enum class SphereScheme {
    automatic,  ///< `walls` for a pair that has come near a second wall, until it parts; `nearest` for the others
    nearest,  ///< one query of the distance at its centre: the nearest wall pushes. Cheapest; where two walls are within its radius (throats, grooves,
              ///< voids) the lattice makes room narrower by up to 0.7 spacings, a wedge is half as stiff, and a sphere that is pressed into a
              ///< groove never rests: the walls push in turn, and pump energy into it
    walls,    ///< pressed on the triangulated surface (dem/detail/facets.h): every wall pushes, throats are true to 0.1 spacing; a few times the cost
};

/// Words of specifications and cases, in the order of SphereScheme.
inline const std::vector<std::string> sphere_scheme_words{"automatic", "nearest", "walls"};
/// \pre one of the words
inline SphereScheme sphere_scheme_of(const std::string& word)
{
    return SphereScheme(std::find(sphere_scheme_words.begin(), sphere_scheme_words.end(), word) - sphere_scheme_words.begin());
}

/// One friction spring: what the contact law remembers between steps.
struct ContactSpring {
    int first = 0, second = 0;  ///< as in Contact; for node contacts `first` is the body whose nodes touch
    int node = 0;               ///< node of the first body, or slot of a sphere contact
    Eigen::Vector3d spring = Eigen::Vector3d::Zero();  ///< elongation [m]
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< contact normal of the slot (sphere on grid, in the frame of the grid); else zero
    bool cornered = false;  ///< sphere on grid: it presses on every wall, found so under SphereScheme::automatic
};

/// Energy ledger [J]. What comes in by work minus what went is what is there:
///     kinetic + elastic_normal + elastic_tangential = initial + gravity_work + external_work + wall_work - friction - damping + closure
struct Energy {
    double kinetic = 0, elastic_normal = 0, elastic_tangential = 0;  ///< now
    double initial = 0;        ///< kinetic + elastic when the ledger was started
    double gravity_work = 0;   ///< on free bodies, since then
    double external_work = 0;  ///< of set_external_force
    double wall_work = 0;      ///< of moving walls and prescribed bodies, and of bodies added or removed
    double friction = 0, damping = 0;  ///< dissipated: work of friction that no spring keeps; of dashpots, and where they hold contacts back
    /// Error of the balance. Left out of it is what the scheme holds in the middle of contacts and pays back by their end: the part of
    /// velocity Verlet that is second order in the step, and errors of work on their way back to the motion.
    double closure = 0;
    double stored() const { return kinetic + elastic_normal + elastic_tangential; }
};

struct Statistics {
    double coordination = 0;      ///< 2 body-body contacts / bodies [-]
    double max_overlap = 0;       ///< greatest depth / equivalent radius of the smaller body [-]
    double unbalanced_ratio = 0;  ///< mean |net force| on a touching free body / mean |normal contact force| [-]; 0 without contacts
    double kinetic_energy = 0;    ///< [J]
    double max_speed = 0;         ///< of a free body [m/s]
    std::int64_t contacts = 0;    ///< touching pairs, walls included
    std::int64_t deep_contacts = 0;  ///< touching pairs whose overlap was capped at the last step (see WorldOptions::overlap_cap)
};

/// Work done since the world was made, for /performance.
struct Counters {
    std::int64_t steps = 0;
    std::int64_t rebuilds = 0;      ///< of the neighbour lists
    std::int64_t contacts = 0;      ///< touching pairs, summed over steps
    std::int64_t pair_tests = 0;    ///< listed pairs looked at, summed over steps
    std::int64_t node_tests = 0;    ///< distance queries in contact loops, summed over steps
    double seconds_pairs = 0, seconds_integration = 0, seconds_lists = 0;  ///< wall time per phase
};

}  // namespace coral::dem
