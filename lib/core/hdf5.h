#pragma once
/// \file core/hdf5.h
/// HDF5 files without the HDF5 headers: datasets and attributes of numbers and strings.
/// Files are written under a temporary name and renamed by commit(); bytes are the same for the same content (no time stamps).
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace coral {

class H5File {
public:
    /// New file; appears under its name at commit(). \throws Error when it cannot be written
    static H5File create(const std::filesystem::path& file);
    /// \throws Error when missing or not HDF5
    static H5File open(const std::filesystem::path& file);
    H5File(H5File&&) noexcept;
    H5File& operator=(H5File&&) noexcept;
    ~H5File();

    /// Closes, flushes to disk and renames. Only after create().
    void commit();
    const std::filesystem::path& path() const;

    bool exists(const std::string& path) const;
    /// Names of the members of a group, in numeric order when they are numbers, else by name. Empty when the group is absent.
    std::vector<std::string> members(const std::string& group) const;
    void make_group(const std::string& path);

    /// Whether large arrays written from now on are deflated (the default), or only checksummed: quicker, for what is soon overwritten.
    void set_deflate(bool deflate);
    /// Row-major data of the given dimensions; groups on the way are made. Large arrays are chunked, shuffled and deflated.
    void write(const std::string& path, std::span<const double> data, std::vector<std::size_t> dims);
    void write(const std::string& path, std::span<const float> data, std::vector<std::size_t> dims);
    void write(const std::string& path, std::span<const std::int64_t> data, std::vector<std::size_t> dims);
    void write(const std::string& path, std::span<const std::int32_t> data, std::vector<std::size_t> dims);
    void write(const std::string& path, std::span<const std::uint8_t> data, std::vector<std::size_t> dims);
    /// Fixed-length UTF-8 strings.
    void write(const std::string& path, std::span<const std::string> data);

    /// \throws Error when absent, or when the file stores far less than they ask for
    std::vector<std::size_t> dims(const std::string& path) const;
    /// Numbers as they are stored: "u16", "i32", "f64" ... \throws Error when absent or of another kind
    std::string number_type(const std::string& path) const;
    /// Whole dataset, converted to the type asked for. \throws Error when absent or of another kind
    std::vector<double> read_doubles(const std::string& path) const;
    /// `count` entries of the first axis from `first` on, with all of the other axes.
    std::vector<double> read_doubles(const std::string& path, std::size_t first, std::size_t count) const;
    std::vector<float> read_floats(const std::string& path) const;
    std::vector<std::int64_t> read_integers(const std::string& path) const;
    std::vector<std::uint8_t> read_bytes(const std::string& path) const;
    std::vector<std::string> read_strings(const std::string& path) const;

    /// Attributes of a group or dataset ("/" for the file).
    void set_attribute(const std::string& path, const std::string& name, const std::string& value);
    void set_attribute(const std::string& path, const std::string& name, const char* value);
    void set_attribute(const std::string& path, const std::string& name, double value);
    void set_attribute(const std::string& path, const std::string& name, std::int64_t value);
    void set_attribute(const std::string& path, const std::string& name, std::span<const double> values);
    bool has_attribute(const std::string& path, const std::string& name) const;
    std::string string_attribute(const std::string& path, const std::string& name) const;
    double number_attribute(const std::string& path, const std::string& name) const;
    std::int64_t integer_attribute(const std::string& path, const std::string& name) const;
    std::vector<double> numbers_attribute(const std::string& path, const std::string& name) const;

    /// Number of the layout of a file of ours, attribute `format` of the root. It grows when a reader of before would go wrong.
    void set_format(std::int64_t number);
    /// \throws Error when the file's number is above `known`; a file without number (or with a text there) is format 1
    void require_format(std::int64_t known) const;

private:
    struct Impl;
    explicit H5File(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace coral
