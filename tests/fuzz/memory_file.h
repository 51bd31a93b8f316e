#pragma once
/// \file fuzz/memory_file.h
/// Bytes as a file that lives in memory only: readers want a path, and a fuzzer thousands of files a second.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/error.h"

namespace coral::fuzz {

/// In a folder of its own: a header that names a data file must not find the fuzzer's own streams beside it.
class MemoryFile {
public:
    MemoryFile(const std::uint8_t* data, std::size_t size) : folder_("/dev/shm/coral_fuzz_" + std::to_string(getpid()))
    {
        std::filesystem::create_directories(folder_);
        std::ofstream file(path(), std::ios::binary | std::ios::trunc);
        if (!file.write(reinterpret_cast<const char*>(data), std::streamsize(size))) std::abort();
    }
    ~MemoryFile() { std::filesystem::remove_all(folder_); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    std::filesystem::path path() const { return folder_ / "input"; }

private:
    std::filesystem::path folder_;
};

/// Runs a reader on the bytes. Only an error of ours is an answer to a bad file; anything else ends the fuzzer.
template <class Read>
int try_reader(const std::uint8_t* data, std::size_t size, const Read& read)
{
    const MemoryFile file(data, size);
    try {
        read(file.path());
    } catch (const Error&) {
    }
    return 0;
}

}  // namespace coral::fuzz
