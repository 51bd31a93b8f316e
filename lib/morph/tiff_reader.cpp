#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <fstream>
#include <memory>

#include "core/error.h"
#include "core/text.h"
#include "morph/detail/readers.h"

namespace coral::morph::detail {
namespace {

/// First thing libtiff complained about. A truncated file often shows nowhere else: the page chain just ends early.
struct Complaint {
    std::string text;
};

int note_error(TIFF*, void* user, const char*, const char* format, va_list arguments)
{
    auto* complaint = static_cast<Complaint*>(user);
    if (complaint->text.empty()) {
        char line[512];
        std::vsnprintf(line, sizeof line, format, arguments);
        complaint->text = line;
        std::replace(complaint->text.begin(), complaint->text.end(), '\n', ' ');
        while (!complaint->text.empty() && (complaint->text.back() == '.' || complaint->text.back() == ' ')) complaint->text.pop_back();
    }
    return 1;
}

int ignore_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

struct Closer {
    void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using Handle = std::unique_ptr<TIFF, Closer>;

struct Page {
    std::uint32_t width = 0, height = 0;
    std::uint16_t bits = 1, samples = 1, format = SAMPLEFORMAT_UINT, photometric = PHOTOMETRIC_MINISBLACK, compression = COMPRESSION_NONE;
};

constexpr const char* damaged_hint = "the file is truncated or damaged; copy or export it again";

class Reader {
public:
    explicit Reader(const std::filesystem::path& file) : file_(file.string()), sink_(file.filename().string())
    {
        TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
        TIFFOpenOptionsSetErrorHandlerExtR(options, note_error, &complaint_);
        TIFFOpenOptionsSetWarningHandlerExtR(options, ignore_warning, nullptr);
        handle_.reset(TIFFOpenExt(file_.c_str(), "rc", options));  // c: no chopping of strips into 8 kB pieces
        TIFFOpenOptionsFree(options);
        if (!handle_) throw Error(file_, "cannot be read as TIFF (" + complaint_.text + ")", damaged_hint);
        file_bytes_ = double(std::filesystem::file_size(file));
    }

    VoxelStack run()
    {
        walk(true);
        sink_.finish(stack_);
        return std::move(stack_);
    }

    StackHeader header()
    {
        walk(false);
        return {stack_.size, stack_.voxel_size, to_string(number_type()), stack_.name};
    }

private:
    /// All pages, with or without their voxels.
    void walk(bool voxels)
    {
        stack_.name = std::filesystem::path(file_).filename().string();
        first_ = page_fields();
        check_supported(first_);
        if (voxels) sink_.reserve(std::size_t(first_.width) * first_.height, std::max(first_.bits / 8, 1));
        read_description();
        int pages = 0;
        const bool single = announced_pages_ > 1 && TIFFNumberOfDirectories(handle_.get()) == 1 && complaint_.text.empty();
        complaint_.text.clear();  // what the count met, the walk below meets again, and can name the page
        if (single) {
            read_contiguous(voxels);
            pages = announced_pages_;
        } else {
            do {
                read_page(++pages, voxels);
            } while (TIFFReadDirectory(handle_.get()));
            fail_on_complaint(pages + 1);
            if (announced_pages_ > 0 && announced_pages_ != pages)
                throw Error(file_, "holds " + std::to_string(pages) + " pages where its description announces " + std::to_string(announced_pages_),
                            damaged_hint);
        }
        stack_.size = {int(first_.width), int(first_.height), pages};
    }

    std::string where(int page) const { return file_ + ": page " + std::to_string(page); }

    void fail_on_complaint(int page) const
    {
        if (!complaint_.text.empty()) throw Error(where(page), "cannot be read (" + complaint_.text + ")", damaged_hint);
    }

    Page page_fields() const
    {
        Page p;
        TIFF* t = handle_.get();
        TIFFGetField(t, TIFFTAG_IMAGEWIDTH, &p.width);
        TIFFGetField(t, TIFFTAG_IMAGELENGTH, &p.height);
        TIFFGetFieldDefaulted(t, TIFFTAG_BITSPERSAMPLE, &p.bits);
        TIFFGetFieldDefaulted(t, TIFFTAG_SAMPLESPERPIXEL, &p.samples);
        TIFFGetFieldDefaulted(t, TIFFTAG_SAMPLEFORMAT, &p.format);
        TIFFGetField(t, TIFFTAG_PHOTOMETRIC, &p.photometric);
        TIFFGetFieldDefaulted(t, TIFFTAG_COMPRESSION, &p.compression);
        return p;
    }

