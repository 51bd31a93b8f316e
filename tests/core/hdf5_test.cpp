#include "core/hdf5.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include <numeric>

#include "core/error.h"
#include "core/output_file.h"

namespace coral {
namespace {
namespace fs = std::filesystem;

class Hdf5 : public testing::Test {
protected:
    void TearDown() override { fs::remove(file), fs::remove(other); }
    fs::path file = fs::temp_directory_path() / ("coral-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".h5");
    fs::path other = file.string() + ".other.h5";
};

void write_example(const fs::path& file)
{
    std::vector<double> large(30000);
    std::iota(large.begin(), large.end(), 0.5);
    const std::vector<std::string> names{"coarse", "fine", ""};
    const std::vector<std::int64_t> ids{3, -1};
    H5File out = H5File::create(file);
    out.write("/series/large", large, {100, 300});
    out.write("/names", names);
    out.write("/shapes/10/id", ids, {2});
    out.write("/shapes/9/id", ids, {2});
    out.write("/empty", std::vector<double>{}, {0, 3});
    out.set_attribute("/series/large", "unit", "m/s");
    out.set_attribute("/", "count", std::int64_t{7});
    out.set_attribute("/", "history", std::string(100000, 'x'));
    out.commit();
}

TEST_F(Hdf5, gives_back_what_was_written)
{
    write_example(file);
    const H5File in = H5File::open(file);
    EXPECT_EQ(in.dims("/series/large"), (std::vector<std::size_t>{100, 300}));
    EXPECT_EQ(in.read_doubles("/series/large")[29999], 29999.5);
    EXPECT_EQ(in.read_strings("/names"), (std::vector<std::string>{"coarse", "fine", ""}));
    EXPECT_EQ(in.read_integers("/shapes/10/id"), (std::vector<std::int64_t>{3, -1}));
    EXPECT_EQ(in.members("/shapes"), (std::vector<std::string>{"9", "10"}));
    EXPECT_EQ(in.dims("/empty"), (std::vector<std::size_t>{0, 3}));
    EXPECT_TRUE(in.read_doubles("/empty").empty());
    EXPECT_EQ(in.string_attribute("/series/large", "unit"), "m/s");
    EXPECT_EQ(in.number_attribute("/", "count"), 7);
    EXPECT_EQ(in.string_attribute("/", "history").size(), 100000u);
    EXPECT_FALSE(in.exists("/series/none/deeper"));
}

TEST_F(Hdf5, gives_the_same_bytes_for_the_same_content)
{
    write_example(file);
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // HDF5's time stamps count seconds
    write_example(other);
    EXPECT_TRUE(read_text_file(file) == read_text_file(other));
}

TEST_F(Hdf5, leaves_nothing_without_commit)
{
    {
        H5File out = H5File::create(file);
        out.make_group("/a");
    }
    EXPECT_FALSE(fs::exists(file));
}

TEST_F(Hdf5, names_file_and_dataset_that_are_missing)
{
    write_example(file);
    const H5File in = H5File::open(file);
    try {
        in.read_doubles("/particles/position");
        FAIL() << "accepted";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(file.string() + ":/particles/position: is missing"), std::string::npos) << error.what();
    }
    EXPECT_THROW(in.read_doubles("/names"), Error);
}

TEST_F(Hdf5, refuses_a_file_of_another_format)
{
    write_text_file(file, "not hdf5");
    EXPECT_THROW(H5File::open(file), Error);
}

}  // namespace
}  // namespace coral
