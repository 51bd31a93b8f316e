#include <CGAL/version.h>
#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <fftw3.h>
#include <fmt/core.h>
#include <hdf5.h>
#include <nlohmann/json.hpp>
#include <oneapi/tbb/version.h>
#include <openvdb/version.h>
#include <spdlog/version.h>
#include <tiffvers.h>
#include <toml++/toml.h>

#include "cli.h"

namespace coral::cli {

std::string library_versions()
{
    unsigned major = 0, minor = 0, patch = 0;
    H5get_libversion(&major, &minor, &patch);
    const std::string tiff = TIFFLIB_VERSION_STR;  // "LIBTIFF, Version 4.5.0\nCopyright ..."
    const std::size_t number = tiff.find_first_of("0123456789");
    std::string text;
    const auto add = [&](const char* name, const std::string& version) { text += fmt::format("{} {}\n", name, version); };
    const auto dotted = [](int a, int b, int c) { return fmt::format("{}.{}.{}", a, b, c); };
    add("OpenVDB", OPENVDB_LIBRARY_VERSION_STRING);
    add("HDF5", dotted(int(major), int(minor), int(patch)));
    add("FFTW", fftw_version);
    add("CGAL", dotted(CGAL_VERSION_MAJOR, CGAL_VERSION_MINOR, CGAL_VERSION_PATCH));
    add("libtiff", tiff.substr(number, tiff.find('\n') - number));
    add("Eigen", dotted(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION));
    add("oneTBB", TBB_runtime_version());
    add("toml++", dotted(TOML_LIB_MAJOR, TOML_LIB_MINOR, TOML_LIB_PATCH));
    add("nlohmann-json", dotted(NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH));
    add("spdlog", dotted(SPDLOG_VER_MAJOR, SPDLOG_VER_MINOR, SPDLOG_VER_PATCH));
    add("fmt", dotted(FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100));
    add("CLI11", CLI11_VERSION);
    return text + fmt::format("compiler {}", __VERSION__);
}

}  // namespace coral::cli
