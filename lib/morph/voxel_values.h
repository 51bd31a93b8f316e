#pragma once
/// \file morph/voxel_values.h
/// Integers of a stack in few bytes: most stacks need one or two a voxel, and a stack may fill half the memory.
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <variant>
#include <vector>

namespace coral::morph {

/// Unsigned integers up to 2^32 - 1 in the narrowest of 1, 2 or 4 bytes that holds all of them so far. A number that does
/// not fit widens the whole (for a moment both widths are in memory); reserve() with the width of the file avoids that.
class VoxelValues {
public:
    VoxelValues() = default;
    VoxelValues(std::size_t count, std::uint32_t value);
    VoxelValues(const std::vector<std::uint32_t>& values);

    /// Room for `count` values of `bytes` bytes (1, 2 or 4) each.
    void reserve(std::size_t count, int bytes);
    void append(std::span<const std::uint8_t> values);
    void append(std::span<const std::uint16_t> values);
    void append(std::span<const std::uint32_t> values);
    void append(const VoxelValues& values);
    void push_back(std::uint32_t value) { append(std::span(&value, 1)); }
    /// From several threads at once only while every value fits the present width.
    void set(std::size_t at, std::uint32_t value);

    std::size_t size() const;
    bool empty() const { return size() == 0; }
    int bytes() const;  ///< of one value
    std::uint32_t operator[](std::size_t at) const
    {
        switch (values_.index()) {
            case 0: return std::get<0>(values_)[at];
            case 1: return std::get<1>(values_)[at];
            default: return std::get<2>(values_)[at];
        }
    }
    /// Copies out.size() values from `first` on.
    void read(std::size_t first, std::span<std::uint32_t> out) const;
    std::uint32_t largest() const;  ///< 0 when empty

    /// Calls visitor(span) with the values in the width they are kept in: for loops over all of them.
    template <class Visitor>
    auto visit(Visitor&& visitor) const
    {
        return std::visit([&](const auto& values) { return visitor(std::span(values)); }, values_);
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
    void widen(std::uint32_t largest);
    template <class T>
    void append_narrow(std::span<const T> values);

    std::variant<std::vector<std::uint8_t>, std::vector<std::uint16_t>, std::vector<std::uint32_t>> values_;
};

}  // namespace coral::morph
