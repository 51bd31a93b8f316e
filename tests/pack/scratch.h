#pragma once
/// A folder for the files of this test program, gone with it.
#include <unistd.h>

#include <filesystem>
#include <string>

namespace coral::pack {

inline std::filesystem::path scratch(const std::string& name)
{
    struct Folder {
        std::filesystem::path path = std::filesystem::temp_directory_path() / ("coral_pack_" + std::to_string(::getpid()));
        Folder() { std::filesystem::create_directories(path); }
        ~Folder()
        {
            std::error_code ignored;
            std::filesystem::remove_all(path, ignored);
        }
    };
    static const Folder folder;
    return folder.path / name;
}

}  // namespace coral::pack
