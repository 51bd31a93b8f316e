#include "suffusion/checkpoint.h"

#include <algorithm>

#include "core/error.h"
#include "core/formats.h"
#include "core/hdf5.h"

namespace coral::suffusion {

void write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint)
{
    H5File h5 = H5File::create(file);
    h5.set_format(file_format::checkpoint);
    h5.set_deflate(false);
    h5.set_attribute("/", "time", checkpoint.time);
    h5.set_attribute("/", "rows", static_cast<std::int64_t>(checkpoint.rows));
    h5.set_attribute("/", "frames", static_cast<std::int64_t>(checkpoint.frames));
    h5.set_attribute("/", "cells", static_cast<std::int64_t>(checkpoint.cells));
    h5.set_attribute("/", "bodies", static_cast<std::int64_t>(checkpoint.bodies));
    h5.set_attribute("/", "history", checkpoint.history);
    h5.write("/simulation", std::span<const std::uint8_t>(checkpoint.simulation), {checkpoint.simulation.size()});
    h5.write("/observer", std::span<const std::uint8_t>(checkpoint.observer), {checkpoint.observer.size()});
    h5.commit();
}

Checkpoint read_checkpoint(const std::filesystem::path& file)
{
    const H5File h5 = H5File::open(file);
    h5.require_format(file_format::checkpoint);
    if (!h5.exists("/simulation") || !h5.exists("/observer")) throw Error(file.string(), "is no checkpoint", "run without --resume to start anew");
    const auto count = [&](const char* name) { return static_cast<std::size_t>(std::max<std::int64_t>(h5.integer_attribute("/", name), 0)); };
    Checkpoint checkpoint;
    checkpoint.time = h5.number_attribute("/", "time");
    checkpoint.rows = count("rows");
    checkpoint.frames = count("frames");
    checkpoint.cells = count("cells");
    checkpoint.bodies = count("bodies");
    if (h5.has_attribute("/", "history")) checkpoint.history = h5.string_attribute("/", "history");
    checkpoint.simulation = h5.read_bytes("/simulation");
    checkpoint.observer = h5.read_bytes("/observer");
    return checkpoint;
}

}  // namespace coral::suffusion
