#include "core/table.h"

#include <cassert>
#include <charconv>

#include "core/error.h"
#include "core/output_file.h"
#include "core/text.h"

namespace coral {
namespace {

std::string quoted_if_needed(const std::string& text)
{
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (char c : text) {
        if (c == '"') quoted += '"';
        quoted += c;
    }
    return quoted + "\"";
}

std::string cell_text(const Cell& cell)
{
    if (const auto* number = std::get_if<double>(&cell)) return to_text(*number);
    if (const auto* integer = std::get_if<long long>(&cell)) return std::to_string(*integer);
    return quoted_if_needed(std::get<std::string>(cell));
}

std::vector<std::string> split_csv_line(std::string_view line)
{
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
            cells.back() += '"';
            ++i;
        } else if (c == '"') {
            quoted = !quoted;
        } else if (c == ',' && !quoted) {
            cells.emplace_back();
        } else if (c != '\r') {
            cells.back() += c;
        }
    }
    return cells;
}

Cell parsed_cell(const std::string& text)
{
    double value = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure == std::errc{} && end == text.data() + text.size()) return value;
    return text;
}

}  // namespace

void Table::add(std::vector<Cell> cells)
{
    assert(cells.size() == columns.size());
    rows.push_back(std::move(cells));
}

std::string Table::to_csv() const
{
    std::string csv;
    for (std::size_t i = 0; i < columns.size(); ++i) csv.append(i ? "," : "").append(columns[i]);
    csv += '\n';
    for (const auto& row : rows) {
        for (std::size_t i = 0; i < row.size(); ++i) csv.append(i ? "," : "").append(cell_text(row[i]));
        csv += '\n';
    }
    return csv;
}

void Table::write(const std::filesystem::path& file) const { write_text_file(file, to_csv()); }

Table read_table(const std::filesystem::path& file)
{
    const std::string text = read_text_file(file);
    Table table;
    std::size_t number = 0;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        const std::string_view line(text.data() + begin, end - begin);
        begin = end + 1;
        ++number;
        if (line.empty()) continue;
        std::vector<std::string> cells = split_csv_line(line);
        if (table.columns.empty()) {
            table.columns = std::move(cells);
            continue;
        }
        if (cells.size() != table.columns.size())
            throw Error(file.string() + ":" + std::to_string(number), "has " + std::to_string(cells.size()) + " cells, the header has " +
                                                                         std::to_string(table.columns.size()));
        std::vector<Cell> row;
        for (const std::string& cell : cells) row.push_back(parsed_cell(cell));
        table.rows.push_back(std::move(row));
    }
    if (table.columns.empty()) throw Error(file.string(), "the table is empty", "expected a header line");
    return table;
}

}  // namespace coral
