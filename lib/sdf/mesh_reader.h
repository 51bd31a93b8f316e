#pragma once
/// \file sdf/mesh_reader.h
/// Triangle meshes from STL and PLY files.
#include <filesystem>

#include "sdf/mesh.h"

namespace coral::sdf {

/// Reads .stl (binary or ascii) or .ply (ascii or binary little endian; polygons become fans), either of them gzipped (.stl.gz, .ply.gz).
/// Vertices with equal coordinates are joined, triangles with two equal vertices left out.
/// \param unit  of the coordinates [m], which neither format says
/// \throws UsageError  no such file, another kind of file
/// \throws Error       truncated or damaged (names file and place), coordinates that are no numbers, vertex numbers out of range
TriangleMesh read_mesh(const std::filesystem::path& file, double unit);

}  // namespace coral::sdf
