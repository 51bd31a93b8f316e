// Grains in OpenVDB. Bytes as they are meet the checksum; behind it, the metadata of ours in a good file take any value and are sealed again.
// What OpenVDB itself reads stays as it was: it takes lengths out of a forged file for memory, which no caller can keep it from.
#include <cstring>
#include <vector>

#include "core/output_file.h"
#include "fuzz/memory_file.h"
#include "sdf/detail/vdb_seal.h"
#include "sdf/vdb_io.h"

namespace {

using namespace coral;

/// Values of our metadata in a good file, by place and length.
struct GoodFile {
    std::string bytes;
    std::vector<std::pair<std::size_t, std::size_t>> values;
};

GoodFile make_good_file()
{
    std::vector<std::uint8_t> ball;
    for (int k = 0; k < 8; ++k)
        for (int j = 0; j < 8; ++j)
            for (int i = 0; i < 8; ++i) ball.push_back((Eigen::Vector3d(i, j, k) - Eigen::Vector3d::Constant(3.5)).norm() < 3);
    const sdf::GrainMask mask{Eigen::Vector3i::Constant(8), Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Zero(), ball};
    sdf::GrainLevelSet grain = sdf::grain_from_masks(mask, mask, {.spacing = 2e-4, .inside_band = 2, .outside_band = 2});
    grain.id = 1;
    const std::filesystem::path file = "/dev/shm/coral_fuzz_good_" + std::to_string(getpid()) + ".vdb";
    sdf::write_grains(file, {&grain, 1}, {{"csct2ls", "1", {}, {"stack.tif"}}});
    GoodFile good{read_text_file(file), {}};
    std::filesystem::remove(file);
    good.bytes.resize(good.bytes.size() - 16);  // without the mark, which seal() appends
    const std::pair<const char*, const char*> keys[] = {{"lattice_first", "vec3i"}, {"lattice_size", "vec3i"}, {"inside_limit", "double"}, {"outside_limit", "double"},
                                                        {"spacing", "double"}, {"label", "int64"}, {"volume", "double"}, {"centre", "vec3d"}, {"inertia", "string"},
                                                        {"history", "string"}, {"content", "string"}, {"format_version", "int32"}};
    for (const auto& [key, type] : keys)
        for (std::size_t at = 0; (at = good.bytes.find(key, at)) != std::string::npos; ++at) {
            const std::size_t name = at + std::strlen(key) + 4, value = name + std::strlen(type) + 4;
            std::uint32_t length = 0;
            if (good.bytes.compare(name, std::strlen(type), type) != 0) continue;
            std::memcpy(&length, good.bytes.data() + value - 4, 4);
            good.values.emplace_back(value, length);
        }
    return good;
}

void read_all(const std::filesystem::path& file)
{
    const sdf::GrainReader reader(file);
    for (const int id : reader.ids()) reader.read(id);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    fuzz::try_reader(data, size, read_all);
    static const GoodFile good = make_good_file();
    std::string forged = good.bytes;
    // One byte says which value, as many as it is long say what it becomes.
    for (std::size_t at = 0; at + 1 < size;) {
        const auto [place, length] = good.values[data[at] % good.values.size()];
        const std::size_t taken = std::min(length, size - at - 1);
        std::memcpy(forged.data() + place, data + at + 1, taken);
        at += 1 + taken;
    }
    return fuzz::try_reader(reinterpret_cast<const std::uint8_t*>(forged.data()), forged.size(), [](const std::filesystem::path& file) {
        sdf::detail::seal(file);
        read_all(file);
    });
}
