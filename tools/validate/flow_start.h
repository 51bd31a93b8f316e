#pragma once
/// \file tools/validate/flow_start.h
/// Starts a fine flow from a coarse one of the same domain: what is left to adjust is local, so that steady states come sooner.
#include <algorithm>
#include <cmath>

#include "fluid/flow.h"

namespace coral::validate {

/// Trilinear value of a padded field at a point given in cells from the field's own first place, ghosts included.
inline double padded_value(const fluid::Layout& layout, const fluid::FlowField& field, Eigen::Vector3d x)
{
    Eigen::Vector3i low;
    for (int d = 0; d < 3; ++d) {
        x[d] = std::clamp(x[d], -1.0, layout.cells[d] + 0.999);
        low[d] = static_cast<int>(std::floor(x[d]));
        x[d] -= low[d];
    }
    double value = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
        const double weight = (i ? x[0] : 1 - x[0]) * (j ? x[1] : 1 - x[1]) * (k ? x[2] : 1 - x[2]);
        value += weight * field[layout.index(low[0] + i, low[1] + j, low[2] + k)];
    }
    return value;
}

/// Velocity and pressure of `coarse` onto `flow`.
inline void start_from(const fluid::Flow& coarse, fluid::Flow& flow)
{
    const fluid::GridSpec& from = coarse.grid();
    flow.set_velocity([&](const Eigen::Vector3d& x, int axis) {
        Eigen::Vector3d place = (x - from.origin) / from.cell - Eigen::Vector3d::Constant(0.5);
        place[axis] += 0.5;
        return padded_value(coarse.layout(), coarse.velocity(axis), place);
    });
    fluid::FlowState state = flow.save();
    const double ratio = flow.grid().cell / from.cell;
    for (int k = -1; k <= flow.grid().cells.z(); ++k)
        for (int j = -1; j <= flow.grid().cells.y(); ++j)
            for (int i = -1; i <= flow.grid().cells.x(); ++i) {
                const Eigen::Vector3d place = ratio * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5) - Eigen::Vector3d::Constant(0.5);
                state.pressure.set(flow.layout().index(i, j, k), padded_value(coarse.layout(), coarse.pressure(), place));
            }
    flow.restore(state);
}

}  // namespace coral::validate
