#include "suffusion/motion_state.h"

namespace coral::suffusion {

void MotionState::update(double speed, double diameter, bool eroded)
{
    if (eroded) {
        state_ = FineState::eroded;
    } else if (state_ == FineState::moving && speed < stop_speed * diameter) {
        state_ = FineState::clogged;
        ++cloggings_;
    } else if (state_ != FineState::moving && speed > start_speed * diameter) {
        if (state_ == FineState::clogged) ++uncloggings_;
        state_ = FineState::moving;
    }
}

MotionState MotionState::restored(FineState state, std::int64_t cloggings, std::int64_t uncloggings)
{
    MotionState made;
    made.state_ = state;
    made.cloggings_ = cloggings;
    made.uncloggings_ = uncloggings;
    return made;
}

}  // namespace coral::suffusion
