#include "morph/voxel_values.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>

namespace coral::morph {
namespace {

template <class T>
std::uint32_t largest_of(std::span<const T> values)
{
    T largest = 0;
    for (const T v : values) largest = std::max(largest, v);
    return largest;
}

/// Calls visitor(T{}) with the unsigned integer of so many bytes.
template <class Visitor>
void with_width(int bytes, const Visitor& visitor)
{
    if (bytes == 1) visitor(std::uint8_t{});
    else if (bytes == 2) visitor(std::uint16_t{});
    else visitor(std::uint32_t{});
}

/// Rewrites `count` numbers, the last first: each lands behind those still to be read.
template <class Narrow, class Wide>
void widen_in_place(std::byte* data, std::size_t count)
{
    for (std::size_t n = count; n-- > 0;) {
        Narrow narrow;
        std::memcpy(&narrow, data + n * sizeof(Narrow), sizeof narrow);
        const Wide wide = narrow;
        std::memcpy(data + n * sizeof(Wide), &wide, sizeof wide);
    }
}

}  // namespace

namespace detail {

ByteBlock::ByteBlock(const ByteBlock& other)
{
    resize(other.size_);
    if (size_ > 0) std::memcpy(data_, other.data_, size_);
}

ByteBlock::~ByteBlock() { std::free(data_); }

void ByteBlock::reserve(std::size_t bytes)
{
    if (bytes <= capacity_) return;
    void* moved = std::realloc(data_, bytes);
    if (!moved) throw std::bad_alloc();
    data_ = static_cast<std::byte*>(moved);
    capacity_ = bytes;
}

void ByteBlock::resize(std::size_t bytes)
{
    if (bytes > capacity_) reserve(std::max(bytes, capacity_ + capacity_ / 2));
    size_ = bytes;
}

}  // namespace detail

VoxelValues::VoxelValues(std::size_t count, std::uint32_t value)
{
    widen(value);
    block_.resize(count * std::size_t(bytes_));
    with_width(bytes_, [&]<class T>(T) { std::fill_n(reinterpret_cast<T*>(block_.data()), count, static_cast<T>(value)); });
}

VoxelValues::VoxelValues(const std::vector<std::uint32_t>& values) { append(std::span(values)); }

void VoxelValues::widen(std::uint32_t largest)
{
    const int before = bytes_, after = largest > 65535 ? 4 : largest > 255 ? 2 : 1;
    if (after <= before) return;
    const std::size_t count = size();
    block_.resize(count * std::size_t(after));
    if (after == 2) widen_in_place<std::uint8_t, std::uint16_t>(block_.data(), count);
    else if (before == 1) widen_in_place<std::uint8_t, std::uint32_t>(block_.data(), count);
    else widen_in_place<std::uint16_t, std::uint32_t>(block_.data(), count);
    bytes_ = after;
}

template <class T>
void VoxelValues::append_narrow(std::span<const T> values)
{
    widen(largest_of(values));
    const std::size_t begin = size();
    block_.resize((begin + values.size()) * std::size_t(bytes_));
    with_width(bytes_, [&]<class Mine>(Mine) {
        std::transform(values.begin(), values.end(), reinterpret_cast<Mine*>(block_.data()) + begin, [](T v) { return static_cast<Mine>(v); });
    });
}

void VoxelValues::append(std::span<const std::uint8_t> values) { append_narrow(values); }
void VoxelValues::append(std::span<const std::uint16_t> values) { append_narrow(values); }
void VoxelValues::append(std::span<const std::uint32_t> values) { append_narrow(values); }
void VoxelValues::append(const VoxelValues& values)
{
    values.visit([&](auto theirs) { append_narrow(theirs); });
}

void VoxelValues::set(std::size_t at, std::uint32_t value)
{
    widen(value);
    with_width(bytes_, [&]<class T>(T) { reinterpret_cast<T*>(block_.data())[at] = static_cast<T>(value); });
}

void VoxelValues::read(std::size_t first, std::span<std::uint32_t> out) const
{
    visit([&](auto values) { std::copy_n(values.begin() + std::ptrdiff_t(first), out.size(), out.begin()); });
}

std::uint32_t VoxelValues::largest() const
{
    return visit([](auto values) { return largest_of(values); });
}

bool operator==(const VoxelValues& a, const VoxelValues& b)
{
    return a.visit([&](auto mine) { return b.visit([&](auto theirs) { return std::ranges::equal(mine, theirs); }); });
}

}  // namespace coral::morph
