#include "core/record.h"

#include <nlohmann/json.hpp>

#include "core/error.h"

namespace coral {

std::string to_json(const History& history)
{
    auto array = nlohmann::json::array();
    for (const RecordEntry& entry : history) {
        array.push_back({{"tool", entry.tool}, {"version", entry.version}, {"options", entry.options}, {"inputs", entry.inputs}});
    }
    return array.dump();
}

History history_from_json(const std::string& text, const std::string& where)
try {
    History history;
    for (const auto& item : nlohmann::json::parse(text)) {
        history.push_back({item.at("tool"), item.at("version"), item.at("options"), item.at("inputs")});
    }
    return history;
} catch (const nlohmann::json::exception&) {
    throw Error(where, "the history of the file is damaged", "make the file again with the tool that wrote it");
}

void require_known_format(std::int64_t found, std::int64_t known, const std::string& where)
{
    if (found > known)
        throw Error(where, "was written by a newer version of the tools (format " + std::to_string(found) + ", this one reads up to " + std::to_string(known) + ")",
                    "update the tools");
}

}  // namespace coral
