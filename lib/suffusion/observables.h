#pragma once
/// \file suffusion/observables.h
/// What a run measures at every output: the series, trajectories and migration of results.h5. Definitions: docs/observables.md.
#include <Eigen/Core>
#include <span>
#include <vector>

#include "suffusion/results.h"
#include "suffusion/simulation.h"

namespace coral::suffusion {

class Observer {
public:
    explicit Observer(const Simulation& simulation);

    /// Appends one row for the state now.
    void record(Simulation& simulation);
    const Results& results() const { return results_; }
    Results& results() { return results_; }

    /// For a checkpoint: path lengths and positions at the last output, as bytes. The rows themselves are in results.h5.
    std::vector<std::uint8_t> save() const;
    /// Goes on from stored results cut to `rows`.
    /// \throws Error when they are of another case
    void resume(Results stored, std::size_t rows, std::span<const std::uint8_t> state);

private:
    void record_erosion(const Simulation& simulation);
    void record_flow(const Simulation& simulation);
    void record_flow_split(const Simulation& simulation);
    void record_forces(const Simulation& simulation);
    void record_contacts(const Simulation& simulation);
    void record_trajectories(const Simulation& simulation);
    void record_migration(const Simulation& simulation);
    void put(const char* name, const char* unit, double value) { put(name, unit, std::initializer_list<double>{value}); }
    void put(const char* name, const char* unit, std::initializer_list<double> values);

    Results results_;
    double initial_fine_mass_ = 0;
    double reference_length_ = 0;  ///< along the flow, of the hydraulic gradient [m]
    int axis_ = 2, lower_plane_ = 0, upper_plane_ = 0;  ///< cells of the two pressure planes
    double direction_ = -1;                             ///< of the mean flow along the axis
    std::vector<Eigen::Vector3d> start_, last_;         ///< positions of fines, in the order of results_.fines
};

}  // namespace coral::suffusion
