#pragma once
/// \file dem/detail/impl.h
/// The inside of a World: state as structure of arrays, neighbour lists, and the results of the contact loops.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <vector>

#include "dem/detail/contact_law.h"
#include "dem/detail/distance_field.h"
#include "dem/detail/facets.h"
#include "dem/detail/plate.h"
#include "dem/world.h"

namespace coral::dem {

using detail::LoopSums;
using detail::PairLaw;
using detail::Vec3;
using Quat = Eigen::Quaterniond;
using Index = std::int32_t;

struct WallData {
    enum class Kind : std::uint8_t { plane, plate, cylinder } kind = Kind::plane;
    Vec3 point = Vec3::Zero(), normal = Vec3::UnitZ(), velocity = Vec3::Zero(), force = Vec3::Zero();
    Vec3 reference = Vec3::Zero();  ///< point when the lists were made
    detail::Plate plate;
    double radius = 0;  ///< of a cylinder about the vertical through `point`
    int material = 0;

    /// Distance to the wall, positive where bodies belong, and its gradient.
    double distance_and_gradient(const Vec3& p, Vec3& gradient) const
    {
        if (kind == Kind::plate) return plate.distance_and_gradient(p, gradient);
        if (kind == Kind::plane) {
            gradient = normal;
            return normal.dot(p - point);
        }
        const Eigen::Vector2d across = p.head<2>() - point.head<2>();
        const double off_axis = across.norm();
        if (off_axis > 0.0) gradient << -across / off_axis, 0.0;
        else gradient = -Vec3::UnitX();
        return radius - off_axis;
    }
    /// Geometric mean of the two principal curvatures between a ball of radius r and the wall, over 1/r: sqrt(1 - r/R) in a cylinder of radius R.
    /// The area of contact grows by its inverse, so this keeps the stiffness of nodes at kn. Bodies that are long for their volume may
    /// have r near R or above it; they touch as if r were 3/4 R.
    double relative_curvature(double r) const { return kind == Kind::cylinder ? std::sqrt(1.0 - std::min(r / radius, 0.75)) : 1.0; }
};

/// One-point contact of a sphere with a sphere or a wall; the rest is in the memory of its list.
struct PointContact {
    Index a = 0, b = 0;  ///< b < 0: wall -1 - b
    Index entry = 0;     ///< in its list
};

/// What a one-point contact keeps from one step to the next, and what sums and reports take it from.
struct PointMemory {
    Vec3 spring = Vec3::Zero();
    Vec3 normal = Vec3::Zero();  ///< at the end of the last step
    Vec3 total = Vec3::Zero();   ///< force on a then; what of it is no spring's is dissipated
    double overlap = 0;
};

/// Any other contact (sphere on grid, nodes): forces and torques of both sides. points == 0: nothing touches.
struct GeneralForce {
    Index a = 0, b = 0;
    std::int32_t points = 0;
    double overlap = 0;
    Vec3 normal_force = Vec3::Zero(), tangential_force = Vec3::Zero(), torque_a = Vec3::Zero(), torque_b = Vec3::Zero();
    Vec3 arm = Vec3::Zero();  ///< contact point - position of a
};

/// Correction of the work of a spring in the step in which its contact opens or closes (see integrate.cpp).
struct Crossing {
    Index a, b;
    double energy;  ///< to give to (> 0) or take from (< 0) the relative motion along the normal
    Vec3 normal, arm_b;
    Vec3 arm_a = Vec3::Zero();  ///< beside the normal: zero for spheres
    Index pair = -1;            ///< of the node list, that keeps what cannot be given yet
    Index press = -1;           ///< of the list of spheres and grids, likewise
};

// Large enough that a small world runs in one block, without threads.
constexpr std::size_t body_grain = 1024, pair_grain = 1024, entry_grain = 2048, grid_grain = 512, node_grain = 16;

/// Half list of sphere pairs in compressed rows: partners of sphere i are other[row[i]..row[i+1]), ascending.
struct SphereList {
    std::vector<Index> row, other;
    std::vector<Index> one;           ///< the sphere of each pair's row
    std::vector<PointMemory> memory;
    std::vector<std::uint8_t> touch;  ///< 0 apart, 1 touching, 2 touching without force (clamped)
    std::vector<double> root_mass;    ///< sqrt(m*)
    std::vector<PointContact> out;    ///< who touches, block by block
    std::vector<Index> rows;          ///< spheres with partners
    std::vector<Index> block{0};      ///< first row of each block of the loop, and the end: about pair_grain pairs each, since low numbers have most of them
    std::size_t block_count() const { return block.size() - 1; }
    PointContact* out_of(std::size_t b) { return out.data() + row[std::size_t(block[b])]; }
    const PointContact* out_of(std::size_t b) const { return out.data() + row[std::size_t(block[b])]; }
    /// Of what the loop writes, for the entries that are there.
    void make_room()
    {
        out.resize(other.size());
        one.resize(other.size());
        block.assign(1, 0);
        for (std::size_t r = 0; r < rows.size(); ++r) {
            std::fill(one.begin() + row[r], one.begin() + row[r + 1], rows[r]);
            if (std::size_t(row[r + 1] - row[std::size_t(block.back())]) >= pair_grain || r + 1 == rows.size()) block.push_back(Index(r + 1));
        }
    }
};

struct SphereWallList {
    std::vector<Index> body, wall;
    std::vector<std::uint8_t> feature, touch;
    std::vector<PointMemory> memory;
    std::vector<PointContact> out;
    std::vector<Vec3> near_normal;  ///< for the loop: of those that touch
    std::vector<double> near_overlap;
    void make_room()
    {
        out.resize(body.size());
        near_normal.resize(body.size());
        near_overlap.resize(body.size());
    }
};

/// Friction springs of a pair, keyed by the normal in the frame of the grid: a sphere that rests on two walls of a groove
/// changes its nearest wall from step to step, and each wall keeps its spring.
struct Slots {
    static constexpr int nearest = 3;  ///< as many are used where only the nearest wall pushes
    static constexpr int count = 6;    ///< a ball in a ring touches it all around
    static constexpr double same_wall = 0.8;  ///< cosine: places on a sphere within 37 degrees of each other share a spring
    Vec3 spring[count] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
    Vec3 normal[count] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
    std::uint8_t used = 0, next = 0;
};
/// Force on the sphere of a pair, with its torques about the centres of both (that on the grid is of the counterforce).
struct Wrench {
    Vec3 force = Vec3::Zero(), torque_a = Vec3::Zero(), torque_b = Vec3::Zero();
    double power(const Vec3& velocity, const Vec3& spin_a, const Vec3& spin_b) const
    {
        return force.dot(velocity) + torque_a.dot(spin_a) + torque_b.dot(spin_b);
    }
};
/// What a sphere on a grid keeps from one step to the next: its forces by kind, and what springs hold.
struct PressMemory {
    Wrench push, pull, drag;  ///< elastic, of friction springs, of dashpots
    double stored = 0, stretched = 0;  ///< in the elastic contact and in the friction springs [J]
    double owed = 0.0;                 ///< error of the work that waits for correction [J]
    detail::CellMemory cell;
};
/// Way after which the triangles near a sphere are gathered anew, over its radius: in a close-fitting void every bit of way brings up many.
constexpr double stale_way = 0.01;
/// The part of a surface that a sphere may touch.
struct Pocket {
    std::shared_ptr<const detail::Facets> surface;
    std::vector<detail::FacetQuad> quads;  ///< triangles that may touch before they are gathered anew, nearest first
    double room = 0.0;                     ///< way from where they were gathered within which nothing touches [m]
};
struct SphereGridList {
    std::vector<Index> sphere, grid;
    std::vector<std::uint8_t> touch;
    std::vector<Slots> slots;
    std::vector<float> clearance;  ///< distance - radius when the list was made, rounded down [m]
    std::vector<PressMemory> press;
    // Where all walls push; empty with SphereScheme::nearest. Frame and scale of the shape.
    std::vector<Vec3> cut;       ///< centre of the sphere when its part of the surface was cut out [m]
    std::vector<double> within;  ///< of that place, so far it goes [m]; 0: the nearest wall alone pushes
    std::vector<Vec3> listed;    ///< centre of the sphere when the triangles near it were last gathered [m]
    std::vector<Pocket> pocket;
    std::vector<detail::CellMemory> beyond;  ///< where a second wall was looked for; not saved
    std::vector<Index> near;                 ///< for the loop: entries that may touch, block by block
    std::vector<GeneralForce> out;
    /// Of what only the loop needs, for the entries that are there.
    void make_room()
    {
        beyond.assign(sphere.size(), {});
        near.resize(sphere.size());
    }
};

/// A surface node that touches, and what it keeps from one step to the next: all at the end of the last step, world frame.
struct NodeContact {
    Index node = 0;
    Vec3 place = Vec3::Zero();           ///< of the node, shape frame
    std::uint8_t touch = 0;              ///< 1 touching, 2 touching without force (clamped)
    double depth = 0, stiffness = 0;     ///< stiffness: k_a A
    double force = 0;                    ///< along the gradient's direction; elastic, then with the dashpot's part
    Vec3 arm = Vec3::Zero();             ///< node - position of the slave
    Vec3 gradient = Vec3::Zero();        ///< not normalised
    Vec3 spring = Vec3::Zero();
    Vec3 pull = Vec3::Zero();            ///< force of the spring
    Vec3 drag = Vec3::Zero();            ///< force of dashpots and of what holds them back: its work is dissipated
    detail::CellMemory cell;
};

/// Share of the skin that a body may move before the lists are made anew: below one half, for trilinear distances may rise
/// a little faster than the way.
constexpr double free_path = 0.4;
/// Lattices may rise a little faster than the way: what was farther away than this times the way is not there yet.
constexpr double steepest = 1.25;
/// Skin of the lists of nodes / that of the spheres; shortest hop of a way / that skin.
constexpr double node_skin = 0.4, hop_share = 0.001;

/// How far the points of a body (or wall) have come, counted in hops: a body hops when one of its points may be `hop` from where it was at
/// the last hop. It grows only, and what a body that trembles in its place does is not counted. Between any two times
///     |way of any point| <= length(t2) - length(t1) + 2 hop.
struct Way {
    Vec3 x = Vec3::Zero();        ///< of the body at the last hop
    Quat q = Quat::Identity();
    double length = 0.0;          ///< [m]
    double listed = -std::numeric_limits<double>::infinity();  ///< length when its pairs were last looked at
};

/// Nodes of `slave` that are near `master` (a grid, or wall -1 - master). Pairs are in order; a pair without near nodes is listed as well,
/// so that it is known to have been looked at.
struct NodeList {
    std::vector<Index> slave, master, start;  ///< start has one more entry
    std::vector<double> share;                ///< 1, or 1/2 for the two directions of a pair
    std::vector<Index> node;                  ///< of a pair: ascending
    // A node that was last looked at with a clearance cannot touch before the ways of its bodies (see Way) have grown by as much.
    std::vector<float> clearance;             ///< distance when it was last looked at + the way of the pair until then, rounded down [m]
    std::vector<float> least;                 ///< clearance of a pair; infinite without near nodes
    std::vector<double> way_listed;           ///< of the pair, from which its way counts [m]
    std::vector<float> unlisted;              ///< no other node of a pair was nearer when it was looked at [m]; not saved, 0 after a restart
    std::vector<double> owed;                 ///< per pair: error of its work that waits for correction [J]
    std::vector<Index> first, count;          ///< contacts of a pair, within those of its block
    std::vector<std::vector<NodeContact>> contacts, fresh;  ///< per block; fresh is for the loop
    std::vector<GeneralForce> out;
    double skin = 0;                          ///< of these lists [m]
    std::vector<Way> ways, wall_ways;         ///< of bodies and walls
    std::span<const NodeContact> contacts_of(std::size_t pair) const;
    /// Springs for pairs of the list, as new contacts; others are ignored.
    void take_springs(std::vector<ContactSpring> springs);
    double way_of(Index body, Index partner) const
    {
        return ways[std::size_t(body)].length + (partner < 0 ? wall_ways[std::size_t(-1 - partner)] : ways[std::size_t(partner)]).length;
    }
    double hop() const { return hop_share * skin; }
    /// By how much distances may have shrunk beside what the ways say.
    double slack() const { return 4.0 * steepest * hop(); }
};


/// Angle between two orientations, or a little less [rad]: |q - q'| is half of it for small ones, and either sign of q is the same.
inline double turn_between(const Quat& a, const Quat& b)
{
    return 2.0 * std::sqrt(std::min((a.coeffs() - b.coeffs()).squaredNorm(), (a.coeffs() + b.coeffs()).squaredNorm()));
}

/// Pair of the broad phase.
struct BroadPair {
    Index a, b;
};

namespace detail {
class Presses;
}

struct World::Impl {
    WorldOptions options;
    std::vector<std::shared_ptr<const Shape>> shapes;
    std::vector<std::shared_ptr<const detail::Facets>> facets;  ///< per shape; made when a sphere comes near
    std::vector<Material> materials;
    std::vector<PairLaw> laws;  ///< materials x materials
    std::vector<WallData> walls;
    detail::Periodic periodic;

