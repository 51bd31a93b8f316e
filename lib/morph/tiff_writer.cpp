#include <tiffio.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "core/error.h"
#include "core/output_file.h"
#include "core/text.h"
#include "morph/stack_io.h"

namespace coral::morph {
namespace {

int keep_silent(TIFF*, void*, const char*, const char*, va_list) { return 1; }

struct Closer {
    void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};

template <class T>
bool write_slice(TIFF* tiff, const std::vector<std::uint32_t>& slice)
{
    std::vector<T> image(slice.size());
    std::transform(slice.begin(), slice.end(), image.begin(), [](std::uint32_t v) { return T(v); });
    return TIFFWriteEncodedStrip(tiff, 0, image.data(), tmsize_t(image.size() * sizeof(T))) >= 0;
}

std::string imagej_description(const VoxelStack& stack)
{
    std::string text = "ImageJ=1.53t\nimages=" + std::to_string(stack.size.z()) + "\nslices=" + std::to_string(stack.size.z()) + "\n";
    if (stack.voxel_size.x() > 0) text += "unit=um\nspacing=" + to_text(stack.voxel_size.z() * 1e6) + "\n";
    return text + "loop=false\n";
}

}  // namespace

void write_tiff(const VoxelStack& stack, const std::filesystem::path& file, int bits)
{
    if (bits != 8 && bits != 16 && bits != 32) throw Error(file.string(), "a TIFF stack has 8, 16 or 32 bits, not " + std::to_string(bits));
    const std::uint32_t largest = stack.values.largest();
    if (bits < 32 && largest >> bits) throw Error(file.string(), "value " + std::to_string(largest) + " does not fit " + std::to_string(bits) + " bits");
    OutputFile output(file);
    {
        TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
        TIFFOpenOptionsSetErrorHandlerExtR(options, keep_silent, nullptr);
        const bool big = stack.count() * std::size_t(bits / 8) > 3'000'000'000U;
        const std::unique_ptr<TIFF, Closer> handle(TIFFOpenExt(output.temporary().c_str(), big ? "w8" : "w", options));
        TIFFOpenOptionsFree(options);
        TIFF* tiff = handle.get();
        bool good = tiff != nullptr;
        std::vector<std::uint32_t> slice(std::size_t(stack.size.x()) * std::size_t(stack.size.y()));
        for (int k = 0; good && k < stack.size.z(); ++k) {
            TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, std::uint32_t(stack.size.x()));
            TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, std::uint32_t(stack.size.y()));
            TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, std::uint16_t(bits));
            TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, std::uint16_t(1));
            TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, std::uint16_t(SAMPLEFORMAT_UINT));
            TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, std::uint16_t(PHOTOMETRIC_MINISBLACK));
            TIFFSetField(tiff, TIFFTAG_COMPRESSION, std::uint16_t(COMPRESSION_ADOBE_DEFLATE));
            TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, std::uint32_t(stack.size.y()));
            if (stack.voxel_size.x() > 0) {
                TIFFSetField(tiff, TIFFTAG_XRESOLUTION, float(1e-6 / stack.voxel_size.x()));
                TIFFSetField(tiff, TIFFTAG_YRESOLUTION, float(1e-6 / stack.voxel_size.y()));
                TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, std::uint16_t(RESUNIT_NONE));
            }
            if (k == 0) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, imagej_description(stack).c_str());
            stack.values.read(stack.index(0, 0, k), slice);
            if (bits == 8) good = write_slice<std::uint8_t>(tiff, slice);
            else if (bits == 16) good = write_slice<std::uint16_t>(tiff, slice);
            else good = write_slice<std::uint32_t>(tiff, slice);
            good = good && TIFFWriteDirectory(tiff);
        }
        if (!good) throw Error(file.string(), "cannot be written", "check the free space of the disk");
    }
    output.commit();
}

}  // namespace coral::morph
