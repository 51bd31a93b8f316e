#pragma once
/// \file fluid/flow.h
/// Incompressible flow on a staggered grid, with porosity from fines and room for forcing by resolved grains.
///
///     eps (du/dt + u.grad u) = -eps grad p + div(eps nu grad u) + eps f + (drag reaction of the fines)/rho
///     div(eps u + J_s) = 0
///
/// u is the interstitial velocity [m/s], p the kinematic pressure (dynamic pressure / density) [m2/s2], eps the void
/// fraction (1 without fines and inside resolved grains), J_s the volume flux of the fines [m/s]. Adams-Bashforth 2
/// (Euler on the first step), third-order upwind-biased convection, explicit viscosity, one incremental
/// constant-coefficient projection a step. A step of a coupled run is, in order:
///
///     dt = flow.stable_time_step()
///     fines.deposit(...)                       porosity, J_s, drag fields (fluid/porous.h); leave out without fines
///     flow.predict(dt)                         u* = everything but the grains' forcing and the new pressure
///     fines.add_drag_lag(...)                  what the semi-implicit drag took from the fluid beyond the explicit
///     force bodies.measure(flow, dt, old motions)    force and torque on resolved grains (fluid/immersed.h)
///     ... contact solver moves grains and fines ...
///     bodies.apply(flow, new motions)          forcing of u*
///     flow.project(dt)                         pressure increment, new u and p, boundary rows
#include <array>
#include <cstdint>
#include <limits>
#include <memory>

#include "fluid/flow_field.h"
#include "fluid/grid.h"

namespace coral::fluid {

enum class Convection {
    none,   ///< Stokes flow
    up3,    ///< kappa = 1/3 upwind-biased, unlimited: the default
    koren,  ///< the same, limited: robust, more dissipative
};

/// How convection, viscosity and the old pressure gradient are stepped  [docs/numerics.md, eqs. 4 and 15]
enum class TimeScheme {
    adams_bashforth,  ///< second order, one evaluation a step: the default
    runge_kutta,      ///< three evaluations and runge_kutta_reach times the step: where grains and fines cost more than the flow
};

/// Steps of Runge-Kutta over those of Adams-Bashforth. Three would be stable by the theory of one equation; in arrays of grains at Re 500 velocity spikes appear from 2.5 on.
inline constexpr double runge_kutta_reach = 2.2;

struct FlowOptions {
    double density = 1000.0;                                      ///< [kg/m3]
    double kinematic_viscosity = 1e-6;                            ///< [m2/s]
    Eigen::Vector3d body_acceleration = Eigen::Vector3d::Zero();  ///< on the fluid only [m/s2]
    Convection convection = Convection::up3;
    TimeScheme scheme = TimeScheme::adams_bashforth;
    /// Of sum_i |u_i| dt / cell for Adams-Bashforth, at most 0.6 (beyond 0.8 it is unstable); Runge-Kutta takes runge_kutta_reach times that step.
    double cfl = 0.5;
    double max_time_step = std::numeric_limits<double>::infinity();  ///< [s]
    Precision precision = Precision::float64;                        ///< of all fields of the flow
    double first_step_factor = 0.1;  ///< the first step is this part of the stable one...
    double step_growth = 1.2;        ///< ...and grows by at most this from step to step
};

/// Fields that fines put on the fluid, written by FineCoupling. Face fields belong to the velocity component of their
/// axis.
struct PorousFields {
    FlowField void_fraction;              ///< eps at centres, ghosts filled [-]
    std::array<FlowField, 3> solid_flux;  ///< J_s on faces [m/s]
    std::array<FlowField, 3> drag_rate;   ///< sum_i w b_i / (rho V) on faces [1/s]
    std::array<FlowField, 3> drag_force;  ///< sum_i w F_i / (rho V) on faces, F_i the explicit force on the fines [m/s2]
};

/// Momentum of the fluid and every impulse it received during the last step [N s].
/// after - before = boundary_flux + boundary_pressure + body + drag + forcing - fines_pressure, to round-off.
struct MomentumTally {
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    Eigen::Vector3d after = Eigen::Vector3d::Zero();
    Eigen::Vector3d boundary_flux = Eigen::Vector3d::Zero();      ///< convection and shear through the domain's sides
    Eigen::Vector3d boundary_pressure = Eigen::Vector3d::Zero();  ///< pressure on the domain's sides
    Eigen::Vector3d body = Eigen::Vector3d::Zero();               ///< body acceleration
    Eigen::Vector3d drag = Eigen::Vector3d::Zero();               ///< drag of the fines on the fluid
    Eigen::Vector3d fines_pressure =
        Eigen::Vector3d::Zero();                        ///< pressure gradient's impulse on the fines (not on the fluid)
    Eigen::Vector3d forcing = Eigen::Vector3d::Zero();  ///< forcing by resolved grains and obstacles, on the fluid
    /// Momentum that the motion of the porosity field would have created or lost; a uniform acceleration takes it out
    /// again, so it is no term of the balance. Its size tells how coarse the fines' kernel is for the step.
    Eigen::Vector3d porosity_defect = Eigen::Vector3d::Zero();

