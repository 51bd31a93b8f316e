#pragma once
/// \file fluid/immersed.h
/// Resolved grains and obstacles in the flow: solid fraction of faces from a signed distance, implicit Brinkman
/// forcing, hydrodynamic force and torque as the discrete reaction. Distances are negative in solid.
#include <Eigen/Geometry>
#include <functional>
#include <span>
#include <vector>

#include "fluid/flow.h"

namespace coral::fluid {

/// Signed distance [m] of each point [m], in the frame of the body; distances.size() == points.size(). Called from
/// several threads.
using DistanceFunction = std::function<void(std::span<const Eigen::Vector3d> points, std::span<double> distances)>;

/// Shape of a body in its own frame. The box holds the solid; outside it nothing is sampled.
struct BodyShape {
    DistanceFunction distance;
    Eigen::Vector3d box_min = Eigen::Vector3d::Zero();  ///< [m]
    Eigen::Vector3d box_max = Eigen::Vector3d::Zero();  ///< [m]
};

/// Sphere about the origin of its frame.
BodyShape sphere_shape(double diameter);
/// Plate lying in the x-y plane of its frame, |z| <= thickness/2, |x|, |y| <= half_size, with square holes of edge
/// `hole` in a square lattice of spacing `pitch`; a hole is centred on the frame's origin unless `holes_off_centre`,
/// then the origin lies amid four holes. \throws UsageError  hole not smaller than pitch
BodyShape plate_shape(double thickness, double hole, double pitch, const Eigen::Vector2d& half_size,
                      bool holes_off_centre = false);

/// Pose and velocity of a rigid body; position is the centre of mass = origin of the shape's frame. [m], [m/s], [rad/s]
/// world frame
struct RigidMotion {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
};

/// What the fluid does to a body over one step, hydrostatic buoyancy left out.
/// The caller advances U by   (m_p + M_w - m_f) dU = dt (force + contacts + (m_p - m_f) g)   [docs/numerics.md, eq. 11]
/// and omega with I_p + I_w - I_f alike (plus virtual mass when the grain is lighter than 0.8 of the fluid).
struct FluidAction {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();           ///< [N]
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();          ///< about the centre of mass [N m]
    Eigen::Vector3d forced_mass = Eigen::Vector3d::Zero();     ///< M_w = rho sum w V, per velocity component [kg]
    Eigen::Matrix3d forced_inertia = Eigen::Matrix3d::Zero();  ///< I_w, about the centre of mass [kg m2]
};

/// How much of a control volume is solid, from distances at its eight corners.
enum class FractionRule {
    corners,  ///< sum max(-d, 0) / sum |d|: the paper's. A bulging surface seems 0.17 cell^2 / radius too far in
    curved,   ///< the same, lowered by what the corners' mean distance is above that of the middle
};

struct ForcingOptions {
    double viscous_rate = 15.0;  ///< C1 of eq. 8; 20 goes with FractionRule::corners
    double inertial_rate = 0.5;  ///< C2 of eq. 8
    bool plain_blend =
        false;  ///< the paper's u = (1-phi) u + phi u_s: its drag depends on the time step; for comparison only
    double reshape_distance =
        0.0;  ///< a body keeps its faces until a point of it has moved this many cells; 0.05 saves time
    FractionRule fraction = FractionRule::curved;
};

class ImmersedBodies {
public:
    explicit ImmersedBodies(const GridSpec& grid, const ForcingOptions& options = {});
    ImmersedBodies(ImmersedBodies&&) noexcept;
    ImmersedBodies& operator=(ImmersedBodies&&) noexcept;
    ~ImmersedBodies();

    /// Adds a body; its index is returned. Faces are found at the next place().
    /// \param still  it has the same motion in measure() and apply() of every step, so that the former can do the latter's work on its
    /// faces while they are in the cache
    std::size_t add(BodyShape shape, const RigidMotion& motion, bool still = false);
    std::size_t size() const { return bodies_.size(); }

    /// Finds the faces of bodies that moved by more than reshape_distance since their faces were last found.
    /// \param motions  one per body, in the order of add(). Bodies wrap across periodic sides.
    void place(std::span<const RigidMotion> motions);

    /// Force and torque from the provisional velocity, with the motions at the start of the step  [docs/numerics.md, eq. 10,
    /// 12]:
    ///     F = (rho/dt) sum_faces w eps (u* - u_s) h3
    /// Weights w [eq. 8] are kept for apply(). \returns one action per body, valid until the next call
    /// \throws Error  when the flow has been driven through a body for many steps: its way is blocked
    std::span<const FluidAction> measure(Flow& flow, double dt, std::span<const RigidMotion> motions);

    /// u* <- u* + w (u_s - u*) with the motions at the end of the contact steps [eq. 7]; books the impulse in the
    /// flow's tally.
    void apply(Flow& flow, std::span<const RigidMotion> motions);
    /// What apply() gave the fluid on behalf of each body [N s]: their sum is the impulse booked in the flow's tally.
    std::span<const Eigen::Vector3d> impulses() const { return impulses_; }

    /// Solid fraction of cells, overlaps clipped at 1, padded like a field of the flow, ghosts 0.
    const Field& cell_solid_fraction() const { return cell_solid_; }
    /// Volume of a body as the cells of the domain see it [m3].
    double seen_volume(std::size_t body) const;
    /// Counts place() calls that changed anything.
    std::uint64_t version() const { return version_; }

    /// Poses at which the faces of each body were last found: to be stored in a checkpoint, and given to restore().
    std::vector<RigidMotion> placed_motions() const;
    /// Finds all faces anew at exactly these poses, so that a resumed run continues bit for bit.
    void restore(std::span<const RigidMotion> placed_motions);

private:
    struct Body;    // faces of one body
    struct Claim;   // one of several bodies on a face
    struct Shared;  // such a face
    struct Change;  // what a body that moved covers now

    Change rasterise(std::size_t body) const;
    void merge(std::vector<Change>& changes);
    void find_own(Body& body, int component);
    void find_shared(int component, std::span<const std::size_t> bodies);
    void weigh(Body& body) const;
    void watch_for_blockage(const Flow& flow, std::span<const Eigen::Vector3d> slip);

    GridSpec grid_;
    Layout layout_;
    ForcingOptions options_;
    std::vector<std::unique_ptr<Body>> bodies_;
    std::array<std::vector<Claim>, 3> claims_;   // of each component, by face and body
    std::array<std::vector<Shared>, 3> shared_;  // of each component
    std::vector<FluidAction> actions_;
    std::vector<int> driven_steps_;  ///< of each body: steps in a row in which the flow was driven through it
    std::vector<Eigen::Vector3d> impulses_;
    std::array<Field, 4> solid_sum_;  // of all bodies' fractions, on the faces of each component and in cells
    Field cell_solid_;
    std::uint64_t version_ = 0;
};

}  // namespace coral::fluid
