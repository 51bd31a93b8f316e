#include "suffusion/frames.h"

#include <zlib.h>

#include <cstdint>
#include <cstring>

#include "core/error.h"
#include "core/output_file.h"
#include "core/text.h"

namespace coral::suffusion {

namespace {

constexpr std::size_t block_bytes = 1 << 20;

std::string base64(const std::vector<unsigned char>& bytes)
{
    static const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t word = bytes[i] << 16;
        if (left > 1) word |= bytes[i + 1] << 8;
        if (left > 2) word |= bytes[i + 2];
        text += letters[word >> 18 & 63];
        text += letters[word >> 12 & 63];
        text += left > 1 ? letters[word >> 6 & 63] : '=';
        text += left > 2 ? letters[word & 63] : '=';
    }
    return text;
}

template <class T>
std::string data_array(const std::string& name, int width, const char* type, std::span<const T> values)
{
    return "<DataArray type=\"" + std::string(type) + "\" Name=\"" + name + "\" NumberOfComponents=\"" + std::to_string(width) +
           "\" format=\"binary\">" + encode_array(values.data(), values.size_bytes()) + "</DataArray>\n";
}

std::string file_header(const char* type)
{
    return std::string("<?xml version=\"1.0\"?>\n<VTKFile type=\"") + type +
           "\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt32\" compressor=\"vtkZLibDataCompressor\">\n";
}

std::string text_arrays(std::span<const FrameArray> arrays)
{
    std::string text;
    for (const FrameArray& a : arrays) text += data_array<float>(a.name, a.width, "Float32", a.values);
    return text;
}

std::string text_vector(double x, double y, double z) { return to_text(x) + " " + to_text(y) + " " + to_text(z); }

void write_cells(const std::filesystem::path& file, std::span<const Eigen::Vector3d> positions, std::span<const std::vector<int>> cells,
                 std::uint8_t type, const std::string& section, std::span<const FrameArray> arrays)
{
    std::vector<float> points;
    for (const Eigen::Vector3d& p : positions)
        for (int k = 0; k < 3; ++k) points.push_back(static_cast<float>(p[k]));
    std::vector<std::int32_t> connectivity, offsets;
    for (const std::vector<int>& cell : cells) {
        connectivity.insert(connectivity.end(), cell.begin(), cell.end());
        offsets.push_back(static_cast<std::int32_t>(connectivity.size()));
    }
    const std::vector<std::uint8_t> types(cells.size(), type);
    std::string text = file_header("UnstructuredGrid");
    text += "<UnstructuredGrid>\n<Piece NumberOfPoints=\"" + std::to_string(positions.size()) + "\" NumberOfCells=\"" + std::to_string(cells.size()) +
            "\">\n<Points>\n";
    text += data_array<float>("Points", 3, "Float32", points) + "</Points>\n<Cells>\n";
    text += data_array<std::int32_t>("connectivity", 1, "Int32", connectivity) + data_array<std::int32_t>("offsets", 1, "Int32", offsets) +
            data_array<std::uint8_t>("types", 1, "UInt8", types) + "</Cells>\n<" + section + ">\n";
    text += text_arrays(arrays) + "</" + section + ">\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
    write_text_file(file, text);
}

}  // namespace

std::string encode_array(const void* data, std::size_t bytes)
{
    const auto* input = static_cast<const unsigned char*>(data);
    const std::size_t blocks = (bytes + block_bytes - 1) / block_bytes;
    std::vector<std::uint32_t> header{static_cast<std::uint32_t>(blocks), static_cast<std::uint32_t>(block_bytes),
                                      static_cast<std::uint32_t>(bytes % block_bytes)};
    std::vector<unsigned char> packed;
    for (std::size_t b = 0; b < blocks; ++b) {
        const std::size_t size = std::min(block_bytes, bytes - b * block_bytes);
        uLongf room = compressBound(size);
        const std::size_t start = packed.size();
        packed.resize(start + room);
        if (compress2(packed.data() + start, &room, input + b * block_bytes, size, 4) != Z_OK)
            throw Error("frames", "zlib could not compress a field", "free some memory");
        packed.resize(start + room);
        header.push_back(static_cast<std::uint32_t>(room));
    }
    std::vector<unsigned char> head(header.size() * sizeof(std::uint32_t));
    std::memcpy(head.data(), header.data(), head.size());
    return base64(head) + base64(packed);
}

void write_image(const std::filesystem::path& file, const Eigen::Vector3d& origin, double cell, const Eigen::Vector3i& cells,
                 std::span<const FrameArray> arrays)
{
    const std::string extent =
        "0 " + std::to_string(cells.x()) + " 0 " + std::to_string(cells.y()) + " 0 " + std::to_string(cells.z());
    std::string text = file_header("ImageData");
    text += "<ImageData WholeExtent=\"" + extent + "\" Origin=\"" + text_vector(origin.x(), origin.y(), origin.z()) + "\" Spacing=\"" +
            text_vector(cell, cell, cell) + "\">\n<Piece Extent=\"" + extent + "\">\n<CellData>\n";
    text += text_arrays(arrays) + "</CellData>\n</Piece>\n</ImageData>\n</VTKFile>\n";
    write_text_file(file, text);
}

void write_points(const std::filesystem::path& file, std::span<const Eigen::Vector3d> positions, std::span<const FrameArray> arrays)
{
    std::vector<std::vector<int>> cells(positions.size());
    for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = {static_cast<int>(i)};
    write_cells(file, positions, cells, 1, "PointData", arrays);  // VTK_VERTEX
}

void write_polygons(const std::filesystem::path& file, std::span<const Eigen::Vector3d> positions, std::span<const std::vector<int>> polygons,
                    std::span<const FrameArray> arrays)
{
    write_cells(file, positions, polygons, 7, "CellData", arrays);  // VTK_POLYGON
}

void write_collection(const std::filesystem::path& file, std::span<const double> times, std::span<const std::string> files)
{
    std::string text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n";
    for (std::size_t i = 0; i < times.size(); ++i)
        text += "<DataSet timestep=\"" + to_text(times[i]) + "\" part=\"0\" file=\"" + files[i] + "\"/>\n";
    write_text_file(file, text + "</Collection>\n</VTKFile>\n");
}

}  // namespace coral::suffusion
