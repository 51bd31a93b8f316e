#pragma once
/// \file sdf/detail/grid_spill.h
/// A .vdb of many grids made one grid at a time. OpenVDB writes all grids of a file at once, from memory.
#include <openvdb/openvdb.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace coral::sdf::detail {

/// A grid as it lies in a file, from its name on. At `places_at` it tells three places in the file; here they count from its own start.
struct StoredGrid {
    std::string bytes;
    std::size_t places_at = 0;
};

/// May run in several threads at once. \pre openvdb::initialize()
StoredGrid store(const openvdb::FloatGrid::ConstPtr& grid);

/// Keeps stored grids on disk. The file loses its name once it is open: it is gone with the program, however that ends.
/// All members throw std::ios_base::failure on a full disk.
class GridSpill {
public:
    struct Place {
        std::streamoff begin;
        std::size_t size, places_at;
    };
    explicit GridSpill(const std::filesystem::path& name);
    Place add(const StoredGrid& grid);
    /// Writes the .vdb, its grids in the order given.
    void join(const std::filesystem::path& file, const std::vector<Place>& grids, const openvdb::MetaMap& metadata);

private:
    std::fstream stream_;
    std::streamoff end_ = 0;
};

}  // namespace coral::sdf::detail
