#pragma once
/// \file sdf/vdb_io.h
/// grains.vdb: per grain the grids `grain_<id>` (voids kept) and `grain_<id>_apparent` (filled), OpenVDB float level sets,
/// negative in solid. Grid values and transform are in millimetres (OpenVDB refuses voxel edges under 14 um; metadata
/// `world_unit` = "mm"), all other metadata is SI. The transform puts the solid's centre of mass at the origin.
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "core/record.h"
#include "sdf/level_set.h"

namespace coral::sdf {

/// Collects grains in compact form and writes them at once. The same grains give the same bytes.
class GrainWriter {
public:
    /// \throws Error when the folder is missing or not writable
    explicit GrainWriter(const std::filesystem::path& file);
    ~GrainWriter();
    /// Keeps a compact copy; grains may come in any order and are written by rising id. Not thread-safe.
    /// \throws Error when the id was given before
    void add(const GrainLevelSet& grain);
    /// Writes the file. \param history  the whole chain, this tool's entry last
    void commit(const History& history);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Reads one grain at a time.
class GrainReader {
public:
    /// \throws Error when the file is missing, is no .vdb, or lacks our grids or metadata
    explicit GrainReader(const std::filesystem::path& file);
    ~GrainReader();
    const std::vector<int>& ids() const;  ///< rising
    const History& history() const;
    /// Both grids dense, clamped to their bands (limits set). Thread-safe. \throws Error when absent or damaged
    GrainLevelSet read(int id) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

void write_grains(const std::filesystem::path& file, std::span<const GrainLevelSet> grains, const History& history);

struct GrainFile {
    std::vector<GrainLevelSet> grains;  ///< by rising id
    History history;
};
GrainFile read_grains(const std::filesystem::path& file);

}  // namespace coral::sdf
