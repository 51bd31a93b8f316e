#include "fuzz/memory_file.h"
#include "sdf/vdb_io.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    return coral::fuzz::try_reader(data, size, [](const std::filesystem::path& file) {
        const coral::sdf::GrainReader reader(file);
        for (const int id : reader.ids()) reader.read(id);
    });
}
