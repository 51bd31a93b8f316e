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
bool write_rows(TIFF* tiff, const std::uint32_t* slice, int width, int height)
{
    std::vector<T> image(std::size_t(width) * std::size_t(height));
    std::transform(slice, slice + image.size(), image.begin(), [](std::uint32_t v) { return T(v); });
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
    const std::uint32_t largest = stack.values.empty() ? 0 : *std::max_element(stack.values.begin(), stack.values.end());
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
            const std::uint32_t* slice = &stack.values[stack.index(0, 0, k)];
            if (bits == 8) good = write_rows<std::uint8_t>(tiff, slice, stack.size.x(), stack.size.y());
            else if (bits == 16) good = write_rows<std::uint16_t>(tiff, slice, stack.size.x(), stack.size.y());
            else good = write_rows<std::uint32_t>(tiff, slice, stack.size.x(), stack.size.y());
            good = good && TIFFWriteDirectory(tiff);
        }
        if (!good) throw Error(file.string(), "cannot be written", "check the free space of the disk");
    }
    output.commit();
}

}  // namespace coral::morph
