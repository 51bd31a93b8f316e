#pragma once
/// \file morph/voxel_values.h
/// Integers of a stack in few bytes: most stacks need one or two a voxel, and a stack may fill half the memory.
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

namespace coral::morph {

namespace detail {

/// Bytes that grow and shrink in place: realloc moves the pages of a large block, where a vector would hold two copies.
class ByteBlock {
public:
    ByteBlock() = default;
    ByteBlock(const ByteBlock& other);
    ByteBlock(ByteBlock&& other) noexcept { swap(other); }
    ByteBlock& operator=(ByteBlock other) noexcept
    {
        swap(other);
        return *this;
    }
    ~ByteBlock();
    std::size_t size() const { return size_; }
    const std::byte* data() const { return data_; }
    std::byte* data() { return data_; }
    void reserve(std::size_t bytes);
    void resize(std::size_t bytes);  ///< new bytes are not set

private:
    void swap(ByteBlock& other) noexcept
    {
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
        std::swap(capacity_, other.capacity_);
    }
    std::byte* data_ = nullptr;
    std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace detail

/// Unsigned integers up to 2^32 - 1 in the narrowest of 1, 2 or 4 bytes that holds all of them so far. A number that does not fit
/// widens the whole in place; there is never a second copy.
class VoxelValues {
public:
    VoxelValues() = default;
    VoxelValues(std::size_t count, std::uint32_t value);
    VoxelValues(const std::vector<std::uint32_t>& values);

    /// Room for `count` values of `bytes` bytes (1, 2 or 4) each; memory is taken as they come.
    void reserve(std::size_t count, int bytes) { block_.reserve(count * std::size_t(bytes)); }
    void append(std::span<const std::uint8_t> values);
    void append(std::span<const std::uint16_t> values);
    void append(std::span<const std::uint32_t> values);
    void append(const VoxelValues& values);
    void push_back(std::uint32_t value) { append(std::span(&value, 1)); }
    /// From several threads at once only while every value fits the present width.
    void set(std::size_t at, std::uint32_t value);

    std::size_t size() const { return block_.size() / std::size_t(bytes_); }
    bool empty() const { return size() == 0; }
    int bytes() const { return bytes_; }  ///< of one value
    std::uint32_t operator[](std::size_t at) const
    {
        switch (bytes_) {
            case 1: return as<std::uint8_t>()[at];
            case 2: return as<std::uint16_t>()[at];
            default: return as<std::uint32_t>()[at];
        }
    }
    /// Copies out.size() values from `first` on.
    void read(std::size_t first, std::span<std::uint32_t> out) const;
    std::uint32_t largest() const;  ///< 0 when empty

    /// Calls visitor(span) with the values in the width they are kept in: for loops over all of them.
    template <class Visitor>
    auto visit(Visitor&& visitor) const
    {
        switch (bytes_) {
            case 1: return visitor(as<std::uint8_t>());
            case 2: return visitor(as<std::uint16_t>());
            default: return visitor(as<std::uint32_t>());
        }
    }

    /// Reads one value after the other.
    class Iterator {
    public:
        using iterator_category = std::input_iterator_tag;
        using value_type = std::uint32_t;
        using difference_type = std::ptrdiff_t;
        using pointer = const std::uint32_t*;
        using reference = std::uint32_t;
        Iterator(const VoxelValues* values, std::size_t at) : values_(values), at_(at) {}
        std::uint32_t operator*() const { return (*values_)[at_]; }
        Iterator& operator++()
        {
            ++at_;
            return *this;
        }
        Iterator operator++(int)
        {
            Iterator before = *this;
            ++at_;
            return before;
        }
        bool operator==(const Iterator& other) const { return at_ == other.at_; }

    private:
        const VoxelValues* values_;
        std::size_t at_;
    };
    Iterator begin() const { return {this, 0}; }
    Iterator end() const { return {this, size()}; }

    /// Equal numbers, whatever their widths.
    friend bool operator==(const VoxelValues& a, const VoxelValues& b);

private:
    template <class T>
    std::span<const T> as() const
    {
        return {reinterpret_cast<const T*>(block_.data()), block_.size() / sizeof(T)};
    }
    void widen(std::uint32_t largest);
    template <class T>
    void append_narrow(std::span<const T> values);

    detail::ByteBlock block_;
    int bytes_ = 1;
};

}  // namespace coral::morph
