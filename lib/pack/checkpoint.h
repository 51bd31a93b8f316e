#pragma once
/// \file pack/checkpoint.h
/// State of a packing between two windows of steps, and the file that keeps it. A packing that goes on from it ends with the same bytes
/// as one that was never stopped. The file is replaced whole, so one that can be read is complete.
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "pack/pack.h"
#include "pack/spec.h"

namespace coral::pack {

enum class Phase { pouring, compression, relaxation };

/// How fast the servo of one pair of walls may be, and what its pressure lacked when it was last looked at [Pa].
struct ServoGain {
    double share = 1, missing = 0;
};

/// What a packing remembers besides its world.
struct PackState {
    Phase phase = Phase::pouring;
    int batch = 0;              ///< that settles, while pouring
    std::string random;         ///< stream of the pouring, after the batch was placed
    double start = 0;           ///< of the batch or phase, in the time of its world [s]
    bool own_friction = false;  ///< compression: walls still close in, with the friction of the material by now
    bool lid_touches = false;   ///< compression: the side walls have begun to move
    std::array<ServoGain, 3> gains;  ///< compression, by axis
    PackReport report;          ///< so far; wall times are those of all parts
};

/// What a packing is made from; a checkpoint goes on with the same only.
struct PackOrigin {
    std::string version;        ///< of the tools
    std::string specification;  ///< its text
    std::uint64_t seed = 0;
    std::vector<double> scales;                  ///< of lengths, by population
    std::map<std::string, std::string> files;  ///< names of shape files with a hash of what is in them
};

/// \throws Error when a file of shapes cannot be read
PackOrigin origin_of(const Spec& spec, std::uint64_t seed);

struct PackCheckpoint {
    PackOrigin origin;
    PackState state;
    std::vector<std::uint8_t> world;  ///< dem::World::save
};

/// \throws Error when it cannot be written
void write_checkpoint(const std::filesystem::path& file, const PackCheckpoint& checkpoint);

/// \throws Error when missing, damaged, or of another origin than `expected`: it says what differs
PackCheckpoint read_checkpoint(const std::filesystem::path& file, const PackOrigin& expected);

}  // namespace coral::pack