    // Bodies.
    std::vector<Vec3> x, v, w, momentum;  ///< momentum: angular, world frame
    std::vector<Vec3> w_before;           ///< angular velocity in the middle of the step, before the turn of its way (bodies with nodes)
    std::vector<Vec3> v_end;              ///< velocity foreseen at the end of the step, for damping
    std::vector<Quat> q;
    std::vector<Vec3> force, torque;      ///< of contacts
    std::vector<Vec3> external_force, external_torque;
    std::vector<Vec3> added_mass;         ///< inertia of the fluid that moves with a body, per component [kg]; empty or one per body
    std::vector<double> mass, inverse_mass, inverse_inertia;  ///< inverses are 0 unless free; the second for spheres
    std::vector<Vec3> principal;          ///< principal moments [kg m2]
    std::vector<double> radius;           ///< sphere radius, or bounding radius of another shape
    std::vector<double> equivalent, scale, density;
    std::vector<Index> shape, material;
    std::vector<Motion> motion;
    std::vector<std::uint8_t> in, has_nodes;  ///< has_nodes: no sphere; called a grid below
    std::vector<std::string> role;
    int active = 0;
    bool any_external = false, any_prescribed = false;

    // Lists.
    bool lists_valid = false, forces_valid = false;
    double skin = 0;
    std::vector<Vec3> x_reference;
    std::vector<Quat> q_reference;
    std::vector<double> moved2;      ///< squared way since the lists were made (or more) [m2]
    std::vector<double> grid_drift;  ///< longest way of a point of a body with nodes, likewise [m]
    bool mixed = false;  ///< spheres and grids are both there
    SphereList spheres;
    SphereWallList sphere_walls;
    SphereGridList sphere_grids;
    NodeList nodes;

