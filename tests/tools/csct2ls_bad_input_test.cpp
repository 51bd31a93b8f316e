// csct2ls with everything that can be wrong about its input and output: one clear line, the right exit code, nothing left behind.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>

#include "core/hdf5.h"
#include "morph/stack_io.h"
#include "sdf/mesh_reader.h"
#include "sdf/vdb_io.h"
#include "tools/run_program.h"

namespace coral::test {
namespace {

namespace fs = std::filesystem;

constexpr int n = 34;

/// Hollow ball of radius 13 voxels in a box of 34.
std::vector<std::uint8_t> ball()
{
    std::vector<std::uint8_t> voxels;
    const Eigen::Vector3d c(17.2, 16.9, 17.1);
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const double r = (Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5) - c).norm();
                voxels.push_back(r <= 13 && r > 5 ? 255 : 0);
            }
    return voxels;
}

template <class T>
std::string bytes_of(const std::vector<T>& values)
{
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string nrrd(const std::string& data, const std::string& type = "uchar", const std::string& more = "", const std::string& encoding = "raw",
                 const std::string& sizes = "34 34 34")
{
    return "NRRD0004\ntype: " + type + "\ndimension: 3\nsizes: " + sizes + "\nencoding: " + encoding + "\nendian: little\n" + more + "\n" + data;
}

class BadInput : public testing::Test {
protected:
    std::size_t files() const { return std::size_t(std::distance(fs::recursive_directory_iterator(folder_.path()), fs::recursive_directory_iterator{})); }
    void write(const std::string& name, const std::string& text) const { write_text(folder_.path() / name, text); }

    /// The run fails with `code` and one line that holds all `texts`, and leaves no file.
    void expect(const std::string& arguments, int code, const std::vector<std::string>& texts, const std::string& outputs = " -o out.vdb --table out.csv --voids voids.csv --mesh meshes") const
    {
        const std::size_t before = files();
        const ProgramResult result = run_program("csct2ls --quiet " + arguments + outputs, folder_.path());
        EXPECT_EQ(result.exit_code, code) << arguments << "\n" << result.err;
        for (const std::string& text : texts) EXPECT_NE(result.err.find(text), std::string::npos) << arguments << "\n  wanted: " << text << "\n  said: " << result.err;
        EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
        EXPECT_TRUE(result.err.starts_with("csct2ls: ")) << result.err;
        EXPECT_EQ(files(), before) << arguments << " leaves something behind";
    }
    /// The run succeeds and warns.
    void expect_warning(const std::string& arguments, const std::string& text) const
    {
        const ProgramResult result = run_program("csct2ls --quiet " + arguments + " -o out.vdb", folder_.path());
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_NE(result.err.find(text), std::string::npos) << arguments << "\n  wanted: " << text << "\n  said: " << result.err;
        fs::remove(folder_.path() / "out.vdb");
    }

    ScratchFolder folder_;
    std::string voxels_ = bytes_of(ball());
};

TEST_F(BadInput, empty_and_foreign_files)
{
    for (const char* name : {"empty.tif", "empty.nrrd", "empty.mha", "empty.h5"}) write(name, "");
    write("text.tif", "no image at all");
    write("thing.xyz", "1 2 3");
    fs::create_directory(folder_.path() / "nothing");
    expect("empty.tif --voxel-size 30um", 1, {"empty.tif: cannot be read as TIFF", "truncated"});
    expect("text.tif --voxel-size 30um", 1, {"text.tif: cannot be read as TIFF"});
    expect("empty.nrrd --voxel-size 30um", 1, {"empty.nrrd: is no NRRD file"});
    expect("empty.mha --voxel-size 30um", 1, {"empty.mha: the header lacks"});
    expect("empty.h5:/labels --voxel-size 30um", 1, {"empty.h5", "is not an HDF5 file"});
    expect("empty.h5 --voxel-size 30um", 2, {"empty.h5: is HDF5, without a dataset; write empty.h5:/dataset"});
    expect("thing.xyz --voxel-size 30um", 2, {"unknown kind of stack '.xyz'", ".tif"});
    expect("nothing --voxel-size 30um", 1, {"nothing: holds no .tif or .tiff slices; export"});
    expect("absent.tif --voxel-size 30um", 2, {"absent.tif: no such file"});
}

TEST_F(BadInput, stacks_without_grains)
{
    write("zero.nrrd", nrrd(std::string(n * n * n, '\0')));
    write("full.nrrd", nrrd(std::string(n * n * n, '\1')));
    std::string one(n * n * n, '\0');
    one[17 + n * (17 + n * 17)] = '\1';
    write("one.nrrd", nrrd(one));
    expect("zero.nrrd --voxel-size 30um", 1, {"zero.nrrd: every voxel is 0: there are no grains"});
    expect("full.nrrd --voxel-size 30um", 1, {"full.nrrd: every voxel is 1: there are no grains"});
    expect("one.nrrd --voxel-size 30um", 1, {"one.nrrd: no grain is left: 1 dropped (0 at the border, 1 too small", "--min-diameter"});
}

TEST_F(BadInput, voxel_sizes_that_cannot_be)
{
    write("silent.nrrd", nrrd(voxels_));
    const auto with = [&](const std::string& spacings) { return nrrd(voxels_, "uchar", "space units: \"um\" \"um\" \"um\"\nspacings: " + spacings + "\n"); };
    write("negative.nrrd", with("-30 30 30"));
    write("zero.nrrd", with("0 30 30"));
    write("nan.nrrd", with("nan 30 30"));
    write("ten.nrrd", with("10 10 10"));
    expect("silent.nrrd", 2, {"silent.nrrd: the file does not say its voxel size", "--voxel-size 30um"});
    for (const char* name : {"negative.nrrd", "zero.nrrd", "nan.nrrd"}) expect(name, 2, {std::string(name) + ": the file says a voxel of ", "--voxel-size"});
    for (const char* size : {"0um", "-30um", "30", "20mm"}) expect(std::string("silent.nrrd --voxel-size ") + size, 2, {"--voxel-size", "between 0 and 1 cm"});
    expect("silent.nrrd --voxel-size 30um,30um", 2, {"needs one edge or three"});
    expect("silent.nrrd --voxel-size nan", 2, {"'nan' is not a quantity"});
    expect("silent.nrrd --voxel-size 30kg", 2, {"has the unit 'kg'"});
    expect_warning("ten.nrrd --voxel-size 30um", "the file says a voxel of 10 um, --voxel-size 30 um is used");
}

TEST_F(BadInput, truncated_files_of_every_kind)
{
    const std::string whole = nrrd(voxels_);
    for (const std::size_t length : {std::size_t{20}, std::size_t{60}, whole.size() - voxels_.size() + 1, whole.size() / 2, whole.size() - 1}) {
        write("cut.nrrd", whole.substr(0, length));
        expect("cut.nrrd --voxel-size 30um", 1, {"cut.nrrd: "});
    }
    const std::string header = "ObjectType = Image\nNDims = 3\nDimSize = 34 34 34\nElementType = MET_UCHAR\nElementDataFile = ";
    write("cut.mha", header + "LOCAL\n" + voxels_.substr(0, 500));
    write("gone.mhd", header + "gone.raw\n");
    write("cut.raw", voxels_.substr(0, 1000));
    expect("cut.mha --voxel-size 30um", 1, {"cut.mha: asks for 39304 bytes of voxels, but only 500 bytes follow; compare size and type in the header", "copy it again"});
    expect("gone.mhd --voxel-size 30um", 1, {"gone.mhd: names the data file 'gone.raw', which is not there; copy it beside the header"});
    expect("cut.raw --voxel-size 30um --shape 34,34,34", 1, {"cut.raw: has 1000 bytes where --shape and --type need 39304", "check both options"});
    uLongf size = compressBound(uLong(voxels_.size()));
    std::string packed(size, '\0');
    ASSERT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(voxels_.data()), uLong(voxels_.size())), Z_OK);
    write("cut_packed.nrrd", nrrd(packed.substr(0, size / 2), "uchar", "", "gzip"));
    expect("cut_packed.nrrd --voxel-size 30um", 1, {"compressed data end or break after"});

    morph::VoxelStack stack;
    stack.size = {n, n, n};
    const std::vector<std::uint8_t> values = ball();
    stack.values = std::vector<std::uint32_t>(values.begin(), values.end());
    const fs::path tiff = folder_.path() / "cut.tif";
    for (const double part : {0.02, 0.3, 0.7, 0.999}) {
        morph::write_tiff(stack, tiff, 8);
        fs::resize_file(tiff, std::uintmax_t(part * double(fs::file_size(tiff))));
        expect("cut.tif --voxel-size 30um", 1, {"cut.tif", "truncated or damaged"});
    }
}

