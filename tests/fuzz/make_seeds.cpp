// Small good files for the fuzzers to start from, one folder per reader.
#include <hdf5.h>
#include <tiffio.h>

#include <cmath>
#include <fstream>
#include <numeric>

#include "core/hdf5.h"
#include "morph/stack_io.h"
#include "sdf/vdb_io.h"
#include "sh/shape_file.h"

namespace {

using namespace coral;
namespace fs = std::filesystem;

void write_text(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

std::string voxels(std::size_t bytes)
{
    std::string text(bytes, '\0');
    for (std::size_t n = 0; n < bytes; ++n) text[n] = char(n % 5 == 0);
    return text;
}

/// Two pages of 16 x 16 in one of libtiff's layouts.
void write_pages(const fs::path& file, const char* mode, int bits, int compression, bool tiled)
{
    TIFF* tiff = TIFFOpen(file.c_str(), mode);
    std::vector<std::uint8_t> row(std::size_t(16 * 16 * bits / 8 + 16), 1);
    for (int page = 0; page < 2; ++page) {
        TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 16);
        TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 16);
        TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
        TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, bits == 32 ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(tiff, TIFFTAG_COMPRESSION, compression);
        if (page == 0) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, "ImageJ=1.53t\nimages=2\nslices=2\nunit=um\nspacing=30\n");
        if (bits == 32) std::fill(row.begin(), row.end(), std::uint8_t{0});
        if (tiled) {
            TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 16);
            TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
            TIFFWriteEncodedTile(tiff, 0, row.data(), tmsize_t(16 * 16 * bits / 8));
        } else {
            TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 8);
            for (std::uint32_t y = 0; y < 16; ++y) TIFFWriteScanline(tiff, row.data(), y);
        }
        TIFFWriteDirectory(tiff);
    }
    TIFFClose(tiff);
}

void write_tiffs(const fs::path& folder)
{
    write_pages(folder / "strips.tif", "w", 8, COMPRESSION_NONE, false);
    write_pages(folder / "lzw.tif", "w", 16, COMPRESSION_LZW, false);
    write_pages(folder / "packbits.tif", "wb", 8, COMPRESSION_PACKBITS, false);
    write_pages(folder / "tiles.tif", "w", 8, COMPRESSION_ADOBE_DEFLATE, true);
    write_pages(folder / "big.tif", "w8", 8, COMPRESSION_NONE, false);
    write_pages(folder / "float.tif", "w", 32, COMPRESSION_NONE, false);
}

void headers(const fs::path& nrrd, const fs::path& meta)
{
    const std::string common = "NRRD0005\n# comment\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nspace units: \"um\" \"um\" \"um\"\n";
    write_text(nrrd / "raw.nrrd", common + "space directions: (30,0,0) (0,30,0) (0,0,30)\nencoding: raw\n\n" + voxels(64));
    write_text(nrrd / "short.nrrd", "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 4 2\nspacings: 1 1 1\nendian: big\nencoding: raw\n\n" + voxels(64));
    // 64 zeros through gzip
    const unsigned char packed[] = {0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3, 0x63, 0x60, 0xa0, 0x2d, 0, 0, 0x36, 0x63, 0x8d, 0x75, 0x40, 0, 0, 0};
    write_text(nrrd / "gzip.nrrd", common + "encoding: gzip\n\n" + std::string(reinterpret_cast<const char*>(packed), sizeof packed));
    write_text(meta / "raw.mha", "ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\nElementSpacing = 30 30 30\nDistanceUnits = um\nElementType = MET_UCHAR\n"
                                 "CompressedData = False\nElementDataFile = LOCAL\n" + voxels(64));
    write_text(meta / "float.mha", "NDims = 3\nDimSize = 2 2 2\nBinaryDataByteOrderMSB = True\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n" + std::string(32, '\0'));
    write_text(meta / "zlib.mha", "NDims = 3\nDimSize = 4 4 4\nElementType = MET_UCHAR\nCompressedData = True\nElementDataFile = LOCAL\n" +
                                      std::string("\x78\x9c\x63\x60\xa0\x2d\0\0\0\x40\0\x01", 12));
}

