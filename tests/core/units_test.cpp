#include "core/units.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/error.h"

namespace coral {
namespace {

TEST(Units, convert_to_si)
{
    EXPECT_DOUBLE_EQ(parse_quantity("30um", Dimension::length, "x"), 30e-6);
    EXPECT_DOUBLE_EQ(parse_quantity("0.2 mm", Dimension::length, "x"), 2e-4);
    EXPECT_DOUBLE_EQ(parse_quantity("50kPa", Dimension::pressure, "x"), 5e4);
    EXPECT_DOUBLE_EQ(parse_quantity("0.1m/s", Dimension::velocity, "x"), 0.1);
    EXPECT_DOUBLE_EQ(parse_quantity("45deg", Dimension::angle, "x"), std::numbers::pi / 4);
    EXPECT_DOUBLE_EQ(parse_quantity("2%", Dimension::number, "x"), 0.02);
}

TEST(Units, take_a_bare_number_as_si) { EXPECT_DOUBLE_EQ(parse_quantity("1e-6", Dimension::length, "x"), 1e-6); }

TEST(Units, refuse_a_unit_of_another_dimension_and_list_those_that_fit)
{
    try {
        parse_quantity("30kPa", Dimension::length, "--spacing");
        FAIL() << "accepted";
    } catch (const UsageError& error) {
        const std::string text = error.what();
        EXPECT_NE(text.find("--spacing: '30kPa' has the unit 'kPa'"), std::string::npos) << text;
        EXPECT_NE(text.find("um, "), std::string::npos) << text;
    }
}

TEST(Units, refuse_text_that_is_no_number)
{
    for (const char* text : {"", "mm", "abc", "inf", "nan", "1.2.3mm"}) EXPECT_THROW(parse_quantity(text, Dimension::length, "x"), UsageError) << text;
}

TEST(Units, show_a_quantity_with_a_readable_prefix)
{
    EXPECT_EQ(format_quantity(30e-6, Dimension::length), "30 um");
    EXPECT_EQ(format_quantity(0.015, Dimension::length), "15 mm");
    EXPECT_EQ(format_quantity(5e4, Dimension::pressure), "50 kPa");
    EXPECT_EQ(format_quantity(0, Dimension::length), "0 m");
    EXPECT_EQ(format_quantity(2e-4, Dimension::length), "200 um");
}

}  // namespace
}  // namespace coral
