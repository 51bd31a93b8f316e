#include "csct2ls/mesh_folder.h"

#include <unistd.h>

#include <system_error>

#include "core/error.h"

namespace coral::csct2ls {

namespace fs = std::filesystem;

MeshFolder::MeshFolder(fs::path folder, std::string format) : folder_(std::move(folder)), format_(std::move(format))
{
    if (folder_.empty()) return;
    if (fs::exists(folder_) && !fs::is_directory(folder_)) throw UsageError("--mesh " + folder_.string(), "is not a folder", "give the name of a folder");
    std::error_code failure;
    made_ = fs::create_directory(folder_, failure);
    temporary_ = folder_ / (".part" + std::to_string(::getpid()));
    if (!failure) fs::create_directory(temporary_, failure);
    if (!failure) return;
    std::error_code ignored;
    if (made_) fs::remove(folder_, ignored);
    if (failure == std::errc::no_such_file_or_directory)
        throw UsageError("--mesh " + folder_.string(), "its folder does not exist", "make the folder first");
    throw Error("--mesh " + folder_.string(), "the folder cannot be written to: " + failure.message(), "choose another folder");
}

MeshFolder::~MeshFolder()
{
    std::error_code ignored;
    if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
    if (made_ && !committed_) fs::remove(folder_, ignored);
}

void MeshFolder::write(const sdf::TriangleMesh& mesh, int id) const
{
    const fs::path file = temporary_ / ("grain_" + std::to_string(id) + "." + format_);
    if (format_ == "stl") sdf::write_stl(mesh, file, 1e-3);
    else sdf::write_ply(mesh, file);
}

void MeshFolder::commit()
{
    committed_ = true;
    if (!wanted()) return;
    for (const auto& entry : fs::directory_iterator(temporary_)) fs::rename(entry.path(), folder_ / entry.path().filename());
}

}  // namespace coral::csct2ls
