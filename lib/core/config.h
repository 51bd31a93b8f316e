#pragma once
/// \file core/config.h
/// TOML configuration read key by key. Every key asked for becomes a known key; finish() reports all errors at once, each as
/// "file:line:column: key ...", unknown keys with the nearest known one.
#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/units.h"

namespace coral {

/// One table of a configuration. Copies are cheap and refer to the same document.
/// A value of the wrong kind is recorded as an error and the default (or zero) is returned, so that reading goes on.
class ConfigTable {
public:
    bool has(std::string_view key) const;
    /// Number in SI or string with unit. Without a default the key is required.
    double quantity(std::string_view key, Dimension dimension, std::optional<double> fallback = {}) const;
    std::int64_t integer(std::string_view key, std::optional<std::int64_t> fallback = {}) const;
    bool boolean(std::string_view key, std::optional<bool> fallback = {}) const;
    std::string string(std::string_view key, std::optional<std::string> fallback = {}) const;
    /// A string out of a fixed set; another value is an error that lists the set.
    std::string choice(std::string_view key, std::span<const std::string> allowed, std::optional<std::string> fallback = {}) const;
    Eigen::Vector3d vector(std::string_view key, Dimension dimension, std::optional<Eigen::Vector3d> fallback = {}) const;
    /// Array of [x, y, z].
    std::vector<Eigen::Vector3d> vectors(std::string_view key, Dimension dimension) const;
    std::vector<double> quantities(std::string_view key, Dimension dimension, std::optional<std::vector<double>> fallback = {}) const;
    std::vector<std::string> strings(std::string_view key, std::optional<std::vector<std::string>> fallback = {}) const;
    std::vector<std::int64_t> integers(std::string_view key, std::optional<std::vector<std::int64_t>> fallback = {}) const;
    bool is_string(std::string_view key) const;
    bool is_array(std::string_view key) const;

    /// Sub-table; an empty one when absent (ask has() to tell).
    ConfigTable table(std::string_view key) const;
    /// Array of tables ([[key]]); empty when absent.
    std::vector<ConfigTable> tables(std::string_view key) const;
    /// Keys present in the file, in file order (for tables with free names, such as [material.<name>]). Marks them known.
    std::vector<std::string> keys() const;

    /// Records an error at a key of this table (or at the table when the key is absent).
    void error(std::string_view key, std::string_view what, std::string_view how_to_fix = {}) const;
    /// "file:line:column" of a key, for errors found later.
    std::string location(std::string_view key) const;

private:
    friend class Config;
    struct Node;
    std::shared_ptr<Node> node_;
};

class Config {
public:
    /// \throws UsageError when the file is missing or not TOML (with line and column)
    static Config from_file(const std::filesystem::path& file);
    static Config from_text(const std::string& text, const std::string& name);
    const ConfigTable& root() const { return root_; }
    /// \throws UsageError with all recorded errors and unknown keys, sorted by line, one a line
    void finish() const;

private:
    struct Document;
    std::shared_ptr<Document> document_;
    ConfigTable root_;
    friend class ConfigTable;
};

}  // namespace coral
