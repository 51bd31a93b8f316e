#pragma once
/// \file suffusion/motion_state.h
/// Whether a fine moves, rests or is clogged, from its mean speed between two outputs.
#include <cstdint>

namespace coral::suffusion {

/// As stored in /trajectories/state and /migration/state.
enum class FineState : std::int64_t {
    resting = 0,  ///< has not left its place since the start
    moving = 1,
    clogged = 2,  ///< stopped after it had moved
    eroded = 3,
};

/// State of one fine with hysteresis, so that jitter about one limit is no cycle of clogging and unclogging:
/// a fine starts to move above 4 d/s and stops below 1 d/s, d its diameter. Both are means between outputs, not momentary speeds.
class MotionState {
public:
    static constexpr double start_speed = 4, stop_speed = 1;  ///< [diameters per second]

    /// \param speed     path since the last output over the time since then [m/s]
    /// \param diameter  of the fine [m]
    void update(double speed, double diameter, bool eroded);

    FineState state() const { return state_; }
    std::int64_t cloggings() const { return cloggings_; }      ///< how often it stopped after moving
    std::int64_t uncloggings() const { return uncloggings_; }  ///< how often it moved on

    /// For a checkpoint.
    static MotionState restored(FineState state, std::int64_t cloggings, std::int64_t uncloggings);

private:
    FineState state_ = FineState::resting;
    std::int64_t cloggings_ = 0, uncloggings_ = 0;
};

}  // namespace coral::suffusion
