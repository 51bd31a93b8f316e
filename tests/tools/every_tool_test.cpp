// What holds for every tool: --help and --version end with 0, an unknown option and a missing file with 2, in one clear line.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "tools/run_program.h"

namespace coral::test {
namespace {

std::vector<std::string> tools()
{
    std::istringstream list(CORAL_TOOL_NAMES);
    return {std::istream_iterator<std::string>(list), {}};
}

class EveryTool : public testing::TestWithParam<std::string> {};

TEST_P(EveryTool, prints_help_and_ends_with_0)
{
    const ProgramResult result = run_program(GetParam() + " --help");
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.out.find("--threads"), std::string::npos) << result.out;
    EXPECT_TRUE(result.err.empty()) << result.err;
}

TEST_P(EveryTool, prints_its_version_with_those_of_the_libraries)
{
    const ProgramResult result = run_program(GetParam() + " --version");
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_TRUE(result.out.starts_with(GetParam() + " ")) << result.out;
    for (const char* library : {"OpenVDB 1", "HDF5 1", "FFTW fftw-3", "CGAL 5", "libtiff 4", "Eigen 3", "oneTBB 20", "toml++ 3", "fmt 9"})
        EXPECT_NE(result.out.find(std::string("\n") + library), std::string::npos) << library << " in " << result.out;
}

TEST_P(EveryTool, names_an_unknown_option_and_the_nearest_one)
{
    const ProgramResult result = run_program(GetParam() + " --thraeds 2");
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("--thraeds"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("did you mean 'threads'?"), std::string::npos) << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
}

TEST_P(EveryTool, reports_all_bad_config_keys_with_line_and_column)
{
    const ScratchFolder folder;
    const auto file = folder.path() / "options.toml";
    write_text(file, "thraeds = 2\nquiett = true\n");
    const ProgramResult result = run_program(GetParam() + " --config " + file.string());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("options.toml:1:1: unknown key 'thraeds'; did you mean 'threads'?"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("options.toml:2:1: unknown key 'quiett'"), std::string::npos) << result.err;
}

INSTANTIATE_TEST_SUITE_P(All, EveryTool, testing::ValuesIn(tools()), [](const auto& tested) {
    std::string name = tested.param;
    std::ranges::replace(name, '-', '_');
    return name;
});

}  // namespace
}  // namespace coral::test
