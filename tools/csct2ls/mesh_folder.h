#pragma once
/// \file csct2ls/mesh_folder.h
/// Meshes of the grains: written into a folder of their own and moved when all is done.
#include <filesystem>
#include <string>

#include "sdf/mesh.h"

namespace coral::csct2ls {

class MeshFolder {
public:
    /// \param folder  empty: no meshes are wanted
    /// \param format  ply (coordinates in metres) or stl (in millimetres)
    /// \throws UsageError when it is no folder, Error when it cannot be made
    MeshFolder(std::filesystem::path folder, std::string format);
    /// Removes what was not committed.
    ~MeshFolder();
    MeshFolder(const MeshFolder&) = delete;
    MeshFolder& operator=(const MeshFolder&) = delete;

    bool wanted() const { return !folder_.empty(); }
    /// Thread-safe for different ids.
    void write(const sdf::TriangleMesh& mesh, int id) const;
    void commit();

private:
    std::filesystem::path folder_, temporary_;
    std::string format_;
    bool made_ = false, committed_ = false;
};

}  // namespace coral::csct2ls