    /// |after - before - sum of impulses| over the sum of their magnitudes (0 when nothing acts).
    double relative_error() const;
};

/// Volume balance of the last step.
struct MassTally {
    double max_divergence = 0.0;  ///< max |div(eps u + J_s)| [1/s]
    double net_flux = 0.0;        ///< outflow minus inflow over all sides, with the fines' volume [m3/s]
    double inflow = 0.0;          ///< volume entering [m3/s]
    double velocity_scale = 0.0;  ///< max sum_i |u_i| [m/s]
    double cell = 0.0;
    /// Larger of max_divergence cell / velocity_scale and |net_flux| / inflow.
    double relative_error() const;
};

/// Wall time per phase since construction [s].
struct FlowTimes {
    double predictor = 0.0, forcing = 0.0, poisson = 0.0, correction = 0.0, fines = 0.0;
    std::uint64_t steps = 0;
    double total() const { return predictor + forcing + poisson + correction + fines; }
};

/// Everything a flow remembers between steps: restoring it continues bit for bit.
struct FlowState {
    std::array<FlowField, 3> velocity;  ///< with ghosts
    FlowField pressure;                 ///< kinematic
    /// Of the last step: eps times the right-hand side (Adams-Bashforth), the acceleration by drag and forcing (Runge-Kutta)
    std::array<FlowField, 3> previous_rate;
    FlowField void_fraction;            ///< empty without fines
    std::vector<double> scalars;
};

class Poisson;
namespace detail {
struct FaceRange;
struct Stage;
template <class Real>
struct ComponentView;
}

class Flow {
public:
    /// Fluid at rest (inlets excepted), pressure 0.
    /// \throws UsageError  GridSpec::validate, density or viscosity not positive, cfl out of (0, max_cfl(scheme)]
    Flow(const GridSpec& grid, const FlowOptions& options);

    const GridSpec& grid() const { return grid_; }
    const Layout& layout() const { return layout_; }
    const FlowOptions& options() const { return options_; }

    /// u (axis 0), v or w of the last whole step, ghosts filled [m/s].
    const FlowField& velocity(int axis) const { return velocity_[axis]; }
    /// Kinematic pressure at centres, ghosts filled [m2/s2]; times density it is the dynamic pressure [Pa].
    const FlowField& pressure() const { return pressure_; }
    /// Provisional velocity between predict() and project(); forcing writes here. Valid on the unknown faces.
    FlowField& provisional(int axis) { return provisional_[axis]; }
    const FlowField& provisional(int axis) const { return provisional_[axis]; }
    /// Sets an initial velocity from a function of position and component; boundary rows are then applied. Not
    /// projected.
    template <class Function>
    void set_velocity(const Function& velocity);
    /// Applies boundary rows and ghosts to velocities written through set_velocity, and forgets the step history.
    void restart_history();
    void set_body_acceleration(const Eigen::Vector3d& acceleration) { options_.body_acceleration = acceleration; }

    /// Largest stable step [s]: reach 1.5 cfl / (12 nu/h2 + 1.5 max sum_i |u_i|/h), capped and grown slowly  [docs/numerics.md, eq. 14].
    double stable_time_step() const;
    /// Convection, viscosity, old pressure gradient, body acceleration and semi-implicit drag of the fines. \param dt
    /// [s]
    void predict(double dt);
    /// Pressure increment, new velocity and pressure, boundary rows, tallies. Same dt as predict().
    /// \throws Error  when the velocity is no longer finite
    void project(double dt);
    /// predict() and project(), for a flow without grains.
    void step(double dt)
    {
        predict(dt);
        project(dt);
    }

    /// True once fines have been deposited.
    bool porous() const { return has_fines_; }
    const PorousFields& porous_fields() const { return porous_; }
    /// For FineCoupling: allocates the fields on first use.
    PorousFields& porous_fields_for_writing();
    /// For FineCoupling: takes a new void fraction (centres; ghosts are filled here), gives the old one back in its
    /// place, and books the momentum that the change moves.
    void change_void_fraction(FlowField& void_fraction);
    /// Void fraction on face (i, j, k) = linear index `at` of component `axis`; 1 without fines.
    double face_void_fraction(int axis, std::size_t at) const
    {
        return has_fines_
                   ? 0.5 * (porous_.void_fraction[at] + porous_.void_fraction[at - std::size_t(layout_.stride[axis])])
                   : 1.0;
    }

    /// For ImmersedBodies: acceleration [m/s2] of the faces of a component, to which a step's forcing is added; null where
    /// the time scheme does not ask for it.
    FlowField* held_acceleration(int axis) { return held_[axis].empty() ? nullptr : &held_[axis]; }
    /// Length of the step that predict() was called with [s].
    double step_length() const { return step_; }
    /// For ImmersedBodies: books an impulse that the forcing gave the fluid [N s].
    void add_forcing_impulse(const Eigen::Vector3d& impulse) { momentum_.forcing += impulse; }

    const MomentumTally& momentum() const { return momentum_; }
    const MassTally& mass() const { return mass_; }
    FlowTimes& times() { return times_; }
    const FlowTimes& times() const { return times_; }

