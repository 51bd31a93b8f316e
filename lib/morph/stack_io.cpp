#include "morph/stack_io.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "core/error.h"
#include "morph/detail/readers.h"

namespace coral::morph {
namespace {

namespace fs = std::filesystem;

std::string extension(const fs::path& file)
{
    std::string text = file.extension().string();
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

bool is_tiff(const fs::path& file) { return extension(file) == ".tif" || extension(file) == ".tiff"; }

/// Last run of digits of a name without extension; -1 when there is none.
long long slice_number(const fs::path& file)
{
    const std::string stem = file.stem().string();
    std::size_t end = stem.size();
    while (end > 0 && !std::isdigit(static_cast<unsigned char>(stem[end - 1]))) --end;
    std::size_t begin = end;
    while (begin > 0 && std::isdigit(static_cast<unsigned char>(stem[begin - 1]))) --begin;
    return begin == end || end - begin > 18 ? -1 : std::stoll(stem.substr(begin, end - begin));
}

/// \throws Error naming the first missing or doubled slice number
void require_consecutive(const std::vector<fs::path>& slices, const std::string& where)
{
    for (std::size_t i = 1; i < slices.size(); ++i) {
        const long long before = slice_number(slices[i - 1]), here = slice_number(slices[i]);
        if (before < 0 || here < 0) throw Error(where, "slice " + slices[before < 0 ? i - 1 : i].filename().string() + " has no number in its name",
                                                "number the slices in their order, as in slice_0001.tif");
        if (here == before + 1) continue;
        const std::string between = slices[i - 1].filename().string() + " and " + slices[i].filename().string();
        if (here <= before) throw Error(where, "slices " + between + " have the same number", "keep one stack per folder");
        throw Error(where, "slice " + std::to_string(before + 1) + (here > before + 2 ? " to " + std::to_string(here - 1) : "") + " is missing between " + between,
                    "copy the missing slice");
    }
}

/// Slices in natural order. \throws Error when one is missing, doubled or no TIFF
void put_in_order(std::vector<fs::path>& slices, const std::string& where)
{
    for (const fs::path& file : slices)
        if (!is_tiff(file)) throw Error(file.string(), "is no .tif or .tiff, and of several files each must be one slice", "give the slices as TIFF, or one stack at a time");
    std::sort(slices.begin(), slices.end(), [](const fs::path& a, const fs::path& b) { return natural_less(a.filename().string(), b.filename().string()); });
    require_consecutive(slices, where);
}

/// Counts a slice as the next plane of a stack; the first gives it its size. \throws Error when it does not fit
template <class Stack>
void count_slice(Stack& stack, const Stack& slice, const fs::path& file, const std::string& where)
{
    if (slice.size.z() != 1) throw Error(file.string(), "holds " + std::to_string(slice.size.z()) + " pages, but a slice has one", "give stacks one at a time");
    if (stack.size.z() == 0) {
        stack.size = slice.size;
        stack.size.z() = 0;
        stack.voxel_size = slice.voxel_size;
        stack.name = fs::path(where).filename().string();
    }
    if (slice.size.x() != stack.size.x() || slice.size.y() != stack.size.y())
        throw Error(file.string(), "is " + std::to_string(slice.size.x()) + " x " + std::to_string(slice.size.y()) + " where the slices before are " +
                                       std::to_string(stack.size.x()) + " x " + std::to_string(stack.size.y()), "all slices must have one size");
    ++stack.size.z();
}

StackHeader slices_header(std::vector<fs::path> slices, const std::string& where)
{
    put_in_order(slices, where);
    StackHeader stack;
    for (const fs::path& file : slices) {
        const StackHeader slice = detail::tiff_header(file);
        count_slice(stack, slice, file, where);
        stack.type = slice.type;
    }
    return stack;
}

VoxelStack read_slices(std::vector<fs::path> slices, const std::string& where)
{
    put_in_order(slices, where);
    VoxelStack stack;
    for (const fs::path& file : slices) {
        const VoxelStack slice = detail::read_tiff(file);
        count_slice(stack, slice, file, where);
        if (!slice.reals.empty() || !stack.reals.empty()) {  // the first slice with fractions turns the stack into reals
            if (stack.reals.empty()) stack.reals.assign(stack.values.begin(), stack.values.end());
            stack.values = {};
            if (slice.reals.empty()) stack.reals.insert(stack.reals.end(), slice.values.begin(), slice.values.end());
            else stack.reals.insert(stack.reals.end(), slice.reals.begin(), slice.reals.end());
        } else {
            stack.values.append(slice.values);
        }
    }
    return stack;
}

/// Kinds of the files in a folder, for a message: " but 3 .png, 1 .txt".
std::string contents_of(const fs::path& folder)
{
    std::map<std::string, int> kinds;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.is_regular_file()) ++kinds[entry.path().has_extension() ? extension(entry.path()) : "without ending"];
    std::string text;
    for (const auto& [kind, count] : kinds) text += (text.empty() ? " but " : ", ") + std::to_string(count) + " " + kind;
    return text.size() > 120 ? text.substr(0, 120) + " ..." : text;
}

std::vector<fs::path> slices_of(const fs::path& folder)
{
    std::vector<fs::path> slices;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.is_regular_file() && is_tiff(entry.path()) && entry.path().filename().string().front() != '.') slices.push_back(entry.path());
    if (slices.empty()) throw Error(folder.string(), "holds no .tif or .tiff slices" + contents_of(folder), "export the slices as TIFF, or give the file of the stack itself");
    return slices;
}

/// Readers of every kind of stack, for its voxels or for its header alone.
template <class Stack>
struct Readers {
    Stack (*tiff)(const fs::path&);
    Stack (*nrrd)(const fs::path&);
    Stack (*metaimage)(const fs::path&);
    Stack (*raw)(const fs::path&, const RawLayout&);
    Stack (*hdf5)(const fs::path&, const std::string&);
    Stack (*slices)(std::vector<fs::path>, const std::string&);
};
constexpr Readers<VoxelStack> voxel_readers{detail::read_tiff, detail::read_nrrd, detail::read_metaimage, detail::read_raw, detail::read_hdf5, read_slices};
constexpr Readers<StackHeader> header_readers{detail::tiff_header, detail::nrrd_header, detail::metaimage_header, detail::raw_header, detail::hdf5_header, slices_header};

template <class Stack>
Stack read_file(const Readers<Stack>& read, const fs::path& file, const std::optional<RawLayout>& layout)
{
    const std::string kind = extension(file);
    if (is_tiff(file)) return read.tiff(file);
    if (kind == ".nrrd" || kind == ".nhdr") return read.nrrd(file);
    if (kind == ".mhd" || kind == ".mha") return read.metaimage(file);
    if (kind == ".raw") {
        if (!layout) throw UsageError(file.string(), "a .raw file does not say its size", "add --shape nx,ny,nz --type u8");
        return read.raw(file, *layout);
    }
    if (kind == ".h5" || kind == ".hdf5") throw UsageError(file.string(), "is HDF5, without a dataset", "write " + file.string() + ":/dataset");
    throw UsageError(file.string(), "unknown kind of stack '" + kind + "'", "give .tif, .nrrd, .mhd, .mha, .raw, file.h5:/dataset or a folder of .tif slices");
}

template <class Stack>
Stack read_any(const Readers<Stack>& read, std::span<const std::string> paths, const std::optional<RawLayout>& layout)
{
    if (paths.empty()) throw UsageError("STACK", "no input is given", "name a stack, a folder of slices or several slices");
    if (paths.size() == 1) {
        const auto at = paths[0].rfind(":/");
        if (at != std::string::npos && !fs::exists(paths[0])) {
            const fs::path file = paths[0].substr(0, at);
            if (!fs::exists(file)) throw UsageError(file.string(), "no such file", "check the path");
            return read.hdf5(file, paths[0].substr(at + 1));
        }
    }
    for (const std::string& path : paths)
        if (!fs::exists(path)) throw UsageError(path, "no such file or folder", "check the path");
    if (paths.size() > 1) return read.slices({paths.begin(), paths.end()}, fs::path(paths[0]).parent_path().string().empty() ? "slices" : fs::path(paths[0]).parent_path().string());
    if (fs::is_directory(paths[0])) return read.slices(slices_of(paths[0]), paths[0]);
    return read_file(read, paths[0], layout);
}

}  // namespace

bool natural_less(const std::string& a, const std::string& b)
{
    std::size_t i = 0, j = 0;
    const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
    while (i < a.size() && j < b.size()) {
        if (!digit(a[i]) || !digit(b[j])) {
            if (a[i] != b[j]) return a[i] < b[j];
            ++i, ++j;
            continue;
        }
        const auto number = [&](const std::string& s, std::size_t& at) {
            while (at < s.size() && s[at] == '0') ++at;
            const std::size_t begin = at;
            while (at < s.size() && digit(s[at])) ++at;
            return s.substr(begin, at - begin);
        };
        const std::string m = number(a, i), n = number(b, j);
        if (m.size() != n.size()) return m.size() < n.size();
        if (m != n) return m < n;
    }
    return a.size() - i < b.size() - j;
}

VoxelStack read_stack(std::span<const std::string> paths, const std::optional<RawLayout>& layout) { return read_any(voxel_readers, paths, layout); }
StackHeader read_stack_header(std::span<const std::string> paths, const std::optional<RawLayout>& layout) { return read_any(header_readers, paths, layout); }

}  // namespace coral::morph