    // Results of the last force computation.
    std::vector<std::int32_t> out_count[4];  ///< per block of spheres, sphere_walls, sphere_grids, nodes
    std::vector<LoopSums> block_sums;
    std::vector<std::vector<Crossing>> crossings;  ///< per block
    LoopSums sums;
    double time = 0;
    double dissipated_friction = 0, dissipated_damping = 0, gravity_work = 0, external_work = 0, wall_work = 0, initial = 0;
    double last_dt = 0, initial_account = 0;  ///< initial_account: on_account() when the ledger was started
    bool ledger_started = false;
    Counters counters;

    bool free(std::size_t i) const { return in[i] && motion[i] == Motion::free; }
    const PairLaw& law(Index material_a, Index material_b) const
    {
        return laws[std::size_t(material_a) * materials.size() + std::size_t(material_b)];
    }
    void update_laws();
    void update_mass(std::size_t i);
    /// w from the angular momentum of a grid.
    void update_spin(std::size_t i);
    void set_spin(std::size_t i, const Vec3& angular_velocity);
    Vec3 apply_inverse_inertia(std::size_t i, const Vec3& torque) const;
    double kinetic_energy(std::size_t i) const;
    double kinetic_energy() const;
    double on_account() const;
    std::string name(std::size_t i) const;

