#pragma once
/// \file csct2ls/report.h
/// What csct2ls tells: the tables and the summary.
#include <chrono>
#include <string>

#include "core/table.h"
#include "csct2ls/convert.h"
#include "csct2ls/options.h"
#include "morph/extraction.h"

namespace coral::csct2ls {

/// Seconds since the last lap, by stage.
class Stages {
public:
    void lap(const std::string& stage)
    {
        const auto now = std::chrono::steady_clock::now();
        seconds_[stage] = std::chrono::duration<double>(now - last_).count();
        last_ = now;
    }
    const nlohmann::ordered_json& seconds() const { return seconds_; }

private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
    nlohmann::ordered_json seconds_ = nlohmann::ordered_json::object();
};

/// What the grains were cut out of, for the summary.
struct Source {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();        ///< voxels; zero for meshes
    Eigen::Vector3d voxel_size = Eigen::Vector3d::Zero();  ///< [m]
    std::string decision;                                  ///< how the numbers were taken
    double closing_radius = 0;                             ///< of the watershed [m]
};

Table grain_table(const std::vector<morph::Grain>& grains, const std::vector<Converted>& converted);

/// One row per void, grains by id, the voids of each by falling volume.
Table void_table(const std::vector<morph::Grain>& grains, const std::vector<Converted>& converted);

/// \param statistics_with_border  whether grains cut by the border count in the summary's statistics
nlohmann::ordered_json summary_of(const Source& source, const morph::Extraction& extraction, const std::vector<Converted>& converted, double spacing,
                                  const Stages& stages, bool statistics_with_border);

/// Warns of grains thinner than the spacing: what the level set loses of them.
void warn_of_losses(const std::vector<morph::Grain>& grains, const std::vector<Converted>& converted, double spacing);

std::string human_summary(const Options& o, const nlohmann::ordered_json& json);

}  // namespace coral::csct2ls
