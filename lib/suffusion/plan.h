#pragma once
/// \file suffusion/plan.h
/// From a packed sample to a suffusion case: domain, filter plate, schemes, steps, memory and time, and the case.toml that says so.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "pack/sample.h"
#include "suffusion/case_file.h"

namespace coral::suffusion {

struct PlanOptions {
    double velocity = 0.1;  ///< of the flow downwards at the inlet, superficial [m/s]
    double angle = 0;       ///< between flow and gravity [rad]: gravity is turned about y, the flow stays along -z
    double hole = 0;        ///< edge of the filter holes [m]; 0: 0.4 of the smallest coarse diameter (6 mm for 15 mm grains)
    double pitch = 0;       ///< distance of their centres, made to divide the sample's width [m]; 0: two edges (a quarter of the plate is open)
    double cell = 0;        ///< [m]; 0: a thirtieth of the smallest coarse diameter (0.5 mm for 15 mm grains)
    double duration = 2;    ///< [s]
    double dem_step = 0;    ///< of contact [s]; 0: 0.3 of the critical step
    /// Whether the upper wall of the packing stays, as the perforated plate of an oedometer: for grains only, water passes. Without it a
    /// compressed sample springs up when the run starts.
    bool lid = true;
};

/// Grains of one role.
struct PopulationPlan {
    std::string role;
    std::size_t count = 0;
    double smallest = 0, largest = 0;  ///< equivalent diameter [m]
    Scheme scheme = Scheme::automatic; ///< of the median grain
    bool mixed = false;                ///< whether grains of this role fall under more than one scheme
    std::string why;
};

struct Plan {
    PlanOptions options;  ///< with the automatic values filled in
    DomainSpec domain;
    double plate_thickness = 0, pitch = 0;  ///< [m]; the upper face lies at z = 0, where the sample rests
    double plate_open_fraction = 0;
    Eigen::Vector3d sample_size = Eigen::Vector3d::Zero();  ///< [m]
    Eigen::Vector3d period = Eigen::Vector3d::Zero();       ///< of the sample; 0 where it has walls [m]
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();      ///< [m/s2]
    std::vector<PopulationPlan> populations;
    double flow_step = 0, dem_step = 0;    ///< expected [s]
    double flow_steps = 0, dem_steps = 0;  ///< expected number
    double memory = 0;                     ///< [bytes]
    double run_time = 0;                   ///< on this machine's threads [s]
    std::vector<std::string> warnings;
};

/// \throws Error when the sample has no fines or no coarse grains; UsageError for options out of range
Plan make_plan(const pack::Sample& sample, const PlanOptions& options);

/// The plan in words, a line a fact.
std::string explain(const Plan& plan);

/// What flow and contact of this case may be wrong by, by measured cases like it; several lines.
std::string explain_accuracy(const Plan& plan, const pack::Sample& sample);

/// Complete, commented case.toml; the sample lies beside it under `sample_file`.
std::string case_text(const Plan& plan, const pack::Sample& sample, const std::string& sample_file);

}  // namespace coral::suffusion
