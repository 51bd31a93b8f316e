#include "sdf/detail/grid_spill.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>

#include <array>
#include <cstring>
#include <sstream>

#include "core/error.h"

namespace coral::sdf::detail {
namespace {

constexpr auto any_failure = std::ios::badbit | std::ios::failbit;  // OpenVDB itself does not look

struct Archive : openvdb::io::Archive {
    static std::string written(const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata)
    {
        std::ostringstream stream(std::ios::binary);
        stream.exceptions(any_failure);
        Archive().write(stream, grids, /*seekable=*/true, metadata);
        return std::move(stream).str();
    }
};

/// A file up to its first grid: that of no grids, with another number at its end.
std::string head(const openvdb::MetaMap& metadata, std::int32_t grids)
{
    std::string file = Archive::written({}, metadata);
    std::memcpy(file.data() + file.size() - sizeof grids, &grids, sizeof grids);
    return file;
}

/// Adds `offset` to where the grid says that its metadata, its values and its end lie.
void move_places(StoredGrid& grid, std::int64_t offset)
{
    std::array<std::int64_t, 3> places{};
    std::memcpy(places.data(), grid.bytes.data() + grid.places_at, sizeof places);
    for (std::int64_t& place : places) place += offset;
    std::memcpy(grid.bytes.data() + grid.places_at, places.data(), sizeof places);
}

}  // namespace

StoredGrid store(const openvdb::FloatGrid::ConstPtr& grid)
{
    const std::size_t before = head({}, 1).size();
    StoredGrid stored{Archive::written({grid}, {}), 0};
    stored.bytes.erase(0, before);
    std::ostringstream name;
    openvdb::io::GridDescriptor(grid->getName(), grid->type()).writeHeader(name);
    stored.places_at = name.str().size();
    if (!stored.bytes.starts_with(name.str())) throw Error(grid->getName(), "unexpected layout written by OpenVDB", "report this, with the version of OpenVDB");
    move_places(stored, -std::int64_t(before));
    return stored;
}

GridSpill::GridSpill(const std::filesystem::path& name)
{
    stream_.exceptions(any_failure);
    stream_.open(name, std::ios::in | std::ios::out | std::ios::trunc | std::ios::binary);
    std::filesystem::remove(name);
}

GridSpill::Place GridSpill::add(const StoredGrid& grid)
{
    const Place place{end_, grid.bytes.size(), grid.places_at};
    stream_.seekp(end_);
    stream_.write(grid.bytes.data(), std::streamsize(grid.bytes.size()));
    stream_.flush();  // a full disk shows here
    end_ += std::streamoff(grid.bytes.size());
    return place;
}

void GridSpill::join(const std::filesystem::path& file, const std::vector<Place>& grids, const openvdb::MetaMap& metadata)
{
    std::ofstream out;
    out.exceptions(any_failure);
    out.open(file, std::ios::binary);
    out << head(metadata, std::int32_t(grids.size()));
    for (const Place& place : grids) {
        StoredGrid grid{std::string(place.size, '\0'), place.places_at};
        stream_.seekg(place.begin);
        stream_.read(grid.bytes.data(), std::streamsize(place.size));
        move_places(grid, std::int64_t(out.tellp()));
        out << grid.bytes;
    }
    out.close();
}

}  // namespace coral::sdf::detail