/// A stack as other programs write it: the oldest layout has no checksums, so that the fuzzer gets further with it.
void old_hdf5(const fs::path& file, bool packed)
{
    const hid_t id = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), list = H5Pcreate(H5P_DATASET_CREATE);
    const hsize_t dims[] = {4, 4, 4}, chunk[] = {2, 4, 4}, three = 3;
    if (packed) {
        H5Pset_chunk(list, 3, chunk);
        H5Pset_shuffle(list);
        H5Pset_deflate(list, 4);
    }
    const hid_t space = H5Screate_simple(3, dims, nullptr), dataset = H5Dcreate2(id, "labels", H5T_NATIVE_UINT16, space, H5P_DEFAULT, list, H5P_DEFAULT);
    const std::vector<std::uint16_t> labels(64, 7);
    H5Dwrite(dataset, H5T_NATIVE_UINT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, labels.data());
    const double edge[] = {3e-5, 3e-5, 3e-5};
    const hid_t row = H5Screate_simple(1, &three, nullptr), attribute = H5Acreate2(dataset, "voxel_size", H5T_NATIVE_DOUBLE, row, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, H5T_NATIVE_DOUBLE, edge);
    H5Aclose(attribute);
    H5Dclose(dataset);
    for (const hid_t s : {space, row}) H5Sclose(s);
    H5Pclose(list);
    H5Fclose(id);
}

void hdf5(const fs::path& folder)
{
    old_hdf5(folder / "old.h5", false);
    old_hdf5(folder / "old_packed.h5", true);
    {
        H5File file = H5File::create(folder / "labels.h5");
        std::vector<std::int32_t> labels(64);
        std::iota(labels.begin(), labels.end(), 0);
        file.write("/labels", labels, {4, 4, 4});
        file.set_attribute("/labels", "voxel_size", 3e-5);
        file.commit();
    }
    sh::ShapeRecord shape;
    shape.id = 1;
    shape.surface.degree = 1;
    shape.surface.coefficients.assign(4, 0.0);
    shape.surface.coefficients[0] = 1;
    shape.volume = shape.solid_volume = shape.equivalent_diameter = 1;
    sh::write_shapes(folder / "shapes.h5", {&shape, 1}, {{"ls2sh", "1", {}, {}}});
}

void vdb(const fs::path& folder)
{
    std::vector<std::uint8_t> ball;
    for (int k = 0; k < 8; ++k)
        for (int j = 0; j < 8; ++j)
            for (int i = 0; i < 8; ++i) ball.push_back((Eigen::Vector3d(i, j, k) - Eigen::Vector3d::Constant(3.5)).norm() < 3);
    const sdf::GrainMask mask{Eigen::Vector3i::Constant(8), Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Zero(), ball};
    sdf::GrainLevelSet grain = sdf::grain_from_masks(mask, mask, {.spacing = 2e-4, .inside_band = 2, .outside_band = 2});
    grain.id = 1;
    sdf::write_grains(folder / "grain.vdb", {&grain, 1}, {{"csct2ls", "1", {}, {}}});
}

void toml(const fs::path& folder)
{
    write_text(folder / "good.toml", "length = \"30um\"\ncount = 3\nflag = true\nname = \"x\"\nchoice = \"b\"\nvector = [1, 2.5, \"3m/s\"]\nlist = [\"1mm\", 2]\n"
                                     "names = [\"a\"]\nnumbers = [1, 2]\n[table.inner]\nlength = \"1%\"\n[[item]]\ncount = 4\n[[item]]\ncount = 5\n");
    write_text(folder / "wrong.toml", "lenght = 1e400\ncount = \"a\"\nvector = [1, [2], {}]\ndate = 1979-05-27T07:32:00Z\n");
}

}  // namespace

/// fuzz_seeds FOLDER
int main(int argc, char** argv)
{
    if (argc != 2) return 2;
    const fs::path root = argv[1];
    for (const char* name : {"tiff", "nrrd", "metaimage", "hdf5", "vdb", "toml"}) fs::create_directories(root / name);
    write_tiffs(root / "tiff");
    headers(root / "nrrd", root / "metaimage");
    hdf5(root / "hdf5");
    vdb(root / "vdb");
    toml(root / "toml");
}
