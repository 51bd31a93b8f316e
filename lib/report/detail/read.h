#pragma once
/// \file report/detail/read.h
/// Parts of reading a case that are optional: a failure becomes a note, not an error.
#include <filesystem>

#include "core/hdf5.h"
#include "report/case_data.h"
#include "report/surface_mesh.h"

namespace coral::report::detail {

/// `/history` dataset or root attribute `history`.
void read_history(const H5File& file, CaseData& data);
/// Set-up table, domain, plates and own bodies out of data.case_toml; nothing when that is empty.
void read_case_text(CaseData& data);
/// Bodies, criteria and PSD of sample.h5; puts its bodies in front of those of case.toml.
void read_sample(const std::filesystem::path& file, CaseData& data);
/// Triangles of `/shapes/<shape>` when it is a polyhedron, about its centre of mass; empty otherwise.
Mesh read_polyhedron(const std::filesystem::path& sample, std::int64_t shape);
/// Distance lattice of `/shapes/<shape>`; without distances when the shape has none (a sphere).
Lattice read_lattice(const std::filesystem::path& sample, std::int64_t shape);

}  // namespace coral::report::detail
