#include <cmath>
#include <cstring>

#include "core/error.h"
#include "morph/detail/readers.h"

namespace coral::morph::detail {
namespace {

template <class T>
T load(const std::byte* p, bool swapped)
{
    std::byte raw[sizeof(T)];
    std::memcpy(raw, p, sizeof(T));
    if (swapped)
        for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
}

template <class T>
void append_unsigned(VoxelValues& out, std::span<const std::byte> bytes, bool swapped)
{
    constexpr std::size_t piece = 1 << 16;
    std::vector<T> values;
    for (std::size_t done = 0; done < bytes.size() / sizeof(T); done += values.size()) {
        values.resize(std::min(piece, bytes.size() / sizeof(T) - done));
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = load<T>(bytes.data() + (done + i) * sizeof(T), swapped);
        out.append(std::span<const T>(values));
    }
}

std::int64_t load_integer(const std::byte* p, const NumberType& type)
{
    const bool is_signed = type.kind == NumberKind::signed_integer;
    switch (type.bytes) {
        case 1: return is_signed ? std::int64_t(load<std::int8_t>(p, false)) : load<std::uint8_t>(p, false);
        case 2: return is_signed ? std::int64_t(load<std::int16_t>(p, type.swapped)) : load<std::uint16_t>(p, type.swapped);
        case 4: return is_signed ? std::int64_t(load<std::int32_t>(p, type.swapped)) : load<std::uint32_t>(p, type.swapped);
        default: return load<std::int64_t>(p, type.swapped);
    }
}

}  // namespace

void VoxelSink::append_real(double value, const std::string& where)
{
    if (!std::isfinite(value)) throw Error(where, "voxel " + std::to_string(count()) + " is not a number", "repair the stack before use");
    const bool integral = value >= 0 && value <= 4294967295.0 && value == std::floor(value);
    if (!real_ && !integral) {
        flush();
        real_ = true;
        reals_.assign(values_.begin(), values_.end());
        values_ = {};
    }
    if (real_) reals_.push_back(float(value));
    else pending_.push_back(std::uint32_t(value));
}

void VoxelSink::append(std::span<const std::byte> bytes, const NumberType& type, const std::string& where)
{
    const std::size_t size = std::size_t(type.bytes);
    if (type.kind == NumberKind::unsigned_integer && !real_ && type.bytes < 8) {
        if (type.bytes == 1) append_unsigned<std::uint8_t>(values_, bytes, false);
        else if (type.bytes == 2) append_unsigned<std::uint16_t>(values_, bytes, type.swapped);
        else append_unsigned<std::uint32_t>(values_, bytes, type.swapped);
        return;
    }
    for (const std::byte* p = bytes.data(); p + size <= bytes.data() + bytes.size(); p += size) {
        if (pending_.size() == pending_limit) flush();
        if (type.kind == NumberKind::real) append_real(type.bytes == 4 ? double(load<float>(p, type.swapped)) : load<double>(p, type.swapped), where);
        else append_integer(load_integer(p, type), where);
    }
    flush();
}

void VoxelSink::append_integer(std::int64_t value, const std::string& where)
{
    if (value < 0 || value > 4294967295LL)
        throw Error(where, "voxel " + std::to_string(count()) + " is " + std::to_string(value) + ", outside 0..4294967295",
                    "shift the grey values, or save labels as unsigned integers");
    if (real_) reals_.push_back(float(value));
    else pending_.push_back(std::uint32_t(value));
}

void VoxelSink::append_bits(std::span<const std::byte> row, int width)
{
    for (int i = 0; i < width; ++i) pending_.push_back(std::uint32_t(row[std::size_t(i / 8)] >> (7 - i % 8)) & 1U);
    flush();
}

void VoxelSink::flush()
{
    values_.append(std::span<const std::uint32_t>(pending_));
    pending_.clear();
}

void VoxelSink::finish(VoxelStack& stack)
{
    if (count() != stack.count())
        throw Error(name_, "holds " + std::to_string(count()) + " voxels where " + std::to_string(stack.count()) + " are announced",
                    "the file is truncated; copy it again");
    stack.name = name_;
    stack.values = std::move(values_);
    stack.reals = std::move(reals_);
}

std::string to_string(const NumberType& type)
{
    const char* kind = type.kind == NumberKind::real ? "f" : type.kind == NumberKind::signed_integer ? "i" : "u";
    return kind + std::to_string(type.bytes == 0 ? 1 : 8 * type.bytes);
}

double metres_per_unit(std::string unit)
{
    while (!unit.empty() && (unit.back() == ' ' || unit.back() == '\r' || unit.back() == '"')) unit.pop_back();
    while (!unit.empty() && (unit.front() == ' ' || unit.front() == '"')) unit.erase(0, 1);
    if (unit == "um" || unit == "micron" || unit == "microns" || unit == "\\u00B5m" || unit == "\xC2\xB5m" || unit == "\xCE\xBCm" ||
        unit == "\xB5m" || unit == "micrometer" || unit == "micrometre")
        return 1e-6;
    if (unit == "nm") return 1e-9;
    if (unit == "mm") return 1e-3;
    if (unit == "cm") return 1e-2;
    if (unit == "m") return 1.0;
    if (unit == "inch" || unit == "in") return 0.0254;
    return 0.0;
}

}  // namespace coral::morph::detail
