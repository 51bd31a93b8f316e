#pragma once
/// \file suffusion/checkpoint.h
/// checkpoint.h5: the whole state of a run at the end of a step. It is replaced whole, so one that can be read is complete.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace coral::suffusion {

struct Checkpoint {
    double time = 0;                        ///< [s]
    std::size_t rows = 0;                   ///< rows of results.h5 that belong to it; later ones are dropped on resume
    std::size_t frames = 0;                 ///< frames written
    std::size_t cells = 0, bodies = 0;      ///< of the case, to tell another one
    std::string history;                    ///< JSON, for whoever finds the file; a resumed run makes its own
    std::vector<std::uint8_t> simulation;   ///< Simulation::save
    std::vector<std::uint8_t> observer;     ///< Observer::save
};

/// \throws Error when it cannot be written
void write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint);
/// \throws Error when missing or damaged
Checkpoint read_checkpoint(const std::filesystem::path& file);

}  // namespace coral::suffusion
