#pragma once
/// \file grain-info/describe.h
/// One function per kind of file. Each reads the file in full with the reader that the next tool would use, a stack excepted.
/// All throw Error when the file is damaged, of another kind, or of a newer format.
#include <filesystem>

#include "grain-info/report.h"

namespace coral::grain_info {

Report describe_grains(const std::filesystem::path& file);      ///< grains.vdb
Report describe_shapes(const std::filesystem::path& file);      ///< .sh.h5
Report describe_sample(const std::filesystem::path& file);      ///< sample.h5
Report describe_results(const std::filesystem::path& file);     ///< results.h5
Report describe_checkpoint(const std::filesystem::path& file);  ///< checkpoint.h5
Report describe_case(const std::filesystem::path& path);        ///< folder of a case, or its case.toml
Report describe_table(const std::filesystem::path& file);       ///< .csv

/// A stack from its headers; its voxels are read only when `values` asks for what they hold.
Report describe_stack(const std::string& path, bool values);

}  // namespace coral::grain_info
