#pragma once
/// \file core/table.h
/// CSV tables: one header line, SI units, numbers that round-trip.
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

namespace coral {

using Cell = std::variant<double, long long, std::string>;

/// Rows of cells under named columns.
struct Table {
    std::vector<std::string> columns;
    std::vector<std::vector<Cell>> rows;

    /// \pre cells.size() == columns.size()
    void add(std::vector<Cell> cells);
    std::string to_csv() const;
    /// Written whole or not at all.
    void write(const std::filesystem::path& file) const;
};

/// Reads a CSV with one header line; cells that are numbers become double.
/// \throws Error naming file and line when a row has another number of cells than the header
Table read_table(const std::filesystem::path& file);

}  // namespace coral