TEST_F(BadInput, wrong_shape_of_a_raw_file)
{
    write("s.raw", voxels_);
    expect("s.raw --voxel-size 30um", 2, {"s.raw: a .raw file does not say its size", "--shape nx,ny,nz"});
    for (const char* shape : {"34,34", "34,34,-34", "34,34,0", "34,34,34x", "34,34,3.5", "a,b,c"})
        expect(std::string("s.raw --voxel-size 30um --shape ") + shape, 2, {"--shape", "needs three positive whole numbers"});
    expect("s.raw --voxel-size 30um --shape 34,34,35", 1, {"has 39304 bytes where --shape and --type need 40460"});
    expect("s.raw --voxel-size 30um --shape 34,34,34 --type u16", 1, {"need 78608"});
    expect("s.raw --voxel-size 30um --shape 34,34,34 --type u7", 2, {"--type"});
}

TEST_F(BadInput, slices_missing_doubled_or_of_different_size)
{
    const auto slice = [&](const std::string& name, int edge) {
        morph::VoxelStack stack;
        stack.size = {edge, edge, 1};
        stack.values = std::vector<std::uint32_t>(std::size_t(edge * edge), 1);
        morph::write_tiff(stack, folder_.path() / name, 8);
    };
    for (const char* folder : {"gap", "sizes", "names"}) fs::create_directory(folder_.path() / folder);
    for (const int k : {8, 9, 10, 12}) slice("gap/s" + std::to_string(k) + ".tif", 8);
    slice("sizes/s1.tif", 8);
    slice("sizes/s2.tif", 9);
    slice("names/a.tif", 8);
    slice("names/b.tif", 8);
    expect("gap --voxel-size 30um", 1, {"slice 11 is missing between s10.tif and s12.tif"});
    expect("sizes --voxel-size 30um", 1, {"s2.tif: is 9 x 9 where the slices before are 8 x 8"});
    expect("names --voxel-size 30um", 1, {"has no number in its name"});
}

