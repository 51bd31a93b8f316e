#pragma once
/// \file tools/run_program.h
/// Runs a built program as a user would and keeps what it said.
#include <filesystem>
#include <string>

namespace coral::test {

struct ProgramResult {
    int exit_code;
    std::string out, err;
};

/// \param command  tool name and options, such as "csct2ls --help"; the tool is taken from the build's bin folder
/// \param folder   working folder of the run
ProgramResult run_program(const std::string& command, const std::filesystem::path& folder = ".");

/// Writes a small text file for a test.
void write_text(const std::filesystem::path& file, const std::string& text);

/// Empty folder for one test, removed when the object goes.
class ScratchFolder {
public:
    ScratchFolder();
    ~ScratchFolder();
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

}  // namespace coral::test
