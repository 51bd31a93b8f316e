#pragma once
/// \file grain-info/report.h
/// What is told of a file: each fact for people and for programs.
#include <nlohmann/json.hpp>

#include <string>
#include <vector>

#include "core/record.h"

namespace coral::grain_info {

using Json = nlohmann::ordered_json;

std::string metres(double value);
std::string percent(double value);
/// A number that JSON can hold: null for NaN.
Json number(double value);

class Report {
public:
    explicit Report(const std::string& kind);
    void add(const std::string& key, Json value, const std::string& human);
    void add(const std::string& key, const std::string& value) { add(key, value, value); }
    void add(const std::string& key, std::size_t value) { add(key, value, std::to_string(value)); }
    void length(const std::string& key, double value) { add(key, value, metres(value)); }
    void share(const std::string& key, double value) { add(key, value, percent(value)); }
    /// Smallest, median and largest of lengths.
    void lengths(const std::string& key, std::vector<double> values);
    /// One line an entry for people, the whole list for programs.
    void list(const std::string& key, const Json& values, const std::vector<std::string>& lines);
    void history(const History& history);
    const Json& json() const { return json_; }
    const std::string& text() const { return text_; }

private:
    Json json_;
    std::string text_;
};

}  // namespace coral::grain_info
