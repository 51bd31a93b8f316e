// What a damaged, forged or newer grains.vdb is answered with, and that OpenVDB never sees a damaged one.
#include "sdf/detail/vdb_seal.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/output_file.h"
#include "sdf/vdb_io.h"
#include "shapes.h"

namespace coral::sdf::test {
namespace {

namespace fs = std::filesystem;

class VdbSeal : public ::testing::Test {
protected:
    void SetUp() override
    {
        folder = fs::temp_directory_path() / ("coral_seal_" + std::to_string(::getpid()) + ::testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::create_directories(folder);
        const double c = 5e-5;
        const Mask ball = voxelise(sphere(Eigen::Vector3d::Constant(6 * c), 4 * c), Eigen::Vector3i::Constant(12), Eigen::Vector3d::Constant(c));
        GrainLevelSet grain = grain_from_masks(ball.view, ball.view, {.spacing = 2 * c});
        grain.id = 1;
        write_grains(folder / "grains.vdb", std::vector<GrainLevelSet>{grain}, {{"csct2ls", "1", {}, {"stack.tif"}}});
        bytes = read_text_file(folder / "grains.vdb");
    }
    void TearDown() override { fs::remove_all(folder); }

    /// What read_grains says of the bytes; `sealed` puts mark and checksum right first.
    std::string complaint(std::string content, bool sealed)
    {
        const fs::path file = folder / "bad.vdb";
        if (sealed) content.resize(content.size() - 16);
        write_text_file(file, content);
        if (sealed) detail::seal(file);
        try {
            read_grains(file);
        } catch (const Error& error) {
            return error.what();
        }
        return "";
    }
    /// The bytes with the value of the first metadata `key` replaced.
    std::string with(const std::string& key, const std::string& type, const std::string& value) const
    {
        std::string changed = bytes;
        const std::size_t at = changed.find(key) + key.size() + 4 + type.size() + 4;  // lengths of the type's name and of the value
        EXPECT_EQ(changed.substr(at - 4 - type.size(), type.size()), type);
        return changed.replace(at, value.size(), value);
    }
    template <class T>
    static std::string raw(const T& value)
    {
        std::string text(sizeof(T), '\0');
        std::memcpy(text.data(), &value, sizeof(T));
        return text;
    }
    fs::path folder;
    std::string bytes;
};

TEST_F(VdbSeal, holds_for_a_whole_file_and_for_the_same_bytes_sealed_again)
{
    EXPECT_EQ(complaint(bytes, false), "");
    EXPECT_EQ(complaint(bytes, true), "");
    EXPECT_EQ(read_text_file(folder / "bad.vdb"), bytes);
}

TEST_F(VdbSeal, breaks_with_any_single_byte)
{
    for (std::size_t at = 0; at < bytes.size(); at += at < 80 ? 1 : 211) {
        if (at >= 12 && at < 20) continue;  // version of the OpenVDB that wrote it
        std::string changed = bytes;
        changed[at] = char(changed[at] ^ 0x10);
        EXPECT_NE(complaint(changed, false), "") << "byte " << at;
    }
    std::string changed = bytes;
    changed[bytes.size() / 2] ^= 1;
    EXPECT_EQ(complaint(changed, false), (folder / "bad.vdb").string() + ": is damaged: its bytes do not give the checksum it carries; copy it again, or make it with csct2ls");
}

TEST_F(VdbSeal, does_not_hide_that_a_file_is_newer)
{
    EXPECT_EQ(complaint(with("format_version", "int32", raw(std::int32_t{2})), true),
              (folder / "bad.vdb").string() + ": was written by a newer version of the tools (format 2, this one reads up to 1); update the tools");
}

// Found by the fuzzer's kind of input: sizes out of metadata became memory.
TEST_F(VdbSeal, lets_no_lattice_through_that_the_file_cannot_hold)
{
    for (const int size : {-1, 0, 1, 4000, 1 << 24, 2147483647}) {
        const std::string edges = raw(std::array{size, size, size});
        EXPECT_NE(complaint(with("lattice_size", "vec3i", edges), true).find("its lattice is out of range; make the file again"), std::string::npos) << size;
    }
    EXPECT_NE(complaint(with("lattice_first", "vec3i", raw(std::array{2147483647, 0, 0})), true).find("lattice"), std::string::npos);
    EXPECT_NE(complaint(with("spacing", "double", raw(std::nan(""))), true).find("lattice"), std::string::npos);
}

}  // namespace
}  // namespace coral::sdf::test
