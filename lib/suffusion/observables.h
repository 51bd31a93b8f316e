#pragma once
/// \file suffusion/observables.h
/// What a run measures at every output: the series, trajectories and migration of results.h5. Definitions: docs/observables.md.
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "suffusion/flow_region.h"
#include "suffusion/motion_state.h"
#include "suffusion/results.h"
#include "suffusion/simulation.h"
#include "suffusion/trapping.h"

namespace coral::suffusion {

class Observer {
public:
    explicit Observer(const Simulation& simulation);

    /// Adds to the paths of the fines; to be called after every step. A path is made of straight pieces of at least a fiftieth of the diameter, so
    /// that it depends neither on outputs nor on steps, and grains that tremble at their place walk nowhere.
    void follow(const Simulation& simulation);
    /// Appends one row for the state now.
    void record(Simulation& simulation);
    const Results& results() const { return results_; }
    Results& results() { return results_; }

    /// For a checkpoint: paths, positions and states at the last output, trapped fines, as bytes. The rows themselves are in results.h5.
    std::vector<std::uint8_t> save() const;
    /// Goes on from stored results cut to `rows`.
    /// \throws Error when they are of another case
    void resume(Results stored, std::size_t rows, std::span<const std::uint8_t> state);

private:
    void record_erosion(const Simulation& simulation);
    void record_trapping(const Simulation& simulation);
    void record_flow(const Simulation& simulation);
    void record_flow_split(const Simulation& simulation);
    void record_forces(const Simulation& simulation);
    void record_contacts(const Simulation& simulation);
    void record_trajectories(const Simulation& simulation);
    void record_migration(const Simulation& simulation);
    void put(const char* name, const char* unit, double value) { put(name, unit, std::span(&value, 1)); }
    void put(const char* name, const char* unit, std::span<const double> values);
    /// Layer of a height, 0 the lowest; heights below and above the sample count to the outermost.
    std::size_t layer_of(double z) const;

    Results results_;
    double initial_fine_mass_ = 0;
    double bottom_ = 0, height_ = 0;  ///< of the sample at the start [m]
    std::size_t layers_ = 3;
    double reference_length_ = 0;  ///< along the flow, of the hydraulic gradient [m]
    int axis_ = 2, lower_plane_ = 0, upper_plane_ = 0;  ///< cells of the two pressure planes
    double direction_ = -1;                             ///< of the mean flow along the axis
    std::vector<Eigen::Vector3d> start_, last_;         ///< positions of fines, in the order of results_.fines
    std::vector<Eigen::Vector3d> mark_;                 ///< where the last piece of the path ended, in the same order
    std::vector<double> walked_;                        ///< path to there [m]
    std::vector<MotionState> motion_;                   ///< in the same order
    std::optional<RegionFinder> regions_;               ///< with flow
    std::vector<Trapped> trapped_;                      ///< at the last output
    ThroatLibrary throats_;
    double last_time_ = 0;                              ///< of the last output [s]
    std::size_t rows_before_ = 0;                       ///< outputs before the one being recorded
};

}  // namespace coral::suffusion
