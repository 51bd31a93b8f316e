#include "core/text.h"

#include <gtest/gtest.h>

namespace coral {
namespace {

const std::vector<std::string> words{"half_width", "half_depth", "velocity"};

TEST(Text, finds_the_nearest_word)
{
    EXPECT_EQ(nearest_word("half_widht", words), "half_width");
    EXPECT_EQ(nearest_word("velosity", words), "velocity");
    EXPECT_EQ(did_you_mean("velosity", words), "did you mean 'velocity'?");
}

TEST(Text, finds_nothing_for_a_word_that_is_far_from_all) { EXPECT_EQ(nearest_word("zq", words), ""); }

TEST(Text, of_a_number_reads_back_as_the_same_number)
{
    for (double value : {1e-7, 0.1, 1.0 / 3, 6.02214076e23, -0.0}) EXPECT_EQ(std::stod(to_text(value)), value);
}

TEST(Text, splits_and_trims) { EXPECT_EQ(split(" a, b ,,c", ','), (std::vector<std::string>{"a", "b", "", "c"})); }

}  // namespace
}  // namespace coral
