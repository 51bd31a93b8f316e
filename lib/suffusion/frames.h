#pragma once
/// \file suffusion/frames.h
/// Fields and bodies for viewing: .vti (fluid), .vtu (bodies as points) and a .pvd that gives each its time. Arrays are inline base64
/// with zlib: ParaView of Debian 12 cannot read appended data.
#include <Eigen/Core>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace coral::suffusion {

/// One named array of a VTK file, `width` numbers for each cell or point.
struct FrameArray {
    std::string name;
    int width = 1;
    std::vector<float> values;
};

/// Cell fields on a uniform grid. \throws Error when the file cannot be written
void write_image(const std::filesystem::path& file, const Eigen::Vector3d& origin, double cell, const Eigen::Vector3i& cells,
                 std::span<const FrameArray> arrays);

/// Points with data, as an unstructured grid of vertices. \param positions [m], one for each point
void write_points(const std::filesystem::path& file, std::span<const Eigen::Vector3d> positions, std::span<const FrameArray> arrays);

/// Polygons with data, as an unstructured grid. \param arrays  one entry for each polygon
void write_polygons(const std::filesystem::path& file, std::span<const Eigen::Vector3d> positions, std::span<const std::vector<int>> polygons,
                    std::span<const FrameArray> arrays);

/// Collection of files with their times. \param files paths relative to the .pvd
void write_collection(const std::filesystem::path& file, std::span<const double> times, std::span<const std::string> files);

/// Base64 of zlib blocks with the length header of VTK (UInt32): the content of a DataArray of format "binary".
std::string encode_array(const void* data, std::size_t bytes);

}  // namespace coral::suffusion
