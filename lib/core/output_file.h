#pragma once
/// \file core/output_file.h
/// Outputs appear whole or not at all: they are written under a temporary name beside the target, then renamed.
#include <filesystem>
#include <optional>
#include <string_view>

namespace coral {

class OutputFile {
public:
    /// \throws Error when the folder of `target` is missing or not writable
    explicit OutputFile(std::filesystem::path target);
    /// Removes the temporary unless commit() was called.
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// Path to write to until commit().
    const std::filesystem::path& temporary() const { return temporary_; }
    /// Path it will have.
    const std::filesystem::path& target() const { return target_; }
    /// Flushes to disk and renames. \throws Error when the rename fails
    void commit();

private:
    std::filesystem::path target_, temporary_;
    bool committed_ = false;
};

/// Text that appears together with other files of a tool: written first, in place at commit(). An empty target stands for none.
class TextFile {
public:
    /// \throws Error as OutputFile
    explicit TextFile(const std::filesystem::path& target);
    bool wanted() const { return file_.has_value(); }
    /// \throws Error on a full disk
    void write(std::string_view text) const;
    void commit();

private:
    std::filesystem::path target_;
    std::optional<OutputFile> file_;
};

/// Writes a whole text file that way. \throws Error on a full disk or a missing folder
void write_text_file(const std::filesystem::path& target, std::string_view text);
/// Whole content. \throws Error when missing or unreadable
std::string read_text_file(const std::filesystem::path& file);

}  // namespace coral
