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
constexpr const char* three_dimensions_hint = "export it as a stack of three dimensions, one number a voxel";

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
    if (inflateInit2(&z, 15 + 32) != Z_OK) throw Error(where, "zlib cannot start", "close other programs: memory may be short");
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

/// Bytes of a stream from where it stands to its end.
std::size_t bytes_left(std::istream& in)
{
    const auto here = in.tellg();
    in.seekg(0, std::ios::end);
    const auto end = in.tellg();
    in.seekg(here);
    return here < 0 || end < here ? 0 : std::size_t(end - here);
}

/// Holds what a header asks for against what is there, before memory is taken for it. Deflate packs 1032 : 1 at best.
void require_data(std::size_t wanted, std::size_t found, bool deflated, const std::string& where)
{
    constexpr double most_unpacked_per_packed = 1032, stream_overhead = 64;
    const std::string announced = "asks for " + std::to_string(wanted) + " bytes of voxels, ", there = std::to_string(found) + " bytes ";
    if (deflated && double(wanted) > most_unpacked_per_packed * (double(found) + stream_overhead))
        throw Error(where, announced + "which the " + there + "of compressed data cannot hold", "compare size and type in the header; the file may be truncated: copy it again");
    if (!deflated && wanted > found) throw Error(where, announced + "but only " + there + "follow", "compare size and type in the header; the file may be truncated: copy it again");
    if (!deflated && wanted < found)
        throw Error(where, announced + "but " + there + "follow", "compare size and type in the header; one number a voxel is read, without colours or channels");
}

/// Where the voxels lie: behind `lines` lines and then `bytes` bytes; -1 bytes: at the end of the file.
struct Skip {
    double lines = 0, bytes = 0;
};

void skip(std::istream& in, const Skip& skip, std::size_t wanted, const std::string& where)
{
    if (!(skip.lines >= 0 && skip.lines <= 1e6 && skip.bytes >= -1 && skip.bytes <= 1e15))
        throw Error(where, "the header skips an impossible number of lines or bytes", "correct it, or leave it out");
    std::string line;
    for (int n = 0; n < int(skip.lines) && std::getline(in, line);) ++n;
    in.clear();
    if (skip.bytes == -1) in.seekg(-std::streamoff(std::min(wanted, bytes_left(in))), std::ios::end);
    else if (skip.bytes > 0) in.seekg(std::streamoff(skip.bytes), std::ios::cur);
}

/// A stack that waits to be read: its header, and its file where the voxels begin.
struct Opened {
    StackHeader header;
    NumberType type;
    bool deflated = false;
    std::ifstream in;
    std::string where;

    std::size_t bytes() const { return voxel_count(header.size) * std::size_t(type.bytes); }
    /// Goes to the voxels and holds what the header asks for against what is there.
    void find_voxels(const Skip& before)
    {
        header.type = to_string(type);
        skip(in, before, bytes(), where);
        require_data(bytes(), bytes_left(in), deflated, where);
    }
};

VoxelStack read_voxels(Opened&& file)
{
    VoxelStack stack;
    stack.name = file.header.name;
    stack.size = file.header.size;
    stack.voxel_size = file.header.voxel_size;
    VoxelSink sink(stack.name);
    sink.reserve(stack.count(), file.type.bytes);
    const auto take = [&](std::span<const std::byte> bytes) { sink.append(bytes, file.type, file.where); };
    (file.deflated ? read_deflated : read_plain)(file.in, file.bytes(), file.where, take);
    sink.finish(stack);
    return stack;
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
    if (n.size() != 3 || !std::ranges::all_of(n, [](double edge) { return edge >= 1 && edge <= 1e6; }))
        throw Error(where, "has the size '" + text + "' where three numbers from 1 to 1000000 are needed", three_dimensions_hint);
    return {int(n[0]), int(n[1]), int(n[2])};
}

/// False for a name that cannot be one too, such as one of thousands of letters out of a damaged header.
bool is_file(const std::filesystem::path& file)
{
    std::error_code impossible;
    return std::filesystem::is_regular_file(file, impossible);
}

std::ifstream open_binary(const std::filesystem::path& file)
{
    if (!is_file(file)) throw Error(file.string(), "is no file", "check the path");
    std::ifstream in(file, std::ios::binary);
    if (!in) throw Error(file.string(), "cannot be opened", "check that you may read it");
    return in;
}

