#pragma once
/// \file fuzz/memory_file.h
/// Bytes as a file that lives in memory only: readers want a path, and a fuzzer thousands of files a second.
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/error.h"

namespace coral::fuzz {

class MemoryFile {
public:
    MemoryFile(const std::uint8_t* data, std::size_t size) : descriptor_(memfd_create("fuzz", 0))
    {
        if (descriptor_ < 0 || write(descriptor_, data, size) != ssize_t(size)) std::abort();
    }
    ~MemoryFile() { close(descriptor_); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

private:
    int descriptor_;
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