TEST_F(BadInput, numbers_that_mean_nothing)
{
    std::vector<float> reals(n * n * n, 1.0F);
    reals[1234] = std::numeric_limits<float>::quiet_NaN();
    write("nan.nrrd", nrrd(bytes_of(reals), "float"));
    std::vector<std::int16_t> negative(n * n * n, 3);
    negative[77] = -5;
    write("negative.nrrd", nrrd(bytes_of(negative), "short"));
    std::string grey = voxels_;
    for (std::size_t v = 0; v < grey.size(); ++v) grey[v] = char(v * 7919 % 113);
    write("grey.nrrd", nrrd(grey));
    write("packed.nrrd", nrrd(voxels_, "uchar", "", "bzip2"));
    write("type.nrrd", nrrd(voxels_, "block"));
    write("size.nrrd", nrrd(voxels_, "uchar", "", "raw", "34 34"));
    expect("nan.nrrd --voxel-size 30um", 1, {"nan.nrrd: voxel 1234 is not a number"});
    expect("negative.nrrd --voxel-size 30um", 1, {"voxel 77 is -5"});
    expect("grey.nrrd --voxel-size 30um", 2, {"grey.nrrd: holds grey values (113 levels)", "--threshold otsu"});
    expect("packed.nrrd --voxel-size 30um", 1, {"unsupported encoding 'bzip2'", "raw or gzip"});
    expect("type.nrrd --voxel-size 30um", 1, {"unsupported type 'block'"});
    expect("size.nrrd --voxel-size 30um", 1, {"size '34 34'"});
}

TEST_F(BadInput, values_and_options_that_do_not_fit_the_stack)
{
    write("s.nrrd", nrrd(voxels_));
    expect("s.nrrd --voxel-size 30um --solid 9", 2, {"--solid 9: no voxel has this value; the stack holds 0, 255"});
    expect("s.nrrd --voxel-size 30um --threshold high", 2, {"--threshold high: is neither a number nor 'otsu'"});
    expect("s.nrrd --voxel-size 30um --spacing 10um", 2, {"--spacing 10 um: is less than half a voxel (30 um)", "30 um or more"});
    expect("s.nrrd --voxel-size 30um --spacing -1um", 2, {"--spacing: must not be negative"});
    expect("s.nrrd --voxel-size 30um --mesh-unit mm", 2, {"--mesh-unit: goes with --from-mesh only"});
    expect("s.nrrd --voxel-size 30um --min-diameter 5mm", 1, {"s.nrrd: no grain is left", "1 too small"});
}

TEST_F(BadInput, a_grain_thinner_than_the_spacing_is_warned_of_with_its_loss)
{
    const int wide = 60;
    std::string plate(std::size_t(wide * wide * wide), '\0');
    for (int k = 28; k < 31; ++k)
        for (int j = 5; j < 55; ++j)
            for (int i = 5; i < 55; ++i) plate[std::size_t(i + wide * (j + wide * k))] = '\1';
    write("plate.nrrd", nrrd(plate, "uchar", "", "raw", "60 60 60"));
    expect_warning("plate.nrrd --voxel-size 30um --spacing 600um", "warning: parts are thinner than the spacing of 600 um: grain 1 (label 1)");
}

