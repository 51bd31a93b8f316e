// A stack in HDF5 and our own file of harmonics: both go through core/hdf5.
#include "fuzz/memory_file.h"
#include "morph/detail/readers.h"
#include "sh/shape_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    coral::fuzz::try_reader(data, size, [](const std::filesystem::path& file) { coral::morph::detail::read_hdf5(file, "/labels"); });
    return coral::fuzz::try_reader(data, size, [](const std::filesystem::path& file) { coral::sh::read_shapes(file); });
}
