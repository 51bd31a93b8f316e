#include "grain-info/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli.h"

namespace coral::grain_info {
namespace {

constexpr std::size_t lines_shown = 12;  // of a list in the human form; --json has all

}  // namespace

std::string metres(double value) { return format_quantity(value, Dimension::length); }
std::string percent(double value) { return fmt::format("{:.2f} %", 100 * value); }
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Report::Report(const std::string& kind) : text_("  " + kind + "\n") { json_["kind"] = kind; }

void Report::add(const std::string& key, Json value, const std::string& human)
{
    json_[key] = std::move(value);
    text_ += fmt::format("  {:<24} {}\n", key, human);
}

void Report::lengths(const std::string& key, std::vector<double> values)
{
    if (values.empty()) return;
    std::ranges::sort(values);
    const double low = values.front(), middle = 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]), high = values.back();
    add(key, {low, middle, high}, fmt::format("{} to {}, median {}", metres(low), metres(high), metres(middle)));
}

void Report::list(const std::string& key, const Json& values, const std::vector<std::string>& lines)
{
    json_[key] = values;
    text_ += fmt::format("  {} ({})\n", key, lines.size());
    for (std::size_t n = 0; n < std::min(lines.size(), lines_shown); ++n) text_ += "    " + lines[n] + "\n";
    if (lines.size() > lines_shown) text_ += fmt::format("    and {} more (--json lists all)\n", lines.size() - lines_shown);
}

void Report::history(const History& history)
{
    std::vector<std::string> lines;
    for (const RecordEntry& step : history) {
        std::string options, inputs;
        for (const auto& [name, value] : step.options) options += fmt::format(" {}={}", name, value);
        for (std::size_t n = 0; n < std::min<std::size_t>(step.inputs.size(), 4); ++n) inputs += " " + step.inputs[n];
        if (step.inputs.size() > 4) inputs += fmt::format(" and {} more", step.inputs.size() - 4);
        lines.push_back(fmt::format("{} {}{}{}", step.tool, step.version, inputs, options));
    }
    list("history", Json::parse(to_json(history)), lines);
}

}  // namespace coral::grain_info
