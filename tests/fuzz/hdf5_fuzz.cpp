// A stack in HDF5 and our own file of harmonics: both go through core/hdf5.
#include <hdf5.h>

#include "fuzz/memory_file.h"
#include "morph/detail/readers.h"
#include "sh/shape_file.h"

/// HDF5 1.10 forgets object headers that it gave up reading. What we leave open is counted below.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    coral::fuzz::try_reader(data, size, [](const std::filesystem::path& file) { coral::morph::detail::read_hdf5(file, "/labels"); });
    coral::fuzz::try_reader(data, size, [](const std::filesystem::path& file) { coral::sh::read_shapes(file); });
    if (H5Fget_obj_count(H5F_OBJ_ALL, H5F_OBJ_ALL) != 0) std::abort();
    return 0;
}
