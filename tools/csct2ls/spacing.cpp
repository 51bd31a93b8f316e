#include "csct2ls/spacing.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/error.h"
#include "csct2ls/convert.h"

namespace coral::csct2ls {
namespace {

/// Errors of one spacing.
struct Trial {
    double volume = 0;       ///< largest of a grain
    double void_volume = 0;  ///< of all grains together
    double misplaced = 0;    ///< share of the voids that is not void in the level sets
    double cut_off = 0;      ///< share of the open voids without a link to the outside
    std::string failure;     ///< a grain that could not be converted at all

    double worst() const { return failure.empty() ? std::max({volume, void_volume, misplaced, cut_off}) : 1.0; }
    std::string text() const
    {
        if (!failure.empty()) return failure;
        return fmt::format("volume within {:.2g} %, void volume within {:.2g} %, {:.2g} % of the voids out of place, {:.2g} % of the open voids cut off",
                           100 * volume, 100 * void_volume, 100 * misplaced, 100 * cut_off);
    }
};

/// Converts grains at the spacings of the ladder, each at most once per choice of grains.
class Search {
public:
    Search(const Shapes& shapes, double edge, const sdf::LevelSetOptions& options) : shapes_(shapes), edge_(edge), options_(options)
    {
        constexpr std::size_t most = 32;
        all_.resize(shapes.grains.size());
        std::iota(all_.begin(), all_.end(), std::size_t{0});
        const std::size_t count = std::min(most, all_.size());
        for (std::size_t n = 0; n < count; ++n) some_.push_back(count < 2 ? 0 : n * (all_.size() - 1) / (count - 1));
    }

    double spacing(int step) const  // three digits, so that the record can be read
    {
        const double h = edge_ * std::pow(2.0, step / 4.0), unit = std::pow(10.0, std::floor(std::log10(h)) - 2);
        return step == 0 ? h : std::round(h / unit) * unit;
    }
    const Trial& sample(int step) { return trial(step, some_, sampled_); }
    const Trial& whole(int step) { return some_.size() == all_.size() ? sample(step) : trial(step, all_, whole_); }

private:
    const Trial& trial(int step, const std::vector<std::size_t>& which, std::map<int, Trial>& known)
    {
        const auto found = known.find(step);
        return found == known.end() ? known.emplace(step, measure(step, which)).first->second : found->second;
    }

    Trial measure(int step, const std::vector<std::size_t>& which) const
    {
        sdf::LevelSetOptions options = options_;
        options.spacing = spacing(step);
        Trial trial;
        sdf::VoidRetention voids;
        try {
            for (const Converted& c : convert_all(shapes_, which, options, "spacing of " + short_length(options.spacing), {})) {
                trial.volume = std::max(trial.volume, std::abs(c.volume_error()));
                voids += c.voids;
            }
        } catch (const Error& error) {
            trial.failure = error.what();
            return trial;
        }
        trial.void_volume = std::abs(voids.retained() - 1.0);
        trial.misplaced = 1.0 - voids.overlap();
        trial.cut_off = voids.lost_link();
        return trial;
    }

    const Shapes& shapes_;
    double edge_;
    sdf::LevelSetOptions options_;
    std::vector<std::size_t> all_, some_;
    std::map<int, Trial> sampled_, whole_;
};

}  // namespace

double median(std::vector<double> values)
{
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

double upper_median(std::vector<double> values)
{
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

double typical_edge(const Eigen::Vector3d& voxel_size, const std::vector<morph::Grain>& grains)
{
    std::vector<double> scales;
    for (const morph::Grain& grain : grains) scales.push_back(grain.scale);
    return voxel_size.maxCoeff() * (scales.empty() ? 1.0 : upper_median(scales));
}

double choose_spacing(const Options& o, double edge)
{
    const double spacing = o.spacing > 0 ? o.spacing : o.scale_to > 0 ? std::max(o.scale_to / 75.0, edge) : 2.0 * edge;
    if (o.scale_to <= 0 && spacing < 0.5 * edge)
        throw UsageError("--spacing " + short_length(spacing), "is less than half a voxel (" + short_length(edge) + "), which would invent detail",
                         "take " + short_length(edge) + " or more");
    if (o.spacing <= 0) spdlog::info("level-set spacing {} (--spacing or --tolerance sets it)", short_length(spacing));
    else if (spacing < edge) spdlog::warn("--spacing {} is finer than the voxels ({}): it adds nodes, no detail", short_length(spacing), short_length(edge));
    return spacing;
}

double spacing_within(double tolerance, double edge, const Shapes& shapes, sdf::LevelSetOptions options)
{
    if (shapes.grains.empty()) throw Error("--tolerance", "there is no grain to hold it against");
    std::vector<double> diameters;
    for (const morph::Grain& grain : shapes.grains) diameters.push_back(grain.shape.equivalent_diameter);
    Search search(shapes, edge, options);
    // Below eight nodes across the grain the shape is gone whatever its volume says.
    int good = -1, bad = 1 + std::max(0, int(std::floor(4.0 * std::log2(upper_median(diameters) / (8.0 * edge)))));
    const int limit = bad;
    while (bad - good > 1) {
        const int middle = (good + bad) / 2;
        (search.sample(middle).worst() <= tolerance ? good : bad) = middle;
    }
    while (good >= 0 && search.whole(good).worst() > tolerance) bad = good--;
    const double percent = 100.0 * tolerance;
    if (good < 0) {
        spdlog::warn("--tolerance {:.3g} %: not met even at {}, the edge of the voxels: {}; that spacing is used, a finer one adds no detail", percent,
                     short_length(search.spacing(0)), search.whole(0).text());
        return search.spacing(0);
    }
    const auto failed = [&] { return search.sample(bad).worst() > tolerance ? search.sample(bad).text() : search.whole(bad).text(); };
    const std::string next =
        bad == limit ? "coarser ones leave less than 8 nodes across a grain" : short_length(search.spacing(bad)) + " is too coarse: " + failed();
    spdlog::info("--tolerance {:.3g} %: level-set spacing {}: {}; {}", percent, short_length(search.spacing(good)), search.whole(good).text(), next);
    return search.spacing(good);
}

void drop_coarse(morph::Extraction& extraction, const Eigen::Vector3d& voxel_size, double spacing)
{
    std::vector<morph::Grain> kept;
    for (morph::Grain& grain : extraction.grains) {
        if (grain.scale * voxel_size.minCoeff() <= 2.0 * spacing) kept.push_back(std::move(grain));
        else extraction.dropped.push_back({grain.box, morph::DropReason::coarse});
    }
    if (kept.size() < extraction.grains.size())
        spdlog::warn("{} dropped as too coarse: scaled by --scale-to, their voxels are more than twice the spacing of {}", extraction.grains.size() - kept.size(),
                     short_length(spacing));
    extraction.grains = std::move(kept);
}

}  // namespace coral::csct2ls