    // lists.cpp
    void make_lists();
    void make_blocks();
    std::shared_ptr<const detail::Facets> facets_of(Index shape_id);
    void drop_contacts(Index body);
    bool lists_expired();

    // lists_nodes.cpp
    /// Lists the nodes of these pairs; those whose bodies have hardly moved keep theirs. Without pairs: of the present ones.
    void list_nodes(const std::vector<BroadPair>* pairs);
    /// Lets a body hop where it has come far enough. \return its way since its pairs were last looked at [m]
    double note_way(std::size_t i)
    {
        Way& way = nodes.ways[i];
        const double now = (x[i] - way.x).norm() + turn_between(q[i], way.q) * radius[i];
        if (!(now <= nodes.hop())) {
            way.length += now;
            way.x = x[i];
            way.q = q[i];
        }
        return way.length - way.listed;
    }
    double note_wall_way(std::size_t k);

    // contacts_*.cpp: forces at the present positions; springs advance by dt.
    void compute_contacts(double dt);
    void sphere_loop(double dt);
    void sphere_wall_loop(double dt);
    void sphere_grid_loop(double dt);
    bool press_on_walls(std::size_t k, const Vec3& offset, const Vec3& local, GeneralForce& out, detail::Presses& presses);
    /// \param local  place of the sphere in the frame and scale of the grid
    bool is_cornered(std::size_t sphere, std::size_t grid, const Vec3& local, detail::CellMemory& here, detail::CellMemory& beyond) const;
    void make_pocket(std::size_t k);
    void gather_pocket(std::size_t k);
    void make_pocket_here(std::size_t k);
    void open_press(std::size_t k, double dt, LoopSums& s, std::vector<Crossing>& crossing);
    void node_loop(double dt);
    void sum_forces();
    void sum_forces(std::size_t first, std::size_t last);
    void refresh_forces();