TEST_F(BadInput, dataset_of_the_wrong_rank_or_absent)
{
    {
        H5File file = H5File::create(folder_.path() / "flat.h5");
        const std::vector<double> values(12, 1.0);
        file.write("/flat", values, {3, 4});
        file.commit();
    }
    expect("flat.h5:/flat --voxel-size 30um", 1, {"flat.h5:/flat: has 2 dimensions, not 3"});
    expect("flat.h5:/labels --voxel-size 30um", 1, {"flat.h5:/labels: there is no such dataset; the file has /flat"});
}

TEST_F(BadInput, outputs_that_cannot_be_written)
{
    write("s.nrrd", nrrd(voxels_));
    expect("s.nrrd --voxel-size 30um", 2, {"absent/out.vdb: the folder absent does not exist"}, " -o absent/out.vdb");
    expect("s.nrrd --voxel-size 30um", 2, {"absent/voids.csv: the folder absent does not exist"}, " -o out.vdb --voids absent/voids.csv");
    expect("s.nrrd --voxel-size 30um", 2, {"--mesh absent/meshes: its folder does not exist"}, " -o out.vdb --mesh absent/meshes");
    expect("s.nrrd --voxel-size 30um", 2, {"--mesh s.nrrd: is not a folder"}, " -o out.vdb --mesh s.nrrd");
    fs::create_directory(folder_.path() / "taken.vdb");
    expect("s.nrrd --voxel-size 30um", 2, {"taken.vdb: is a folder"}, " -o taken.vdb");
}

TEST_F(BadInput, a_folder_without_write_permission)
{
    if (::geteuid() == 0) GTEST_SKIP() << "root may write anywhere: the folder without write permission is not tried";
    write("s.nrrd", nrrd(voxels_));
    fs::create_directory(folder_.path() / "locked");
    fs::permissions(folder_.path() / "locked", fs::perms::owner_read | fs::perms::owner_exec);
    expect("s.nrrd --voxel-size 30um", 1, {"locked/out.vdb: the folder locked is not writable"}, " -o locked/out.vdb");
    fs::permissions(folder_.path() / "locked", fs::perms::owner_all);
}

TEST_F(BadInput, a_full_disk)
{
    write("s.nrrd", nrrd(voxels_));
    const fs::path small = folder_.path() / "small";
    fs::create_directory(small);
    if (::mount("tmpfs", small.c_str(), "tmpfs", 0, "size=64k") != 0) GTEST_SKIP() << "cannot mount a small tmpfs: " << std::strerror(errno);
    const struct Unmount {
        const fs::path& folder;
        ~Unmount() { ::umount(folder.c_str()); }
    } unmount{small};
    expect("s.nrrd --voxel-size 30um", 1, {"small/out.vdb: could not be written", "space left on the disk"}, " -o small/out.vdb --table small/out.csv");
    expect("s.nrrd --voxel-size 30um", 1, {"could not be written", "space left on the disk"}, " -o out.vdb --spacing 30um --mesh small/meshes");
    // A table that does not fit takes the level sets with it: all files or none.
    write("small/filler", std::string(64 << 10, 'x'));
    expect("s.nrrd --voxel-size 30um", 1, {"small/out.csv: could not be written", "space left on the disk"}, " -o out.vdb --table small/out.csv");
}

TEST_F(BadInput, level_sets_that_are_not_ours_or_damaged_are_refused_by_the_next_tool)
{
    write("s.nrrd", nrrd(voxels_));
    ASSERT_EQ(run_program("csct2ls s.nrrd -o g.vdb --voxel-size 30um --quiet", folder_.path()).exit_code, 0);
    std::string text;
    {
        std::ifstream in(folder_.path() / "g.vdb", std::ios::binary);
        text.assign(std::istreambuf_iterator<char>(in), {});
    }
    const auto refused = [&](const std::string& content, const std::string& what) {
        write("bad.vdb", content);
        const ProgramResult result = run_program("ls2sh bad.vdb -o g.sh.h5 --quiet", folder_.path());
        EXPECT_EQ(result.exit_code, 1) << result.err;
        EXPECT_NE(result.err.find("bad.vdb: " + what), std::string::npos) << result.err;
        EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
        EXPECT_FALSE(fs::exists(folder_.path() / "g.sh.h5"));
    };
    refused("no volume at all", "holds no grains of ours");
    refused("", "holds no grains of ours");
    refused(text.substr(0, text.size() / 2), "");
    std::string foreign = text;
    foreign.replace(foreign.find("coralsand grains"), 9, "somebody.");
    refused(foreign, "is damaged: its bytes do not give the checksum it carries; copy it again");
}

}  // namespace
}  // namespace coral::test
