#include "suffusion/checkpoint.h"

#include "core/error.h"
#include "core/hdf5.h"

namespace coral::suffusion {

namespace {

constexpr std::int64_t format_version = 1;

}  // namespace

void write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint)
{
    H5File h5 = H5File::create(file);
    h5.set_attribute("/", "format_version", format_version);
    h5.set_attribute("/", "time", checkpoint.time);
    h5.set_attribute("/", "rows", static_cast<std::int64_t>(checkpoint.rows));
    h5.set_attribute("/", "frames", static_cast<std::int64_t>(checkpoint.frames));
    h5.set_attribute("/", "cells", static_cast<std::int64_t>(checkpoint.cells));
    h5.set_attribute("/", "bodies", static_cast<std::int64_t>(checkpoint.bodies));
    h5.write("/simulation", std::span<const std::uint8_t>(checkpoint.simulation), {checkpoint.simulation.size()});
    h5.write("/observer", std::span<const std::uint8_t>(checkpoint.observer), {checkpoint.observer.size()});
    h5.commit();
}

Checkpoint read_checkpoint(const std::filesystem::path& file)
{
    const H5File h5 = H5File::open(file);
    if (!h5.has_attribute("/", "format_version") || h5.number_attribute("/", "format_version") != format_version)
        throw Error(file.string(), "is no checkpoint of this version", "run without --resume to start anew");
    const auto count = [&](const char* name) { return static_cast<std::size_t>(h5.number_attribute("/", name)); };
    Checkpoint checkpoint;
    checkpoint.time = h5.number_attribute("/", "time");
    checkpoint.rows = count("rows");
    checkpoint.frames = count("frames");
    checkpoint.cells = count("cells");
    checkpoint.bodies = count("bodies");
    checkpoint.simulation = h5.read_bytes("/simulation");
    checkpoint.observer = h5.read_bytes("/observer");
    return checkpoint;
}

}  // namespace coral::suffusion