    void check_supported(const Page& p) const
    {
        const auto refuse = [&](const std::string& what) { throw Error(where(1), what, "save the stack as 8, 16 or 32-bit grey values"); };
        if (p.width == 0 || p.height == 0 || p.width > 100000 || p.height > 100000) refuse("has an impossible size");
        if (p.samples != 1) refuse("has " + std::to_string(p.samples) + " colours per pixel");
        if (p.photometric == PHOTOMETRIC_PALETTE) refuse("is a palette image");
        if (p.photometric == PHOTOMETRIC_MINISWHITE) refuse("counts white as zero");
        // A page of a few bytes may claim any size. No codec of libtiff packs better than this, and small pages may be all one value.
        constexpr double most_unpacked_per_packed = 1e4, always_allowed_bytes = 64 << 20;
        const double page_bytes = double(p.width) * p.height * p.bits / 8;
        const double most = p.compression == COMPRESSION_NONE ? file_bytes_ : std::max(always_allowed_bytes, most_unpacked_per_packed * file_bytes_);
        if (page_bytes > most)
            throw Error(where(1), "asks for " + std::to_string(std::uint64_t(page_bytes)) + " bytes, but the file has " + std::to_string(std::uint64_t(file_bytes_)), damaged_hint);
        const bool real = p.format == SAMPLEFORMAT_IEEEFP;
        const bool known = real ? p.bits == 32 || p.bits == 64 : p.bits == 1 || p.bits == 8 || p.bits == 16 || p.bits == 32;
        if (!known || p.format > SAMPLEFORMAT_VOID)
            refuse("has " + std::to_string(p.bits) + " bits per pixel of sample format " + std::to_string(p.format));
    }

    NumberType number_type() const
    {
        NumberType type;
        type.bytes = first_.bits / 8;
        type.kind = first_.format == SAMPLEFORMAT_IEEEFP ? NumberKind::real
                    : first_.format == SAMPLEFORMAT_INT  ? NumberKind::signed_integer
                                                         : NumberKind::unsigned_integer;
        return type;
    }

    void read_page(int number, bool voxels)
    {
        fail_on_complaint(number);
        const Page p = page_fields();
        if (p.width != first_.width || p.height != first_.height || p.bits != first_.bits || p.format != first_.format || p.samples != 1)
            throw Error(where(number),
                        "is " + std::to_string(p.width) + " x " + std::to_string(p.height) + " at " + std::to_string(p.bits) + " bits where page 1 is " +
                            std::to_string(first_.width) + " x " + std::to_string(first_.height) + " at " + std::to_string(first_.bits),
                        "all pages must have one size and type");
        if (!voxels) return;
        const std::size_t row_bytes = (std::size_t(p.width) * p.bits + 7) / 8;
        std::vector<std::byte> image(row_bytes * p.height);
        if (TIFFIsTiled(handle_.get())) read_tiles(image, row_bytes, p, number);
        else read_strips(image, number);
        fail_on_complaint(number);
        if (p.bits == 1)
            for (std::uint32_t j = 0; j < p.height; ++j) sink_.append_bits({image.data() + j * row_bytes, row_bytes}, int(p.width));
        else sink_.append(image, number_type(), where(number));
    }

    void read_strips(std::vector<std::byte>& image, int number)
    {
        TIFF* t = handle_.get();
        std::size_t done = 0;
        for (std::uint32_t s = 0; s < TIFFNumberOfStrips(t) && done < image.size(); ++s) {
            const tmsize_t got = TIFFReadEncodedStrip(t, s, image.data() + done, tmsize_t(image.size() - done));
            if (got < 0) throw Error(where(number), "strip " + std::to_string(s) + " cannot be read (" + complaint_.text + ")", damaged_hint);
            done += std::size_t(got);
        }
        if (done != image.size()) throw Error(where(number), "ends before its last row", damaged_hint);
    }

    void read_tiles(std::vector<std::byte>& image, std::size_t row_bytes, const Page& p, int number)
    {
        TIFF* t = handle_.get();
        std::uint32_t tile_width = 0, tile_height = 0;
        TIFFGetField(t, TIFFTAG_TILEWIDTH, &tile_width);
        TIFFGetField(t, TIFFTAG_TILELENGTH, &tile_height);
        const auto limit = [](std::uint32_t edge) { return 2 * std::max(edge, std::uint32_t{1024}); };
        if (tile_width > limit(p.width) || tile_height > limit(p.height))
            throw Error(where(number), "has tiles of " + std::to_string(tile_width) + " x " + std::to_string(tile_height) + ", more than its size", damaged_hint);
        std::vector<std::byte> tile(std::size_t(TIFFTileSize(t)));
        const std::size_t tile_row = std::size_t(TIFFTileRowSize(t));
        for (std::uint32_t y = 0; y < p.height; y += tile_height)
            for (std::uint32_t x = 0; x < p.width; x += tile_width) {
                if (TIFFReadTile(t, tile.data(), x, y, 0, 0) < 0)
                    throw Error(where(number), "tile at " + std::to_string(x) + ", " + std::to_string(y) + " cannot be read (" + complaint_.text + ")",
                                damaged_hint);
                const std::size_t first = std::size_t(x) * p.bits / 8;  // tiles are multiples of 16 wide: whole bytes
                const std::size_t bytes = std::min(tile_row, row_bytes - first);
                for (std::uint32_t j = 0; j < std::min(tile_height, p.height - y); ++j)
                    std::copy_n(tile.begin() + std::ptrdiff_t(j * tile_row), bytes, image.begin() + std::ptrdiff_t((y + j) * row_bytes + first));
            }
    }

