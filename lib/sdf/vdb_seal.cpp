#include "sdf/detail/vdb_seal.h"

#include <array>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "core/error.h"

namespace coral::sdf::detail {
namespace {

// An OpenVDB file begins with magic number (8 bytes), file version, library version (2 x 4), a flag (1) and the UUID.
constexpr std::string_view magic{" BDV\0\0\0\0", 8};
constexpr std::uint8_t first_version = 224, last_version = 239;  // 224 since OpenVDB 3.1; it refuses what is too new for it itself
constexpr std::streamoff uuid_offset = 21, uuid_length = 36;
constexpr std::string_view end_mark = "coralend";  // before the length without the mark, 8 bytes, lowest first
constexpr std::size_t mark_length = 16;

std::string mark(std::uint64_t length)
{
    std::string text(end_mark);
    for (int byte = 0; byte < 8; ++byte) text += char(length >> (8 * byte) & 0xff);
    return text;
}

/// All bytes behind the UUID, written as a UUID. FNV-1a from two starts.
std::string checksum(std::istream& stream)
{
    std::uint64_t hash[2] = {0xcbf29ce484222325ull, 0x9e3779b97f4a7c15ull};
    std::vector<char> block(1 << 20);
    stream.seekg(uuid_offset + uuid_length);
    while (stream.read(block.data(), std::streamsize(block.size())), stream.gcount() > 0)
        for (std::streamsize n = 0; n < stream.gcount(); ++n)
            for (std::uint64_t& h : hash) h = (h ^ std::uint8_t(block[std::size_t(n)])) * 0x100000001b3ull;
    stream.clear();
    std::string uuid;
    for (int n = 0; n < 32; ++n) {
        if (n == 8 || n == 12 || n == 16 || n == 20) uuid += '-';
        uuid += "0123456789abcdef"[hash[n / 16] >> (4 * (n % 16)) & 15];
    }
    return uuid;
}

/// Bytes of a stream from `at` on; shorter when it ends before.
std::string bytes(std::istream& stream, std::streamoff at, std::streamoff count)
{
    std::string text(std::size_t(count), '\0');
    stream.seekg(at);
    stream.read(text.data(), count);
    text.resize(std::size_t(std::max<std::streamsize>(stream.gcount(), 0)));
    stream.clear();
    return text;
}

}  // namespace

void seal(const std::filesystem::path& file)
{
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(0, std::ios::end);
    stream << mark(std::filesystem::file_size(file)) << std::flush;
    const std::string uuid = checksum(stream);
    stream.seekp(uuid_offset);
    stream << uuid << std::flush;
    stream.close();
    if (!stream) throw Error(file.string(), "could not be written", "check the space left on the disk");
}

void require_sealed(const std::filesystem::path& file)
{
    const std::uint64_t size = std::filesystem::file_size(file);
    std::ifstream stream(file, std::ios::binary);
    constexpr std::uint64_t least = std::uint64_t(uuid_offset + uuid_length) + mark_length;
    if (size < least || bytes(stream, std::streamoff(size - mark_length), mark_length) != mark(size - mark_length))
        throw Error(file.string(), "holds no grains of ours, or is cut short", "make it with csct2ls, or copy it again");
    const std::string head = bytes(stream, 0, uuid_offset + uuid_length);
    const auto version = std::uint8_t(head[8]);
    const bool known = head.starts_with(magic) && version >= first_version && version <= last_version && head.substr(9, 3) == std::string(3, '\0') && head[20] == 1;
    if (!known || head.substr(std::size_t(uuid_offset)) != checksum(stream))
        throw Error(file.string(), "is damaged: its bytes do not give the checksum it carries", "copy it again, or make it with csct2ls");
}

}  // namespace coral::sdf::detail
