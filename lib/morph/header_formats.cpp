#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>

#include "core/error.h"
#include "core/hdf5.h"
#include "core/text.h"
#include "morph/detail/readers.h"

namespace coral::morph::detail {
namespace {

constexpr std::size_t piece_bytes = std::size_t{1} << 22;  // a multiple of every number size
constexpr const char* truncated_hint = "the file is truncated; copy it again";

NumberType number_type(const std::string& name, const std::string& where)
{
    static const std::map<std::string, NumberType> types{
        {"u8", {NumberKind::unsigned_integer, 1}},  {"u16", {NumberKind::unsigned_integer, 2}}, {"u32", {NumberKind::unsigned_integer, 4}},
        {"i8", {NumberKind::signed_integer, 1}},    {"i16", {NumberKind::signed_integer, 2}},   {"i32", {NumberKind::signed_integer, 4}},
        {"f32", {NumberKind::real, 4}},             {"f64", {NumberKind::real, 8}}};
    const auto found = types.find(name);
    if (found == types.end()) throw UsageError(where, "unknown number type '" + name + "'", "use u8, u16, u32, i8, i16, i32, f32 or f64");
    return found->second;
}

std::size_t voxel_count(const Eigen::Vector3i& size) { return std::size_t(size.x()) * std::size_t(size.y()) * std::size_t(size.z()); }

/// Feeds exactly `total` plain bytes from the stream to `take`.
void read_plain(std::istream& in, std::size_t total, const std::string& where, const std::function<void(std::span<const std::byte>)>& take)
{
    std::vector<std::byte> piece(std::min(total, piece_bytes));
    for (std::size_t done = 0; done < total;) {
        const std::size_t n = std::min(piece_bytes, total - done);
        if (!in.read(reinterpret_cast<char*>(piece.data()), std::streamsize(n)))
            throw Error(where, "ends after " + std::to_string(done + std::size_t(in.gcount())) + " of " + std::to_string(total) + " bytes", truncated_hint);
        take({piece.data(), n});
        done += n;
    }
}

/// Feeds exactly `total` bytes unpacked from a gzip or zlib stream to `take`.
void read_deflated(std::istream& in, std::size_t total, const std::string& where, const std::function<void(std::span<const std::byte>)>& take)
{
    z_stream z{};
    if (inflateInit2(&z, 15 + 32) != Z_OK) throw Error(where, "zlib cannot start");
    const std::unique_ptr<z_stream, int (*)(z_stream*)> closer(&z, inflateEnd);
    std::vector<std::byte> packed(std::size_t{1} << 18), piece(std::min(total, piece_bytes));
    std::size_t done = 0;
    while (done < total) {
        const std::size_t wanted = std::min(piece_bytes, total - done);
        z.next_out = reinterpret_cast<Bytef*>(piece.data());
        z.avail_out = uInt(wanted);
        while (z.avail_out > 0) {
            if (z.avail_in == 0) {
                in.read(reinterpret_cast<char*>(packed.data()), std::streamsize(packed.size()));
                z.next_in = reinterpret_cast<Bytef*>(packed.data());
                z.avail_in = uInt(in.gcount());
            }
            const int state = inflate(&z, Z_NO_FLUSH);
            if (state == Z_STREAM_END && z.avail_out == 0) break;
            if (state != Z_OK)
                throw Error(where, "compressed data end or break after " + std::to_string(done + wanted - z.avail_out) + " of " + std::to_string(total) + " bytes",
                            truncated_hint);
        }
        take({piece.data(), wanted});
        done += wanted;
    }
}

/// Reads the voxels of a stack whose size is set.
void read_voxels(VoxelStack& stack, std::istream& in, const NumberType& type, bool deflated, const std::string& where)
{
    VoxelSink sink(stack.name);
    sink.reserve(stack.count(), type.bytes);
    const auto take = [&](std::span<const std::byte> bytes) { sink.append(bytes, type, where); };
    (deflated ? read_deflated : read_plain)(in, stack.count() * std::size_t(type.bytes), where, take);
    sink.finish(stack);
}

std::string lower(std::string text)
{
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

std::vector<double> numbers(const std::string& text)
{
    std::vector<double> out;
    for (const std::string& word : split(text, ' '))
        if (!word.empty()) out.push_back(std::atof(word.c_str()));
    return out;
}

Eigen::Vector3i size_from(const std::string& text, const std::string& where)
{
    const std::vector<double> n = numbers(text);
    if (n.size() != 3 || *std::min_element(n.begin(), n.end()) < 1 || *std::max_element(n.begin(), n.end()) > 1e6)
        throw Error(where, "has the size '" + text + "' where three positive numbers are needed");
    return {int(n[0]), int(n[1]), int(n[2])};
}

std::ifstream open_binary(const std::filesystem::path& file)
{
    std::ifstream in(file, std::ios::binary);
    if (!in) throw Error(file.string(), "cannot be opened");
    return in;
}

bool machine_is_big() { return std::endian::native == std::endian::big; }

/// Lines "key<separator> value" up to a blank line or until `last` was read.
std::map<std::string, std::string> read_fields(std::istream& in, char separator, const std::string& last)
{
    std::map<std::string, std::string> fields;
    for (std::string line; std::getline(in, line);) {
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (line.empty()) break;
        if (line[0] == '#') continue;
        const auto at = line.find(separator);
        if (at == std::string::npos) continue;
        const std::string key = lower(split(line.substr(0, at), '\n').front());
        fields[key] = split(line.substr(at + 1), '\n').front();
        if (key == last) break;
    }
    return fields;
}

std::string nrrd_type(const std::string& name)
{
    static const std::map<std::string, std::string> names{
        {"uchar", "u8"}, {"unsigned char", "u8"}, {"uint8", "u8"}, {"uint8_t", "u8"}, {"signed char", "i8"}, {"int8", "i8"}, {"int8_t", "i8"},
        {"short", "i16"}, {"int16", "i16"}, {"int16_t", "i16"}, {"ushort", "u16"}, {"unsigned short", "u16"}, {"uint16", "u16"},
        {"uint16_t", "u16"}, {"int", "i32"}, {"int32", "i32"}, {"int32_t", "i32"}, {"uint", "u32"}, {"unsigned int", "u32"},
        {"uint32", "u32"}, {"uint32_t", "u32"}, {"float", "f32"}, {"double", "f64"}};
    const auto found = names.find(name);
    return found == names.end() ? std::string{} : found->second;
}

/// Lengths of the three vectors "(a,b,c) (d,e,f) (g,h,i)".
Eigen::Vector3d direction_lengths(const std::string& text)
{
    Eigen::Vector3d lengths = Eigen::Vector3d::Zero();
    std::size_t at = 0;
    for (int a = 0; a < 3; ++a) {
        const std::size_t open = text.find('(', at), close = text.find(')', at);
        if (open == std::string::npos || close == std::string::npos) return Eigen::Vector3d::Zero();
        double sum = 0;
        for (const std::string& n : split(text.substr(open + 1, close - open - 1), ',')) sum += std::atof(n.c_str()) * std::atof(n.c_str());
        lengths[a] = std::sqrt(sum);
        at = close + 1;
    }
    return lengths;
}

}  // namespace

VoxelStack read_nrrd(const std::filesystem::path& file)
{
    const std::string where = file.string();
    std::ifstream in = open_binary(file);
    std::string magic;
    if (!std::getline(in, magic) || !magic.starts_with("NRRD")) throw Error(where, "is no NRRD file");
    auto fields = read_fields(in, ':', "");
    for (const char* key : {"type", "dimension", "sizes", "encoding"})
        if (!fields.contains(key)) throw Error(where, std::string("the header lacks '") + key + "'", truncated_hint);
    if (fields["dimension"] != "3") throw Error(where, "has " + fields["dimension"] + " dimensions, not 3");
    VoxelStack stack;
    stack.name = file.filename().string();
    stack.size = size_from(fields["sizes"], where);
    const std::string type_name = nrrd_type(fields["type"]);
    if (type_name.empty()) throw Error(where, "holds the unsupported type '" + fields["type"] + "'", "save it as 8, 16 or 32-bit integers");
    NumberType type = number_type(type_name, where);
    type.swapped = (fields["endian"] == "big") != machine_is_big();
    const std::string encoding = lower(fields["encoding"]);
    const bool deflated = encoding == "gzip" || encoding == "gz";
    if (!deflated && encoding != "raw") throw Error(where, "has the unsupported encoding '" + encoding + "'", "save it as raw or gzip");

    double unit = 0;
    if (fields.contains("space units")) unit = metres_per_unit(split(fields["space units"], ' ').front());
    if (unit > 0 && fields.contains("space directions")) stack.voxel_size = unit * direction_lengths(fields["space directions"]);
    else if (unit > 0 && fields.contains("spacings"))
        if (const std::vector<double> s = numbers(fields["spacings"]); s.size() == 3) stack.voxel_size = unit * Eigen::Vector3d(s[0], s[1], s[2]);

    for (const char* key : {"data file", "datafile"})
        if (fields.contains(key)) in = open_binary(file.parent_path() / fields[key]);
    read_voxels(stack, in, type, deflated, where);
    return stack;
}

VoxelStack read_metaimage(const std::filesystem::path& file)
{
    const std::string where = file.string();
    std::ifstream in = open_binary(file);
    auto fields = read_fields(in, '=', "elementdatafile");
    for (const char* key : {"dimsize", "elementtype", "elementdatafile"})
        if (!fields.contains(key)) throw Error(where, std::string("the header lacks '") + key + "'", truncated_hint);
    static const std::map<std::string, std::string> names{{"MET_UCHAR", "u8"}, {"MET_CHAR", "i8"}, {"MET_USHORT", "u16"}, {"MET_SHORT", "i16"},
                                                          {"MET_UINT", "u32"}, {"MET_INT", "i32"}, {"MET_FLOAT", "f32"}, {"MET_DOUBLE", "f64"}};
    const auto found = names.find(fields["elementtype"]);
    if (found == names.end()) throw Error(where, "holds the unsupported type '" + fields["elementtype"] + "'", "save it as 8, 16 or 32-bit integers");
    VoxelStack stack;
    stack.name = file.filename().string();
    stack.size = size_from(fields["dimsize"], where);
    NumberType type = number_type(found->second, where);
    const bool big = lower(fields["binarydatabyteordermsb"]) == "true" || lower(fields["elementbyteordermsb"]) == "true";
    type.swapped = big != machine_is_big();
    const double unit = metres_per_unit(fields["distanceunits"]);
    if (const std::vector<double> s = numbers(fields["elementspacing"]); unit > 0 && s.size() == 3)
        stack.voxel_size = unit * Eigen::Vector3d(s[0], s[1], s[2]);
    if (fields["elementdatafile"] != "LOCAL") in = open_binary(file.parent_path() / fields["elementdatafile"]);
    read_voxels(stack, in, type, lower(fields["compresseddata"]) == "true", where);
    return stack;
}

VoxelStack read_raw(const std::filesystem::path& file, const RawLayout& layout)
{
    VoxelStack stack;
    stack.name = file.filename().string();
    stack.size = layout.size;
    NumberType type = number_type(layout.type, "--type");
    type.swapped = machine_is_big();
    const std::size_t wanted = voxel_count(layout.size) * std::size_t(type.bytes), found = std::filesystem::file_size(file);
    if (found != wanted)
        throw Error(file.string(), "has " + std::to_string(found) + " bytes where --shape and --type need " + std::to_string(wanted), "check both options");
    std::ifstream in = open_binary(file);
    read_voxels(stack, in, type, false, file.string());
    return stack;
}

VoxelStack read_hdf5(const std::filesystem::path& file, const std::string& dataset)
{
    const std::string where = file.string() + ":" + dataset;
    const H5File h5 = H5File::open(file);
    if (!h5.exists(dataset)) throw Error(where, "the dataset does not exist");
    const std::vector<std::size_t> dims = h5.dims(dataset);
    if (dims.size() != 3) throw Error(where, "has " + std::to_string(dims.size()) + " dimensions, not 3");
    VoxelStack stack;
    stack.name = file.filename().string() + ":" + dataset;
    stack.size = {int(dims[2]), int(dims[1]), int(dims[0])};
    if (h5.has_attribute(dataset, "voxel_size")) {
        const std::vector<double> s = h5.numbers_attribute(dataset, "voxel_size");
        if (s.size() == 1) stack.voxel_size.setConstant(s[0]);
        else if (s.size() == 3) stack.voxel_size = {s[0], s[1], s[2]};
    }
    constexpr std::size_t slab = 16;  // planes at a time: chunks are mostly that deep, and doubles take eight bytes
    VoxelSink sink(stack.name);
    for (std::size_t k = 0; k < dims[0]; k += slab) {
        const std::vector<double> values = h5.read_doubles(dataset, k, std::min(slab, dims[0] - k));
        sink.append(std::as_bytes(std::span(values)), {NumberKind::real, 8}, where);
    }
    sink.finish(stack);
    return stack;
}

}  // namespace coral::morph::detail
