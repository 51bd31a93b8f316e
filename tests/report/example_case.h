#pragma once
/// \file report/example_case.h
/// Small case folders as suffuse and pack-sample leave them, with curves that the tests know in closed form.
#include <filesystem>

namespace coral::test {

struct ExampleCase {
    std::size_t steps = 41;       ///< outputs over 2 s
    double erosion = 0.3;         ///< eroded fraction tends to this: erosion * (1 - exp(-t / 0.5 s))
    std::size_t grains = 6;       ///< coarse, hollow spheres with an opening
    std::size_t fines = 120;
    bool sample = true;           ///< writes sample.h5
    bool trajectories = true;
    bool optional_series = true;  ///< all series but the eroded mass
};

/// Eroded fraction of the example at a time [s].
double example_erosion(const ExampleCase& example, double time);

/// Makes `folder` with results.h5, case.toml and, if wanted, sample.h5.
void write_example_case(const std::filesystem::path& folder, const ExampleCase& example = {});

}  // namespace coral::test
