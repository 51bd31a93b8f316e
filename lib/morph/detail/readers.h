#pragma once
/// \file morph/detail/readers.h
/// Readers of single files, behind morph/stack_io.h.
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "morph/stack_io.h"

namespace coral::morph::detail {

enum class NumberKind { unsigned_integer, signed_integer, real };

/// How one number lies in a file.
struct NumberType {
    NumberKind kind = NumberKind::unsigned_integer;
    int bytes = 1;  ///< 1, 2, 4 or 8
    bool swapped = false;  ///< byte order other than this machine's
};

/// Takes raw numbers in and becomes the voxels of a stack: integers, or reals once a fraction was seen.
class VoxelSink {
public:
    explicit VoxelSink(std::string name) : name_(std::move(name)) {}
    /// Room for the voxels, in the width of the file's numbers; two bytes at first for wider ones, which mostly hold small numbers.
    void reserve(std::size_t voxels, int bytes) { values_.reserve(voxels, std::min(bytes, 2)); }
    /// \throws Error on a negative, infinite or NaN number, naming voxel and `where`
    void append(std::span<const std::byte> bytes, const NumberType& type, const std::string& where);
    void append_bits(std::span<const std::byte> row, int width);  ///< packed, most significant bit first
    std::size_t count() const { return real_ ? reals_.size() : values_.size() + pending_.size(); }
    /// Moves the voxels into `stack`. \throws Error when the count is not the stack's
    void finish(VoxelStack& stack);

private:
    static constexpr std::size_t pending_limit = 1 << 16;
    void append_real(double value, const std::string& where);
    void append_integer(std::int64_t value, const std::string& where);
    void flush();
    std::string name_;
    VoxelValues values_;
    std::vector<std::uint32_t> pending_;  ///< integers that wait for flush()
    std::vector<float> reals_;
    bool real_ = false;
};

/// "u8", "i16", "f32" ...
std::string to_string(const NumberType& type);

StackHeader tiff_header(const std::filesystem::path& file);
StackHeader nrrd_header(const std::filesystem::path& file);
StackHeader metaimage_header(const std::filesystem::path& file);
StackHeader raw_header(const std::filesystem::path& file, const RawLayout& layout);
StackHeader hdf5_header(const std::filesystem::path& file, const std::string& dataset);

VoxelStack read_tiff(const std::filesystem::path& file);
VoxelStack read_nrrd(const std::filesystem::path& file);
VoxelStack read_metaimage(const std::filesystem::path& file);
VoxelStack read_raw(const std::filesystem::path& file, const RawLayout& layout);
VoxelStack read_hdf5(const std::filesystem::path& file, const std::string& dataset);

/// Metres per unit named as ImageJ, NRRD or MetaImage do ("um", "micron", "\\u00B5m", "mm" ...); 0 when unknown or "pixel".
double metres_per_unit(std::string unit);

}  // namespace coral::morph::detail
