#pragma once
/// \file sdf/detail/vdb_seal.h
/// A grains.vdb is sealed: a last mark with its length, and a checksum in the place of OpenVDB's random UUID. OpenVDB takes lengths
/// out of a cut or damaged file for memory, without end, so that damage must be seen before it looks.
#include <filesystem>

namespace coral::sdf::detail {

/// Appends the mark and puts the checksum in. The same content gives the same bytes. \throws Error when the disk is full
void seal(const std::filesystem::path& file);

/// \throws Error unless the file is as seal() left it
void require_sealed(const std::filesystem::path& file);

}  // namespace coral::sdf::detail
