#pragma once
/// \file core/record.h
/// History that every file carries: one entry per step of the chain (tool, version, options, seed, inputs).
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace coral {

/// One step. No time stamps and no absolute paths: the same run must give the same bytes everywhere.
struct RecordEntry {
    std::string tool;
    std::string version;
    std::map<std::string, std::string> options;
    std::vector<std::string> inputs;  ///< file names without folders
};

/// Steps in the order they were taken; the last is the tool that writes the file.
using History = std::vector<RecordEntry>;

/// JSON array, one object per step.
std::string to_json(const History& history);
/// \throws Error when the text is not a history
History history_from_json(const std::string& text, const std::string& where);

/// \throws Error when the layout of a file has a higher number than this program knows: a newer version wrote it
void require_known_format(std::int64_t found, std::int64_t known, const std::string& where);

}  // namespace coral
