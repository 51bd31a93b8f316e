#pragma once
/// \file tools/validate/check.h
/// One comparison of the validation table, and the studies that make comparisons at several resolutions.
#include <cmath>
#include <ctime>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "fluid/flow.h"

namespace coral::validate {

/// Tolerance of rows that only show how an error falls.
inline constexpr double shown_only = std::numeric_limits<double>::infinity();

struct Check {
    std::string what, unit;
    double target, value, tolerance;
    bool relative = true;   ///< the error is divided by the target
    std::string source = {}; ///< of the target
    double resolution = 0;  ///< cells per diameter; 0: does not apply
    double seconds = 0;     ///< processor time of this row; 0: that of the scene
    /// Signed when relative to a target: which side the value errs on matters in a resolution study.
    double error() const { return relative ? value / target - 1 : value - target; }
    bool passes() const { return std::abs(error()) <= tolerance; }
};

struct StudyOptions {
    std::filesystem::path output;  ///< folder for curves [csv]
    std::filesystem::path scenes;  ///< pipeline/validation, with reference/
    std::filesystem::path grains;  ///< grains.vdb for the settling grain; may be empty
    bool heavy = false;            ///< also the resolutions that take minutes
};

/// Of the flow's fields in all scenes and studies; the command line sets it before the first.
inline fluid::Precision precision = fluid::Precision::float64;

inline fluid::FlowOptions flow_options()
{
    fluid::FlowOptions options;
    options.precision = precision;
    return options;
}

/// What a balance may be off by, where fields in double allow `in_double`.
inline double balance_tolerance(double in_double) { return precision == fluid::Precision::float32 ? 1e-4 : in_double; }

/// Processor time of this process so far [s].
inline double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// \name Resolved grains against published and closed-form results. Each returns its rows, coarse to fine.
///@{
std::vector<Check> cubic_arrays(const StudyOptions& options);
std::vector<Check> array_positions(const StudyOptions& options);
std::vector<Check> array_time_step(const StudyOptions& options);
std::vector<Check> centred_arrays(const StudyOptions& options);
std::vector<Check> fixed_sphere(const StudyOptions& options);
std::vector<Check> rotating_sphere(const StudyOptions& options);
std::vector<Check> closed_shell(const StudyOptions& options);
std::vector<Check> random_bed(const StudyOptions& options);
std::vector<Check> ten_cate_tank(const StudyOptions& options);
std::vector<Check> rising_sphere(const StudyOptions& options);
std::vector<Check> two_spheres(const StudyOptions& options);
std::vector<Check> coral_grain(const StudyOptions& options);
///@}

/// \name Fines through the kernel (tools/validate/fines.cpp). Each returns its rows, coarse to fine.
///@{
std::vector<Check> falling_fine(const StudyOptions& options);  ///< alone in still water
std::vector<Check> ergun_bed(const StudyOptions& options);     ///< periodic bed
std::vector<Check> ergun_walls(const StudyOptions& options);   ///< the paper's bed in its box
std::vector<Check> two_schemes(const StudyOptions& options);   ///< one sphere resolved and through the kernel
///@}

}  // namespace coral::validate
