#include "tools/run_program.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace coral::test {
namespace fs = std::filesystem;
namespace {

std::string content(const fs::path& file)
{
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return std::move(text).str();
}

}  // namespace

ProgramResult run_program(const std::string& command, const fs::path& folder)
{
    const ScratchFolder capture;
    const fs::path out = capture.path() / "out", err = capture.path() / "err";
    const std::string line = "cd '" + folder.string() + "' && '" + std::string(CORAL_BIN_DIR) + "/" + command.substr(0, command.find(' ')) + "'" +
                             (command.find(' ') == std::string::npos ? "" : command.substr(command.find(' '))) + " >'" + out.string() + "' 2>'" +
                             err.string() + "' </dev/null";
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), content(out), content(err)};
}

void write_text(const fs::path& file, const std::string& text)
{
    std::ofstream stream(file, std::ios::binary);
    stream << text;
    if (!stream.flush()) throw std::runtime_error("cannot write " + file.string());
}

ScratchFolder::ScratchFolder()
{
    std::string pattern = (fs::temp_directory_path() / "coralsand-test-XXXXXX").string();
    if (!::mkdtemp(pattern.data())) throw std::runtime_error("cannot make a scratch folder");
    path_ = pattern;
}

ScratchFolder::~ScratchFolder()
{
    std::error_code ignored;
    fs::remove_all(path_, ignored);
}

}  // namespace coral::test
