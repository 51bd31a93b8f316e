#pragma once
/// \file pack/pack.h
/// The whole packing: grains drawn, poured in alternating layers, compressed, relaxed and measured.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "pack/sample.h"
#include "pack/spec.h"

namespace coral::pack {

/// How the packing went; for the summary of the tool.
struct PackReport {
    int layers = 0;             ///< batches poured
    int unsettled_layers = 0;   ///< batches that hit the time limit before they had settled
    bool compressed = true;     ///< whether the target was met within the time limit
    bool relaxed = true;        ///< whether the final relaxation met its limits
    std::int64_t steps = 0;     ///< of all phases
    double pouring_seconds = 0, compression_seconds = 0, relaxation_seconds = 0, loading_seconds = 0;  ///< wall time
    double relative_density = std::numeric_limits<double>::quiet_NaN();  ///< of the void ratio, voids included [-]; NaN without [density]
    double simulated_time = 0;  ///< of all phases [s]
    bool interrupted = false;   ///< stopped before its end; the checkpoint, if one is kept, goes on from here
    std::vector<std::string> warnings;
};

/// What goes on around a packing.
struct PackControl {
    std::filesystem::path checkpoint;  ///< file that keeps the state of the packing; empty: none
    bool resume = false;               ///< go on from that file; from the beginning while there is none
    double checkpoint_every = 300;     ///< wall time between checkpoints [s]
    /// Asked every few hundred steps; true ends the packing with a checkpoint.
    std::function<bool()> interrupted = [] { return false; };
    std::function<void(const std::string&)> message = [](const std::string&) {};
};

/// Makes a sample. The same specification and seed give the same sample for any number of threads.
///
/// 1. Grains are drawn and loaded (pack/populations.h).
/// 2. They are poured in alternating layers of coarse and fine: each batch is placed at random without overlap above what has settled,
///    turned at random, and falls. Contacts are softened by `stiffness_factor`, friction and damping are those of [dropping], and
///    velocities decay at the rate `drag`: this only shortens the settling.
/// 3. A new world with the true stiffness takes the grains over, overlaps relaxed. The walls close in until the target is met: each pair
///    moves with v = (p - p_mean) A / (K tau), at most max_velocity, where K is the sample's stiffness and tau its own time.
/// 4. Walls stand still, friction is the material's, and the sample comes to rest under its gravity.
/// 5. The lower corner of the box is shifted to the origin; contacts, springs, gradation, criteria and statistics are stored.
/// Walls are smooth throughout.
/// \param report  set anew
/// \throws UsageError  grains that do not fit
/// \throws Error       grains lost through a wall, or pressed into each other by more than half of the smaller radius; a checkpoint that is
///                     damaged or belongs to another packing
/// \return an empty sample when `report.interrupted`. A packing that was stopped and resumed gives the same sample as one that was not.
Sample pack(const Spec& spec, std::uint64_t seed, PackReport& report, const PackControl& control = {});

}  // namespace coral::pack
