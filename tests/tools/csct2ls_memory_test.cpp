// How much memory csct2ls needs beside the stack itself.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "morph/stack_io.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

constexpr int edge = 400, radius = 12;

/// Two balls in 64 million voxels; the last slices hold the second.
morph::VoxelStack sparse_stack(std::uint32_t second)
{
    morph::VoxelStack stack;
    stack.size.setConstant(edge);
    stack.values.reserve(stack.count(), 1);
    for (int k = 0; k < edge; ++k) {
        std::vector<std::uint32_t> slice(edge * edge, 0);
        for (const auto& [z, label] : {std::pair{20, 1U}, {edge - 20, second}})
            for (int j = 0; j < 2 * radius; ++j)
                for (int i = 0; i < 2 * radius; ++i)
                    if ((Eigen::Vector3d(i, j, k - z + radius).array() + 0.5 - radius).matrix().squaredNorm() <= radius * radius)
                        slice[std::size_t((100 + j) * edge + 100 + i)] = label;
        stack.values.append(std::span<const std::uint32_t>(slice));
    }
    return stack;
}

/// Peak of a run less what a run on a small stack needs anyhow. [bytes per voxel]
double peak_per_voxel(const std::string& stack, const ScratchFolder& folder)
{
    constexpr double program = 64.0 * 1024 * 1024;  // 45 MB with its libraries, and a quarter of a byte per voxel for chance
    const ProgramResult result = run_program("csct2ls " + stack + " --voxel-size 30um -o grains.vdb --threads 2 --json", folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    if (result.exit_code != 0) return 0;
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json["grains"], 2);
    return (json["peak_memory"].get<double>() - program) / (double(edge) * edge * edge);
}

#if defined(__SANITIZE_ADDRESS__)
constexpr bool sanitized = true;  // which multiplies memory
#else
constexpr bool sanitized = false;
#endif

TEST(Csct2lsMemory, is_that_of_one_copy_of_a_stack_that_comes_page_by_page)
{
    if (sanitized) GTEST_SKIP();
    const ScratchFolder folder;
    morph::write_tiff(sparse_stack(2), folder.path() / "labels.tif", 8);
    EXPECT_LT(peak_per_voxel("labels.tif", folder), 1.25);
}

TEST(Csct2lsMemory, is_that_of_one_copy_of_a_stack_that_turns_wide_at_its_end)
{
    if (sanitized) GTEST_SKIP();
    const ScratchFolder folder;
    {
        const morph::VoxelStack stack = sparse_stack(300);
        std::ofstream raw(folder.path() / "labels.raw", std::ios::binary);
        std::vector<std::uint32_t> wide(std::size_t{edge} * edge);
        for (std::size_t at = 0; at < stack.count(); at += wide.size()) {
            stack.values.read(at, wide);
            const std::vector<std::uint16_t> slice(wide.begin(), wide.end());
            raw.write(reinterpret_cast<const char*>(slice.data()), std::streamsize(2 * slice.size()));
        }
    }
    EXPECT_LT(peak_per_voxel("labels.raw --shape 400,400,400 --type u16", folder), 2.25);
}

}  // namespace
}  // namespace coral::test
