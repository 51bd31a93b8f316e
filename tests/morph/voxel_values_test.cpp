#include "morph/voxel_values.h"

#include <gtest/gtest.h>

using coral::morph::VoxelValues;

namespace {

TEST(VoxelValues, keeps_numbers_in_the_narrowest_width_that_holds_them)
{
    VoxelValues values;
    std::vector<std::uint32_t> truth;
    for (const auto& [value, bytes] : {std::pair{7U, 1}, {255U, 1}, {256U, 2}, {65535U, 2}, {65536U, 4}, {4294967295U, 4}, {1U, 4}}) {
        values.push_back(value);
        truth.push_back(value);
        EXPECT_EQ(values.bytes(), bytes) << value;
        EXPECT_EQ(values, VoxelValues(truth)) << value;
    }
    EXPECT_EQ(std::vector<std::uint32_t>(values.begin(), values.end()), truth);
    EXPECT_EQ(values.largest(), 4294967295U);
    std::vector<std::uint32_t> part(3);
    values.read(2, part);
    EXPECT_EQ(part, (std::vector<std::uint32_t>{256, 65535, 65536}));
}

TEST(VoxelValues, are_equal_whatever_their_widths)
{
    VoxelValues wide(3, 70000), narrow(3, 9);
    for (std::size_t i = 0; i < 3; ++i) wide.set(i, 9);
    EXPECT_EQ(wide.bytes(), 4);
    EXPECT_EQ(narrow.bytes(), 1);
    EXPECT_EQ(wide, narrow);
    narrow.set(1, 70000);
    EXPECT_EQ(narrow.bytes(), 4);
    EXPECT_EQ(narrow[1], 70000U);
    EXPECT_EQ(narrow[2], 9U);
    EXPECT_FALSE(wide == narrow);
}

TEST(VoxelValues, stay_narrow_in_room_for_wider_ones_and_widen_in_place)
{
    VoxelValues values;
    values.reserve(100000, 4);
    std::vector<std::uint32_t> truth;
    for (std::uint32_t v = 0; v < 99998; ++v) truth.push_back(v * 7 % 251);
    values.append(std::span<const std::uint32_t>(truth));
    EXPECT_EQ(values.bytes(), 1);
    for (const std::uint32_t larger : {40000U, 4000000000U}) {
        const VoxelValues before = values;
        values.push_back(larger);
        truth.push_back(larger);
        EXPECT_EQ(values, VoxelValues(truth));
        EXPECT_EQ(before.size() + 1, values.size()) << "a copy is its own";
    }
    EXPECT_EQ(values.bytes(), 4);
}

TEST(VoxelValues, append_joins_different_widths)
{
    VoxelValues values(2, 3), more(2, 1000);
    values.append(more);
    EXPECT_EQ(values, VoxelValues(std::vector<std::uint32_t>{3, 3, 1000, 1000}));
    EXPECT_EQ(values.bytes(), 2);
}

}  // namespace
