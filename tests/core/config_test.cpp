#include "core/config.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/error.h"

namespace coral {
namespace {

std::string problems_of(const Config& config)
{
    try {
        config.finish();
    } catch (const UsageError& error) {
        return error.what();
    }
    return {};
}

TEST(Config, reads_numbers_in_si_and_texts_with_units)
{
    const Config config = Config::from_text("cell = \"0.5mm\"\nangle = 0.25\nsize = [\"60mm\", 0.06, \"6.4cm\"]\n", "case.toml");
    EXPECT_DOUBLE_EQ(config.root().quantity("cell", Dimension::length), 5e-4);
    EXPECT_DOUBLE_EQ(config.root().quantity("angle", Dimension::angle), 0.25);
    EXPECT_TRUE(config.root().vector("size", Dimension::length).isApprox(Eigen::Vector3d(0.06, 0.06, 0.064)));
    EXPECT_EQ(problems_of(config), "");
}

TEST(Config, reports_every_problem_at_once_sorted_by_line)
{
    const Config config = Config::from_text("[dem]\nfriction = \"much\"\nhalf_widht = 3\n[flow]\nscheme = \"autom\"\n", "case.toml");
    config.root().table("dem").quantity("friction", Dimension::number, 0.7);
    config.root().table("dem").integer("half_width", 3);
    const std::vector<std::string> schemes{"auto", "resolved"};
    config.root().table("flow").choice("scheme", schemes, "auto");
    config.root().table("flow").quantity("cell", Dimension::length);
    const std::string text = problems_of(config);
    EXPECT_NE(text.find("case.toml:2:1: key 'dem.friction' is wrong"), std::string::npos) << text;
    EXPECT_NE(text.find("case.toml:3:1: unknown key 'dem.half_widht'; did you mean 'half_width'?"), std::string::npos) << text;
    EXPECT_NE(text.find("case.toml:5:1: key 'flow.scheme' = 'autom' is not one of: auto, resolved; did you mean 'auto'?"), std::string::npos) << text;
    EXPECT_NE(text.find("key 'flow.cell' is missing"), std::string::npos) << text;
    EXPECT_LT(text.find("friction"), text.find("half_widht"));
}

TEST(Config, says_of_each_key_once_what_is_wrong_with_it)
{
    const Config config = Config::from_text("[[body]]\nsize = \"big\"\n[[body]]\nsize = \"huge\"\n", "case.toml");
    for (const ConfigTable& body : config.root().tables("body"))
        if (!(body.quantity("size", Dimension::length) > 0)) body.error("size", "is not above zero");
    const std::string text = problems_of(config);
    EXPECT_EQ(std::ranges::count(text, '\n'), 1) << text;
    EXPECT_EQ(text.find("not above zero"), std::string::npos) << text;
    EXPECT_NE(text.find("case.toml:4:1: key 'body.size' is wrong"), std::string::npos) << text;
}

TEST(Config, gives_the_place_of_a_syntax_error)
{
    try {
        Config::from_text("a = 1\nb = = 2\n", "case.toml");
        FAIL() << "accepted";
    } catch (const UsageError& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with("case.toml:2:")) << error.what();
    }
}

TEST(Config, reads_arrays_of_tables_in_order)
{
    const Config config = Config::from_text("[[body]]\nname = \"a\"\n[[body]]\nname = \"b\"\nsize = 1\n", "case.toml");
    std::string names;
    for (const ConfigTable& body : config.root().tables("body")) names += body.string("name");
    EXPECT_EQ(names, "ab");
    EXPECT_NE(problems_of(config).find("case.toml:5:1: unknown key 'body.size'"), std::string::npos);
}

TEST(Config, names_a_missing_file)
{
    try {
        Config::from_file("no-such-folder/case.toml");
        FAIL() << "accepted";
    } catch (const UsageError& error) {
        EXPECT_NE(std::string(error.what()).find("no-such-folder/case.toml: no such file"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace coral