    // integrate.cpp
    void check_step(double dt) const;
    void kick(double dt);
    double kick_body(std::size_t i, double dt, const Vec3& g_dt);
    double kick_with_added_mass(std::size_t i, double dt);
    struct Worn {
        bool lists, nodes;
    };
    Worn kick_and_drift(double dt);
    /// What moving some bodies came to.
    struct Drift {
        double gravity_work = 0, external_work = 0;
        double finite = 0;                       ///< no number when one of them is none
        double farthest = 0, node_farthest = 0;  ///< ways since the lists were made [m]
        Drift operator+(const Drift& o) const
        {
            return {gravity_work + o.gravity_work, external_work + o.external_work, finite + o.finite, std::max(farthest, o.farthest),
                    std::max(node_farthest, o.node_farthest)};
        }
    };
    Drift drift_bodies(std::size_t first, std::size_t last, double dt);
    void drift_body(std::size_t i, double dt, Drift& sum);
    void turn_grid(std::size_t i, double dt);
    void correct_crossings();
    void check_numbers() const;
    void constraint_work(double dt);
    void step(double dt);
    double critical_step() const;
    double automatic_step() const;
    double least_period(bool flat) const;
    mutable double known_critical_step = -1;  ///< negative: to be found anew
};

/// Broad phase: pairs a < b of active bodies with |x_a - x_b| < radius_a + radius_b + skin, ordered; pairs of bodies that both do not
/// move freely are left out. Cells by size class (factor 2), so that wide gradations cost no more than narrow ones.
std::vector<BroadPair> broad_phase(const World::Impl& world, double skin);

inline std::uint64_t key_of(Index a, Index b) { return std::uint64_t(std::uint32_t(a)) << 32 | std::uint32_t(b); }

inline double seconds_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace coral::dem
