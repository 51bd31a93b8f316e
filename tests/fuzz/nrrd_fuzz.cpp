#include "fuzz/memory_file.h"
#include "morph/detail/readers.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    return coral::fuzz::try_reader(data, size, [](const std::filesystem::path& file) { coral::morph::detail::read_nrrd(file); });
}