/// The file of voxels that a header names.
std::ifstream open_data(const std::filesystem::path& header, const std::string& name)
{
    const std::filesystem::path file = header.parent_path() / name;
    if (name.starts_with("LIST") || name.find('%') != std::string::npos)
        throw Error(header.string(), "spreads its voxels over several files ('" + name + "')", "export it as one file, or as a folder of TIFF slices");
    if (!is_file(file))
        throw Error(header.string(), "names the data file '" + name.substr(0, 200) + "', which is not there", "copy it beside the header, or correct the name");
    return open_binary(file);
}

/// As the file says it, right or wrong; zero, which means unknown, without unit or three numbers.
Eigen::Vector3d voxel_size_from(double unit, const std::vector<double>& spacing)
{
    return unit > 0 && spacing.size() == 3 ? Eigen::Vector3d(unit * Eigen::Vector3d(spacing[0], spacing[1], spacing[2])) : Eigen::Vector3d::Zero();
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

std::string datasets_of(const H5File& h5)
{
    std::string names;
    for (const std::string& name : h5.members("/")) names += (names.empty() ? "/" : ", /") + name;
    return names.empty() ? "none" : names.size() > 200 ? names.substr(0, 200) + " ..." : names;
}

Opened open_nrrd(const std::filesystem::path& path)
{
    Opened file{{}, {}, false, open_binary(path), path.string()};
    const std::string& where = file.where;
    std::string magic;
    if (!std::getline(file.in, magic) || !magic.starts_with("NRRD"))
        throw Error(where, "is no NRRD file: it does not begin with 'NRRD'", "export it as NRRD, or give it the ending of its kind");
    auto fields = read_fields(file.in, ':', "");
    for (const char* key : {"type", "dimension", "sizes", "encoding"})
        if (!fields.contains(key)) throw Error(where, std::string("the header lacks '") + key + "'", truncated_hint);
    if (fields["dimension"] != "3") throw Error(where, "has " + fields["dimension"] + " dimensions, not 3", three_dimensions_hint);
    file.header.name = path.filename().string();
    file.header.size = size_from(fields["sizes"], where);
    const std::string type_name = nrrd_type(fields["type"]);
    if (type_name.empty()) throw Error(where, "holds the unsupported type '" + fields["type"] + "'", "save it as 8, 16 or 32-bit integers");
    file.type = number_type(type_name, where);
    file.type.swapped = (fields["endian"] == "big") != machine_is_big();
    const std::string encoding = lower(fields["encoding"]);
    file.deflated = encoding == "gzip" || encoding == "gz";
    if (!file.deflated && encoding != "raw") throw Error(where, "has the unsupported encoding '" + encoding + "'", "save it as raw or gzip");

    const double unit = fields.contains("space units") ? metres_per_unit(split(fields["space units"], ' ').front()) : 0;
    if (fields.contains("space directions")) {
        const Eigen::Vector3d lengths = direction_lengths(fields["space directions"]);
        file.header.voxel_size = voxel_size_from(unit, {lengths.x(), lengths.y(), lengths.z()});
    } else {
        file.header.voxel_size = voxel_size_from(unit, numbers(fields["spacings"]));
    }
    for (const char* key : {"data file", "datafile"})
        if (fields.contains(key)) file.in = open_data(path, fields[key]);
    const auto number = [&](const char* key, const char* other) { return std::atof((fields.contains(key) ? fields[key] : fields[other]).c_str()); };
    const Skip before{number("line skip", "lineskip"), number("byte skip", "byteskip")};
    if (file.deflated && before.bytes != 0) throw Error(where, "skips bytes of compressed data", "save it as raw, or without 'byte skip'");
    file.find_voxels(before);
    return file;
}

Opened open_metaimage(const std::filesystem::path& path)
{
    Opened file{{}, {}, false, open_binary(path), path.string()};
    auto fields = read_fields(file.in, '=', "elementdatafile");
    for (const char* key : {"dimsize", "elementtype", "elementdatafile"})
        if (!fields.contains(key)) throw Error(file.where, std::string("the header lacks '") + key + "'", truncated_hint);
    static const std::map<std::string, std::string> names{{"MET_UCHAR", "u8"}, {"MET_CHAR", "i8"}, {"MET_USHORT", "u16"}, {"MET_SHORT", "i16"},
                                                          {"MET_UINT", "u32"}, {"MET_INT", "i32"}, {"MET_FLOAT", "f32"}, {"MET_DOUBLE", "f64"}};
    const auto found = names.find(fields["elementtype"]);
    if (found == names.end()) throw Error(file.where, "holds the unsupported type '" + fields["elementtype"] + "'", "save it as 8, 16 or 32-bit integers");
    file.header.name = path.filename().string();
    file.header.size = size_from(fields["dimsize"], file.where);
    file.type = number_type(found->second, file.where);
    const bool big = lower(fields["binarydatabyteordermsb"]) == "true" || lower(fields["elementbyteordermsb"]) == "true";
    file.type.swapped = big != machine_is_big();
    file.header.voxel_size = voxel_size_from(metres_per_unit(fields["distanceunits"]), numbers(fields["elementspacing"]));
    file.deflated = lower(fields["compresseddata"]) == "true";
    const bool apart = fields["elementdatafile"] != "LOCAL";
    if (apart) file.in = open_data(path, fields["elementdatafile"]);
    file.find_voxels({0, apart ? std::atof(fields["headersize"].c_str()) : 0});
    return file;
}

Opened open_raw(const std::filesystem::path& path, const RawLayout& layout)
{
    Opened file{{}, number_type(layout.type, "--type"), false, open_binary(path), path.string()};
    file.header.name = path.filename().string();
    file.header.size = layout.size;
    file.header.type = layout.type;
    file.type.swapped = machine_is_big();
    if (const std::size_t found = std::filesystem::file_size(path); found != file.bytes())
        throw Error(path.string(), "has " + std::to_string(found) + " bytes where --shape and --type need " + std::to_string(file.bytes()), "check both options");
    return file;
}

/// \throws Error unless the dataset is one of voxels
StackHeader header_of(const H5File& h5, const std::string& dataset)
{
    const std::string where = h5.path().string() + ":" + dataset;
    if (!h5.exists(dataset)) throw Error(where, "there is no such dataset", "the file has " + datasets_of(h5) + "; write file.h5:/dataset");
    const std::vector<std::size_t> dims = h5.dims(dataset);
    if (dims.size() != 3) throw Error(where, "has " + std::to_string(dims.size()) + " dimensions, not 3", "give a dataset of voxels [nz, ny, nx]");
    if (!std::ranges::all_of(dims, [](std::size_t edge) { return edge >= 1 && edge <= 1000000; }))
        throw Error(where, "has edges that are not 1 to 1000000 voxels", "give a dataset of voxels [nz, ny, nx]");
    StackHeader header;
    header.name = h5.path().filename().string() + ":" + dataset;
    header.size = {int(dims[2]), int(dims[1]), int(dims[0])};
    header.type = h5.number_type(dataset);
    if (h5.has_attribute(dataset, "voxel_size")) {
        const std::vector<double> s = h5.numbers_attribute(dataset, "voxel_size");
        header.voxel_size = voxel_size_from(1, s.size() == 1 ? std::vector(3, s[0]) : s);
    }
    return header;
}

}  // namespace

