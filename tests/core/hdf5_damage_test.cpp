// HDF5 files that are damaged, forged or newer: made by HDF5 itself, since ours are protected by checksums.
#include <gtest/gtest.h>
#include <hdf5.h>

#include <filesystem>
#include <functional>
#include <limits>

#include "core/error.h"
#include "core/hdf5.h"

namespace coral {
namespace {
namespace fs = std::filesystem;

class DamagedHdf5 : public testing::Test {
protected:
    void TearDown() override { fs::remove(file); }
    /// A file in the oldest layout, filled by `fill`.
    void make(const std::function<void(hid_t)>& fill)
    {
        const hid_t id = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
        fill(id);
        H5Fclose(id);
    }
    /// A dataset of which nothing is stored.
    static void empty_dataset(hid_t id, const char* name, std::vector<hsize_t> dims, std::vector<hsize_t> chunk)
    {
        const std::vector<hsize_t> unlimited(dims.size(), H5S_UNLIMITED);  // lets a chunk be larger than the dataset
        const hid_t list = H5Pcreate(H5P_DATASET_CREATE), space = H5Screate_simple(int(dims.size()), dims.data(), chunk.empty() ? nullptr : unlimited.data());
        if (!chunk.empty()) H5Pset_chunk(list, int(chunk.size()), chunk.data());
        H5Dclose(H5Dcreate2(id, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, list, H5P_DEFAULT));
        H5Sclose(space);
        H5Pclose(list);
    }
    static void number(hid_t id, const char* name, double value)
    {
        const hid_t space = H5Screate(H5S_SCALAR), attribute = H5Acreate2(id, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
        H5Awrite(attribute, H5T_NATIVE_DOUBLE, &value);
        H5Aclose(attribute);
        H5Sclose(space);
    }
    std::string complaint(const std::function<void(const H5File&)>& read) const
    {
        try {
            read(H5File::open(file));
        } catch (const Error& error) {
            return error.what();
        }
        return "";
    }
    fs::path file = fs::temp_directory_path() / ("coral-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".h5");
};

TEST_F(DamagedHdf5, that_asks_for_more_than_it_stores_takes_no_memory)
{
    make([](hid_t id) {
        empty_dataset(id, "long", {hsize_t{1} << 40}, {1024});
        empty_dataset(id, "wide", {1 << 20, 1 << 20, 1 << 20}, {1, 1, 1});
        empty_dataset(id, "unwritten", {1 << 24}, {});
        empty_dataset(id, "chunk", {100}, {1 << 28});
        empty_dataset(id, "sparse", {1000}, {100});
    });
    EXPECT_EQ(complaint([](const H5File& h5) { h5.read_doubles("/long"); }), file.string() + ":/long: announces 8796093022208 bytes but stores 0; the file is damaged; copy it again");
    EXPECT_NE(complaint([](const H5File& h5) { h5.read_doubles("/wide"); }).find("announces 9223372036854775808 bytes"), std::string::npos);
    EXPECT_NE(complaint([](const H5File& h5) { h5.read_floats("/unwritten"); }).find("announces 134217728 bytes but stores 0"), std::string::npos);
    EXPECT_NE(complaint([](const H5File& h5) { h5.read_doubles("/wide", 0, 1); }).find("announces"), std::string::npos);
    EXPECT_NE(complaint([](const H5File& h5) { h5.dims("/chunk"); }).find("announces 2147483648 bytes"), std::string::npos);
    EXPECT_EQ(complaint([](const H5File& h5) { EXPECT_EQ(h5.read_doubles("/sparse"), std::vector<double>(1000)); }), "") << "little enough to be filled in";
}

TEST_F(DamagedHdf5, with_names_and_numbers_out_of_range_is_an_error_of_ours)
{
    make([](hid_t id) {
        for (const char* name : {"1", "99999999999999999999999999", "2"}) H5Gclose(H5Gcreate2(id, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
        number(id, "nan", std::numeric_limits<double>::quiet_NaN());
        number(id, "huge", 1e300);
        number(id, "half", 0.5);
        number(id, "three", 3);
    });
    const H5File h5 = H5File::open(file);
    EXPECT_EQ(h5.members("/").size(), 3u);
    EXPECT_EQ(h5.integer_attribute("/", "three"), 3);
    for (const char* name : {"nan", "huge", "half"})
        EXPECT_EQ(complaint([&](const H5File& in) { in.integer_attribute("/", name); }),
                  file.string() + ": attribute " + name + " is no whole number; is it the right file? make it again with the tool that wrote it");
}

TEST_F(DamagedHdf5, of_a_newer_format_is_refused_and_one_without_is_the_first)
{
    const auto complaint_about = [&](const std::function<void(H5File&)>& fill) {
        H5File out = H5File::create(file);
        fill(out);
        out.commit();
        return complaint([](const H5File& h5) { h5.require_format(2); });
    };
    EXPECT_EQ(complaint_about([](H5File&) {}), "");
    EXPECT_EQ(complaint_about([](H5File& h5) { h5.set_format(1); }), "");
    EXPECT_EQ(complaint_about([](H5File& h5) { h5.set_format(2); }), "");
    EXPECT_EQ(complaint_about([](H5File& h5) { h5.set_attribute("/", "format", "coralsand sample"); }), "") << "the first samples had a text there";
    EXPECT_EQ(complaint_about([](H5File& h5) { h5.set_format(3); }),
              file.string() + ": was written by a newer version of the tools (format 3, this one reads up to 2); update the tools");
}

}  // namespace
}  // namespace coral