    /// Mean of eps u over the domain: the superficial velocity [m/s].
    Eigen::Vector3d mean_superficial_velocity() const;
    /// Area mean of the kinematic pressure on a side of the domain [m2/s2].
    double mean_boundary_pressure(Face side) const;
    /// Volume flux out of the domain through a side [m3/s].
    double boundary_outflow(Face side) const;
    /// Velocity at the centre of a cell [m/s].
    Eigen::Vector3d cell_velocity(int i, int j, int k) const;
    Eigen::Vector3d cell_centre(int i, int j, int k) const
    {
        return grid_.origin + grid_.cell * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5);
    }

    FlowState save() const;
    /// \throws Error  state of another grid
    void restore(const FlowState& state);

private:
    FlowField make_field(double value = 0.0) const { return FlowField(layout_.total, options_.precision, value); }
    template <class Real, bool porous, Convection convection>
    void sweep_components(const detail::Stage& stage);
    template <Convection convection>
    void sweep_all(const detail::Stage& stage);
    void sweep(const detail::Stage& stage);
    void start_next_stage();
    void run_stages(double dt);
    template <class Real, bool porous, Convection convection>
    double side_flux(const detail::ComponentView<Real>& view, int direction, int side) const;
    template <class Real, bool porous, Convection convection>
    Eigen::Vector3d boundary_flux_rate() const;
    template <class Real, Convection convection>
    Eigen::Vector3d boundary_flux_rate() const;
    Eigen::Vector3d boundary_flux_rate() const;
    template <class Real>
    void apply_fines(double dt);
    template <class Real>
    void build_volume_flux();
    template <class Real>
    void find_source(double dt);
    template <class Real>
    void correct(double dt);
    template <class Real>
    void relax_pressure(double part);
    template <class Real>
    double correct_row(int axis, const detail::FaceRange& range, int j, int k, double dt);
    template <class Real>
    Eigen::Vector2d largest_divergence_and_speed() const;
    void diagnose();
    void balance_sides();
    void fill_velocity_ghosts();
    void fill_centre_ghosts(FlowField& f) const;
    void fill_pressure_ghosts();
    void apply_given_velocities(std::array<FlowField, 3>& velocity) const;
    template <class Real, class Value>
    double sum_over_faces(int axis, const Value& value) const;
    void find_fluid_mass();
    Eigen::Vector3d total_momentum() const;
    Eigen::Vector3d boundary_pressure_force() const;

    GridSpec grid_;
    Layout layout_;
    FlowOptions options_;
    std::shared_ptr<const Poisson> poisson_;
    std::array<FlowField, 3> velocity_, provisional_, rate_;  // rate_: eps R of the last predict
    std::array<FlowField, 3> volume_flux_;                    // eps u on faces; empty without fines
    // With several evaluations a step; empty with one:
    std::array<FlowField, 3> start_;  // u^n while velocity_ holds a stage
    std::array<FlowField, 3> held_;   // acceleration by drag and forcing in the last step [m/s2]
    FlowField pressure_;
    FlowField work_;     // right-hand side and solution of the Poisson equation
    FlowField turned_;   // the same with another axis slowest, where the solver needs it
    PorousFields porous_;
    bool has_fines_ = false;
    MomentumTally momentum_;
    MassTally mass_;
    FlowTimes times_;
    Eigen::Vector3d fluid_mass_ = Eigen::Vector3d::Zero();     // of the unknown faces, per component [kg]
    Eigen::Vector3d flux_rate_ = Eigen::Vector3d::Zero();      // boundary fluxes of the last predict [N]
    Eigen::Vector3d advective_sum_ = Eigen::Vector3d::Zero();  // rho sum u div q of the last predict [N]
    Eigen::Vector3d advective_impulse_ = Eigen::Vector3d::Zero();  // the same as the step combines it [N s]
    Eigen::Vector3d pending_defect_ = Eigen::Vector3d::Zero();  // momentum moved by change_void_fraction [N s]
    double previous_dt_ = 0.0;                                  // 0: no history
    double step_ = 0.0;
    double step_limit_ = std::numeric_limits<double>::infinity();
    double max_speed_ = 0.0;  // max sum_i |u_i| [m/s]
};

/// Largest stable FlowOptions::cfl.
double max_cfl(TimeScheme scheme);

/// The step to take next so that the remaining time [s] is cut into equal steps, none longer than `stable`.
double fit_time_step(double stable, double remaining);

template <class Function>
void Flow::set_velocity(const Function& velocity)
{
    for (int axis = 0; axis < 3; ++axis)
        for (int k = 0; k <= grid_.cells.z(); ++k)
            for (int j = 0; j <= grid_.cells.y(); ++j)
                for (int i = 0; i <= grid_.cells.x(); ++i) {
                    Eigen::Vector3d x(i + 0.5, j + 0.5, k + 0.5);
                    x[axis] -= 0.5;
                    velocity_[axis].set(layout_.index(i, j, k), velocity(Eigen::Vector3d(grid_.origin + grid_.cell * x), axis));
                }
    restart_history();
}

}  // namespace coral::fluid
