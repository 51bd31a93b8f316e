#pragma once
/// \file suffusion/scratch.h
/// Folder for the files of one test, removed when the object goes.
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>

namespace coral::suffusion::test {

class Scratch {
public:
    Scratch()
    {
        static std::atomic<int> count = 0;
        path_ = std::filesystem::temp_directory_path() / ("coral_suffusion_" + std::to_string(getpid()) + "_" + std::to_string(count++));
        std::filesystem::create_directories(path_);
    }
    ~Scratch() { std::filesystem::remove_all(path_); }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path write(const std::string& name, const std::string& text) const
    {
        std::filesystem::create_directories((path_ / name).parent_path());
        std::ofstream(path_ / name) << text;
        return path_ / name;
    }

private:
    std::filesystem::path path_;
};

}  // namespace coral::suffusion::test
