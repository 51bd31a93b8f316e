#pragma once
/// \file suffusion/bytes.h
/// Exact state as bytes: numbers and arrays one after another, each array with its length.
#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "core/error.h"

namespace coral::suffusion {

class ByteWriter {
public:
    void number(double value) { append(&value, sizeof value); }
    void integer(std::int64_t value) { append(&value, sizeof value); }
    template <class T>
    void array(std::span<const T> values)
    {
        integer(static_cast<std::int64_t>(values.size()));
        append(values.data(), values.size_bytes());
    }
    template <class T, class Range>
    void array(const Range& values)
    {
        array<T>(std::span<const T>(values.data(), values.size()));
    }
    void vectors(const std::vector<Eigen::Vector3d>& values)
    {
        array<double>(std::span<const double>(values.empty() ? nullptr : values.front().data(), 3 * values.size()));
    }
    const std::vector<std::uint8_t>& bytes() const { return bytes_; }
    /// The bytes, of which none are left here.
    std::vector<std::uint8_t> take() { return std::move(bytes_); }
    void reserve(std::size_t size) { bytes_.reserve(size); }

private:
    void append(const void* data, std::size_t size)
    {
        if (size == 0) return;
        const auto* from = static_cast<const std::uint8_t*>(data);
        bytes_.insert(bytes_.end(), from, from + size);
    }
    std::vector<std::uint8_t> bytes_;
};

/// \throws Error when the bytes end too early
class ByteReader {
public:
    explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
    double number()
    {
        double value;
        take(&value, sizeof value);
        return value;
    }
    std::int64_t integer()
    {
        std::int64_t value;
        take(&value, sizeof value);
        return value;
    }
    template <class T>
    std::vector<T> array()
    {
        const std::int64_t count = integer();
        if (count < 0 || static_cast<std::uint64_t>(count) > bytes_.size() / sizeof(T)) throw Error("checkpoint.h5", "is damaged, or another version of the tools wrote it", "run without --resume, or resume with that version");
        std::vector<T> values(static_cast<std::size_t>(count));
        take(values.data(), values.size() * sizeof(T));
        return values;
    }
    std::vector<Eigen::Vector3d> vectors()
    {
        const std::vector<double> values = array<double>();
        std::vector<Eigen::Vector3d> result(values.size() / 3);
        for (std::size_t i = 0; i < result.size(); ++i) result[i] = Eigen::Vector3d(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
        return result;
    }

private:
    void take(void* data, std::size_t size)
    {
        if (size > bytes_.size()) throw Error("checkpoint.h5", "is damaged, or another version of the tools wrote it", "run without --resume, or resume with that version");
        if (size) std::memcpy(data, bytes_.data(), size);
        bytes_ = bytes_.subspan(size);
    }
    std::span<const std::uint8_t> bytes_;
};

}  // namespace coral::suffusion
