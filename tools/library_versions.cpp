#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <fmt/core.h>
#include <hdf5.h>
#include <oneapi/tbb/version.h>
#include <openvdb/version.h>
#include <spdlog/version.h>

#include "cli.h"

namespace coral::cli {

std::string library_versions()
{
    unsigned major = 0, minor = 0, patch = 0;
    H5get_libversion(&major, &minor, &patch);
    std::string text = fmt::format("OpenVDB {}\nHDF5 {}.{}.{}\nEigen {}.{}.{}\noneTBB {}\nCLI11 {}\n", OPENVDB_LIBRARY_VERSION_STRING, major, minor,
                                   patch, EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, TBB_runtime_version(), CLI11_VERSION);
    return text + fmt::format("compiler {}", __VERSION__);
}

}  // namespace coral::cli
