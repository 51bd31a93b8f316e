#pragma once
/// \file suffusion/simulation.h
/// One coupled run in time: flow, resolved grains, fines and contact, advanced together by one flow step.
/// Order of a step [docs/numerics.md]: fines' felt fields and drag; predictor with semi-implicit drag; force on resolved grains
/// from the provisional velocity; contact steps with these forces; forcing with the new motions; projection.
#include <memory>
#include <optional>
#include <vector>

#include "fluid/flow.h"
#include "suffusion/fines.h"
#include "suffusion/grains.h"
#include "suffusion/scene.h"

namespace coral::suffusion {

/// Wall time of a run by phase [s] and its counts; the flow and the contact world keep their own.
struct Timing {
    double setup = 0, fines = 0, grains = 0, flow = 0, contact = 0, output = 0;
};

/// Balance of volume and momentum over the steps since it was last reset.
struct Balance {
    double mass = 0;      ///< greatest relative error of a step
    double momentum = 0;  ///< greatest relative error of a step
};

class Simulation {
public:
    /// \throws UsageError when the case cannot be run (inlet blocked by grains or plate)
    explicit Simulation(std::unique_ptr<Scene> scene);

    double time() const { return time_; }
    double dem_step() const { return dem_step_; }
    std::int64_t steps() const { return steps_; }
    double last_flow_step() const { return last_step_; }
    Scene& scene() { return *scene_; }
    const Scene& scene() const { return *scene_; }
    bool has_flow() const { return flow_.has_value(); }
    const fluid::Flow& flow() const { return *flow_; }
    const Grains& grains() const { return *grains_; }
    const Fines& fines() const { return *fines_; }
    const Timing& timing() const { return timing_; }
    Timing& timing() { return timing_; }
    /// Errors since the last call.
    Balance take_balance();
    const Balance& balance() const { return balance_; }

    /// One step that ends at `event` [s] at the latest. Ends exactly there when it gets so far.
    /// \throws Error when a velocity is no number or grows without bound, or the step collapses
    void step(double event);

    /// Fluid force and torque on a body over the last step, hydrostatic buoyancy left out [N], [N m].
    Eigen::Vector3d fluid_force(std::size_t body) const;
    Eigen::Vector3d fluid_torque(std::size_t body) const;
    bool eroded(std::size_t body) const { return eroded_[body] != 0; }
    /// Solid fraction of a cell by its padded index; 0 without grains.
    double solid_fraction(std::size_t at) const { return grains_ && !grains_->empty() ? grains_->immersed().cell_solid_fraction()[at] : 0; }

    /// \name Restart: everything a run remembers, as bytes. Goes on bit for bit in a simulation of the same case.
    ///@{
    std::vector<std::uint8_t> save() const;
    /// \throws Error for bytes of another case, or damaged ones
    void restore(std::span<const std::uint8_t> state);
    ///@}

private:
    void flow_step(double event);
    void contact_step(double event);
    double next_flow_step(double remaining) const;
    void sort_out_leavers();
    void check_inlet() const;
    void check_motion() const;
    void book_balance(const Eigen::Vector3d& owed);

    std::unique_ptr<Scene> scene_;
    std::optional<fluid::Flow> flow_;
    std::optional<Grains> grains_;
    std::optional<Fines> fines_;
    std::vector<std::uint8_t> eroded_;
    double time_ = 0, dem_step_ = 0, last_step_ = 0;
    std::int64_t steps_ = 0;
    Timing timing_;
    Balance balance_;
};

/// Grid of the flow of a case.
fluid::GridSpec grid_of(const Case& description);

}  // namespace coral::suffusion
