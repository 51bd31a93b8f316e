#pragma once
/// \file suffusion/run.h
/// A whole run: from a case folder to results.h5, checkpoint.h5 and frames/.
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/record.h"
#include "suffusion/results.h"

namespace coral::suffusion {

struct RunOptions {
    double until = std::numeric_limits<double>::infinity();  ///< stop at the first step that reaches it [s]; steps are not changed
    bool resume = false;
    bool timing = true;  ///< store wall-clock values under /performance
    RecordEntry record;
    /// Asked after every step; true ends the run with a checkpoint.
    std::function<bool()> interrupted = [] { return false; };
    std::function<void(const std::string&)> message = [](const std::string&) {};
};

struct RunSummary {
    double time = 0, duration = 0;  ///< reached, asked for [s]
    bool complete = false, interrupted = false;
    std::filesystem::path results, checkpoint;
    std::vector<Measure> performance;
    std::vector<Measure> last;  ///< last value of each plain series
    double max_mass_error = 0, max_momentum_error = 0;
    std::size_t bodies = 0, fines = 0;
};

/// Runs a case to its end, to `until`, or until interrupted.
/// A stop by an error leaves results.h5 up to the last output and a checkpoint of that moment.
/// \throws UsageError for a wrong case, Error when the run fails
RunSummary run_case(const std::filesystem::path& path, const RunOptions& options);

}  // namespace coral::suffusion
