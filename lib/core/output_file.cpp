#include "core/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

#include "core/error.h"

namespace coral {
namespace fs = std::filesystem;

OutputFile::OutputFile(fs::path target) : target_(std::move(target))
{
    // Renaming would replace a link in place of the file it names, and a device altogether.
    if (fs::is_symlink(target_) && fs::exists(target_)) target_ = fs::canonical(target_);
    const fs::path folder = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
    if (!fs::is_directory(folder)) throw UsageError(target_.string(), "the folder " + folder.string() + " does not exist", "make it first");
    if (fs::is_directory(target_)) throw UsageError(target_.string(), "is a folder", "give the name of a file");
    if (fs::exists(target_) && !fs::is_regular_file(target_)) throw UsageError(target_.string(), "is no ordinary file", "give the name of a file");
    // The extension stays last: readers and writers of some formats go by it.
    temporary_ = folder / ("." + target_.stem().string() + ".part" + std::to_string(::getpid()) + target_.extension().string());
    if (::access(folder.c_str(), W_OK) != 0) throw Error(target_.string(), "the folder " + folder.string() + " is not writable");
}

OutputFile::~OutputFile()
{
    std::error_code ignored;
    if (!committed_) fs::remove(temporary_, ignored);
}

void OutputFile::commit()
{
    const int file = ::open(temporary_.c_str(), O_RDONLY);
    if (file < 0) throw Error(target_.string(), std::string("could not be written: ") + std::strerror(errno));
    const bool flushed = ::fsync(file) == 0;
    ::close(file);
    std::error_code failure;
    if (flushed) fs::rename(temporary_, target_, failure);
    if (!flushed || failure) throw Error(target_.string(), std::string("could not be written: ") + std::strerror(errno), "check the space left on the disk");
    committed_ = true;
}

TextFile::TextFile(const fs::path& target) : target_(target)
{
    if (!target.empty()) file_.emplace(target);
}

void TextFile::write(std::string_view text) const
{
    std::ofstream stream(file_->temporary(), std::ios::binary);
    stream.write(text.data(), static_cast<std::streamsize>(text.size()));
    stream.close();
    if (!stream) throw Error(target_.string(), "could not be written", "check the space left on the disk");
}

void TextFile::commit()
{
    if (file_) file_->commit();
}

void write_text_file(const fs::path& target, std::string_view text)
{
    TextFile file(target);
    file.write(text);
    file.commit();
}

std::string read_text_file(const fs::path& file)
{
    std::ifstream stream(file, std::ios::binary);
    if (!stream || fs::is_directory(file)) throw Error(file.string(), "cannot be read: " + std::string(fs::exists(file) ? "not a readable file" : "no such file"));
    std::ostringstream text;
    text << stream.rdbuf();
    return std::move(text).str();
}

}  // namespace coral
