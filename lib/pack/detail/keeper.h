#pragma once
/// \file pack/detail/keeper.h
/// Keeps the state of a packing on disk while its phases go on, and ends it when asked to.
#include <chrono>
#include <cstdint>
#include <vector>

#include "dem/world.h"
#include "pack/checkpoint.h"
#include "pack/pack.h"

namespace coral::pack::detail {

/// Thrown through the phases when the packing was asked to stop; the checkpoint is written by then.
struct Stopped {};

class Keeper {
public:
    /// Reads the checkpoint when asked to resume and there is one.
    Keeper(const PackControl& control, const Spec& spec, std::uint64_t seed);

    PackState state;  ///< the phases keep it up to date

    /// Whether the run goes on in this phase, from a checkpoint that restore() has not used yet.
    bool resumes(Phase phase) const { return !world_.empty() && state.phase == phase; }
    /// Whether the run goes on in a later phase.
    bool skips(Phase phase) const { return !world_.empty() && state.phase > phase; }
    /// State of a world built by the same calls. \throws Error when the bytes are those of another
    void restore(dem::World& world);

    /// Call between two windows of steps, when `state` and the world tell all there is to know.
    /// \throws Stopped when asked to stop
    void visit(const dem::World& world);
    /// As visit(), while there is nothing to keep yet.
    void visit() const;
    [[noreturn]] void damaged() const;

private:
    void write(const dem::World& world);

    const PackControl& control_;
    PackOrigin origin_;
    std::vector<std::uint8_t> world_;
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
    double cost_ = 0;  ///< of the last checkpoint [s]
};

/// Adds wall time to a total, lap by lap.
class LapClock {
public:
    explicit LapClock(double& total) : total_(total) {}
    ~LapClock() { lap(); }
    void lap()
    {
        const auto now = std::chrono::steady_clock::now();
        total_ += std::chrono::duration<double>(now - last_).count();
        last_ = now;
    }

private:
    double& total_;
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace coral::pack::detail
