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

/// Takes grains one by one and makes the file at the end. Meanwhile the compressed grids lie in a nameless file beside the target (as
/// large as it), not in memory. The same grains give the same bytes in whatever order they come.
class GrainWriter {
public:
    /// \throws Error when the folder is missing or not writable
    explicit GrainWriter(const std::filesystem::path& file);
    ~GrainWriter();
    /// The whole chain, this tool's entry last. Every grid carries it: call this before the first add().
    void set_history(const History& history);
    /// In any order, from several threads at once. \throws Error when the id was given before, or on a full disk
    void add(const GrainLevelSet& grain);
    /// Writes the file, grains by rising id. \throws Error on a full disk
    void commit();

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