    /// ImageJ (over 4 GB) and tifffile write one page and all other slices as plain numbers behind it.
    void read_contiguous(bool voxels)
    {
        if (first_.compression != COMPRESSION_NONE || first_.bits < 8)
            throw Error(file_, "holds 1 page where its description announces " + std::to_string(announced_pages_), damaged_hint);
        std::uint64_t* offsets = nullptr;
        if (!TIFFGetField(handle_.get(), TIFFTAG_STRIPOFFSETS, &offsets) || !offsets) throw Error(where(1), "has no strip offsets", damaged_hint);
        const std::size_t page_bytes = std::size_t(first_.width) * first_.height * first_.bits / 8;
        NumberType type = number_type();
        type.swapped = TIFFIsByteSwapped(handle_.get()) != 0;
        if (const double end = double(offsets[0]) + double(page_bytes) * announced_pages_; end > file_bytes_)
            throw Error(file_, "announces " + std::to_string(announced_pages_) + " pages, which end at byte " + std::to_string(std::uint64_t(end)) + ", but the file has " +
                                   std::to_string(std::uint64_t(file_bytes_)), damaged_hint);
        if (!voxels) return;
        std::ifstream in(file_, std::ios::binary);
        in.seekg(std::streamoff(offsets[0]));
        std::vector<std::byte> image(page_bytes);
        for (int page = 1; page <= announced_pages_; ++page) {
            if (!in.read(reinterpret_cast<char*>(image.data()), std::streamsize(page_bytes)))
                throw Error(where(page), "is missing: the description announces " + std::to_string(announced_pages_) + " pages", damaged_hint);
            sink_.append(image, type, where(page));
        }
    }

    /// Voxel size and page count from ImageJ's description ("images=", "spacing=", "unit="), page count from tifffile's ("shape").
    void read_description()
    {
        char* text = nullptr;
        if (!TIFFGetField(handle_.get(), TIFFTAG_IMAGEDESCRIPTION, &text) || !text) return;
        const std::string description(text);
        if (const auto shape = description.find("\"shape\": ["); shape != std::string::npos) {
            const auto begin = description.find('[', shape) + 1;
            double product = 1;
            for (const std::string& n : split(description.substr(begin, description.find(']', begin) - begin), ',')) product *= std::atof(n.c_str());
            const double pages = product / (double(first_.width) * first_.height);
            announced_pages_ = pages >= 1 && pages < 1e9 ? int(pages) : 0;
        }
        if (!description.starts_with("ImageJ=")) return;
        double spacing = 0, unit = 0;
        for (const std::string& line : split(description, '\n')) {
            if (line.starts_with("images=")) announced_pages_ = std::atoi(line.c_str() + 7);
            else if (line.starts_with("spacing=")) spacing = std::abs(std::atof(line.c_str() + 8));
            else if (line.starts_with("unit=")) unit = metres_per_unit(line.substr(5));
        }
        float per_unit_x = 0, per_unit_y = 0;
        if (unit > 0 && TIFFGetField(handle_.get(), TIFFTAG_XRESOLUTION, &per_unit_x) && per_unit_x > 0) {
            TIFFGetField(handle_.get(), TIFFTAG_YRESOLUTION, &per_unit_y);
            const auto edge = [&](float per_unit) {  // millionths: 30 um is written as 0.033333 per um and reads back as 30.0003
                const double value = 1.0 / double(per_unit), tolerance = (0.6e-6 / double(per_unit) + 2e-7) * value;
                const double scale = std::pow(10.0, 4 - std::floor(std::log10(value)));
                const double rounded = std::round(value * scale) / scale;
                return unit * (std::abs(rounded - value) < tolerance ? rounded : value);
            };
            const double x = edge(per_unit_x), y = per_unit_y > 0 ? edge(per_unit_y) : x;
            stack_.voxel_size = {x, y, spacing > 0 ? spacing * unit : x};
        }
    }

    std::string file_;
    Complaint complaint_;  // before the handle: closing may still complain
    Handle handle_;
    VoxelSink sink_;
    VoxelStack stack_;
    Page first_;
    int announced_pages_ = 0;
    double file_bytes_ = 0;
};

}  // namespace

VoxelStack read_tiff(const std::filesystem::path& file) { return Reader(file).run(); }
StackHeader tiff_header(const std::filesystem::path& file) { return Reader(file).header(); }

}  // namespace coral::morph::detail