VoxelStack read_nrrd(const std::filesystem::path& file) { return read_voxels(open_nrrd(file)); }
VoxelStack read_metaimage(const std::filesystem::path& file) { return read_voxels(open_metaimage(file)); }
VoxelStack read_raw(const std::filesystem::path& file, const RawLayout& layout) { return read_voxels(open_raw(file, layout)); }
StackHeader nrrd_header(const std::filesystem::path& file) { return open_nrrd(file).header; }
StackHeader metaimage_header(const std::filesystem::path& file) { return open_metaimage(file).header; }
StackHeader raw_header(const std::filesystem::path& file, const RawLayout& layout) { return open_raw(file, layout).header; }
StackHeader hdf5_header(const std::filesystem::path& file, const std::string& dataset) { return header_of(H5File::open(file), dataset); }

VoxelStack read_hdf5(const std::filesystem::path& file, const std::string& dataset)
{
    const H5File h5 = H5File::open(file);
    const StackHeader header = header_of(h5, dataset);
    VoxelStack stack;
    stack.name = header.name;
    stack.size = header.size;
    stack.voxel_size = header.voxel_size;
    // Planes at a time: chunks are mostly 16 deep, and doubles take eight bytes.
    const std::size_t planes = std::size_t(header.size.z()), plane = stack.count() / planes, slab = std::clamp<std::size_t>((std::size_t{1} << 24) / plane, 1, 16);
    VoxelSink sink(stack.name);
    for (std::size_t k = 0; k < planes; k += slab) {
        const std::vector<double> values = h5.read_doubles(dataset, k, std::min(slab, planes - k));
        sink.append(std::as_bytes(std::span(values)), {NumberKind::real, 8}, file.string() + ":" + dataset);
    }
    sink.finish(stack);
    return stack;
}

}  // namespace coral::morph::detail
