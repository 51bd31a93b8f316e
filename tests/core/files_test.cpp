#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "core/output_file.h"
#include "core/table.h"

namespace coral {
namespace {
namespace fs = std::filesystem;

class Files : public testing::Test {
protected:
    void SetUp() override
    {
        folder = fs::temp_directory_path() / ("coral-files-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
        fs::remove_all(folder);
        fs::create_directory(folder);
    }
    void TearDown() override { fs::remove_all(folder); }
    std::size_t count() const { return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator{})); }

    fs::path folder;
};

TEST_F(Files, appear_only_when_committed)
{
    const fs::path target = folder / "out.csv";
    {
        OutputFile output(target);
        std::ofstream(output.temporary()) << "half";
        EXPECT_FALSE(fs::exists(target));
    }
    EXPECT_EQ(count(), 0u) << "an abandoned output left something behind";
    write_text_file(target, "whole");
    EXPECT_EQ(read_text_file(target), "whole");
    EXPECT_EQ(count(), 1u);
}

TEST_F(Files, keep_the_old_content_when_a_new_output_is_abandoned)
{
    const fs::path target = folder / "out.csv";
    write_text_file(target, "old");
    {
        OutputFile output(target);
        std::ofstream(output.temporary()) << "new";
    }
    EXPECT_EQ(read_text_file(target), "old");
}

TEST_F(Files, need_a_folder_that_exists) { EXPECT_THROW(OutputFile(folder / "missing" / "out.csv"), Error); }

TEST_F(Files, replace_what_a_link_names_and_no_device)
{
    write_text_file(folder / "real.csv", "old");
    fs::create_symlink("real.csv", folder / "link.csv");
    write_text_file(folder / "link.csv", "new");
    EXPECT_TRUE(fs::is_symlink(folder / "link.csv"));
    EXPECT_EQ(read_text_file(folder / "real.csv"), "new");
    fs::create_symlink("/dev/null", folder / "device.csv");
    EXPECT_THROW(OutputFile(folder / "device.csv"), Error);
}

TEST_F(Files, tables_round_trip_numbers_and_texts)
{
    Table table{{"id", "value", "name"}, {}};
    table.add({1LL, 0.1, std::string("a \"quoted\", name")});
    table.add({2LL, 1e-7, std::string("plain")});
    table.write(folder / "t.csv");
    const Table read = read_table(folder / "t.csv");
    EXPECT_EQ(read.columns, table.columns);
    ASSERT_EQ(read.rows.size(), 2u);
    EXPECT_EQ(std::get<double>(read.rows[1][1]), 1e-7);
    EXPECT_EQ(std::get<std::string>(read.rows[0][2]), "a \"quoted\", name");
}

TEST_F(Files, tables_name_the_line_with_a_wrong_number_of_cells)
{
    write_text_file(folder / "t.csv", "a,b\n1,2\n3\n");
    try {
        read_table(folder / "t.csv");
        FAIL() << "accepted";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("t.csv:3: has 1 cells, the header has 2"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace coral
