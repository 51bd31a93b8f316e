#include "core/record.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace coral {
namespace {

TEST(History, survives_the_way_through_a_file)
{
    const History history{{"csct2ls", "0.1.0", {{"spacing", "200um"}}, {"stack.tif"}}, {"ls2sh", "0.1.0", {{"degree", "10"}}, {"grains.vdb"}}};
    const History back = history_from_json(to_json(history), "file");
    ASSERT_EQ(back.size(), 2u);
    EXPECT_EQ(back[0].options.at("spacing"), "200um");
    EXPECT_EQ(back[1].inputs, (std::vector<std::string>{"grains.vdb"}));
}

TEST(History, that_is_damaged_names_the_file)
{
    try {
        history_from_json("{", "grains.vdb");
        FAIL() << "accepted";
    } catch (const Error& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with("grains.vdb: ")) << error.what();
    }
}

}  // namespace
}  // namespace coral
