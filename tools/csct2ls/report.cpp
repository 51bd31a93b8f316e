#include "csct2ls/report.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>

#include "core/text.h"
#include "csct2ls/spacing.h"

namespace coral::csct2ls {
namespace {

template <class Number>
long long whole(Number n)
{
    return static_cast<long long>(n);
}

/// Peak resident memory of this process [bytes].
double peak_memory()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return 1024.0 * double(usage.ru_maxrss);
}

const char* reason_text(morph::DropReason reason)
{
    switch (reason) {
        case morph::DropReason::border: return "border";
        case morph::DropReason::small: return "small";
        case morph::DropReason::coarse: return "coarse";
        default: return "thin";
    }
}

}  // namespace

Table grain_table(const std::vector<morph::Grain>& grains, const std::vector<Converted>& converted)
{
    Table table;
    table.columns = split("id,label,voxels,volume,apparent_volume,equivalent_diameter,surface_area,intraparticle_porosity,open_porosity,closed_porosity,"
                          "void_count,largest_throat,volume_error,elongation,flatness,sphericity,convexity,roundness,touches_border,"
                          "touches_neighbour,apparent_surface_area,closing_radius,islands,island_voxels,level_set_components,scale,"
                          "void_volume_retained,void_overlap", ',');
    for (std::size_t g = 0; g < grains.size(); ++g) {
        const morph::Grain& grain = grains[g];
        const morph::Descriptors& d = grain.shape;
        const Converted& c = converted[g];
        table.add({whole(g + 1), whole(grain.box.label), whole(d.voxels), d.volume, d.apparent_volume, d.equivalent_diameter, d.surface_area,
                   d.intraparticle_porosity, d.open_porosity, d.closed_porosity, whole(d.void_count), d.largest_throat, c.volume_error(), d.elongation,
                   d.flatness, d.sphericity, d.convexity, d.roundness, whole(grain.box.touches_border), whole(grain.box.touches_neighbour),
                   d.apparent_surface_area, d.closing_radius, whole(grain.islands.count), whole(grain.islands.voxels), whole(c.report.solid_components),
                   grain.scale, c.voids.retained(), c.voids.overlap()});
    }
    return table;
}

Table void_table(const std::vector<morph::Grain>& grains, const std::vector<Converted>& converted)
{
    Table table;
    table.columns = split("id,void,volume,open,throat_diameter,depth,x,y,z,width,voxels", ',');
    for (std::size_t g = 0; g < grains.size(); ++g)
        for (std::size_t n = 0; n < grains[g].voids.size(); ++n) {
            const morph::Void& v = grains[g].voids[n];
            const Eigen::Vector3d at = v.centroid - converted[g].centre;
            table.add({whole(g + 1), whole(n + 1), v.volume, whole(v.open), v.throat_diameter, v.depth, at.x(), at.y(), at.z(), v.width, whole(v.voxels)});
        }
    return table;
}

nlohmann::ordered_json summary_of(const Source& source, const morph::Extraction& extraction, const std::vector<Converted>& converted, double spacing,
                                  const Stages& stages, bool statistics_with_border)
{
    nlohmann::ordered_json json;
    if (source.size.x() > 0) {
        json["stack_size"] = {source.size.x(), source.size.y(), source.size.z()};
        json["voxel_size"] = {source.voxel_size.x(), source.voxel_size.y(), source.voxel_size.z()};
    }
    json["segmentation"] = source.decision;
    if (source.closing_radius > 0) json["watershed_closing_radius"] = source.closing_radius;
    json["grains"] = extraction.grains.size();
    json["dropped"] = extraction.dropped.size();
    for (const morph::DropReason reason : {morph::DropReason::border, morph::DropReason::small, morph::DropReason::thin, morph::DropReason::coarse})
        json[std::string("dropped_") + reason_text(reason)] =
            std::count_if(extraction.dropped.begin(), extraction.dropped.end(), [&](const auto& d) { return d.reason == reason; });
    std::size_t border = 0, touching = 0, islands = 0;
    double volume = 0, apparent = 0, worst = 0;
    sdf::VoidRetention voids;
    std::vector<double> diameters;
    for (std::size_t g = 0; g < extraction.grains.size(); ++g) {
        const morph::Grain& grain = extraction.grains[g];
        border += grain.box.touches_border;
        touching += grain.box.touches_neighbour;
        islands += grain.islands.count;
        if (grain.box.touches_border && !statistics_with_border) continue;
        volume += grain.shape.volume;
        apparent += grain.shape.apparent_volume;
        voids += converted[g].voids;
        diameters.push_back(grain.shape.equivalent_diameter);
        if (std::abs(converted[g].volume_error()) > std::abs(worst)) worst = converted[g].volume_error();
    }
    for (const morph::Dropped& d : extraction.dropped) border += d.box.touches_border;
    json["border"] = border;
    json["touching"] = touching;
    json["islands"] = islands;
    json["spacing"] = spacing;
    json["equivalent_diameter_median"] = median(diameters);
    json["intraparticle_porosity"] = apparent > 0 ? 1.0 - volume / apparent : 0.0;
    json["largest_volume_error"] = worst;
    json["void_volume_retained"] = voids.retained();
    json["void_overlap"] = voids.overlap();
    json["open_void_cut_off"] = voids.lost_link();
    auto& list = json["dropped_labels"] = nlohmann::ordered_json::array();
    for (const morph::Dropped& d : extraction.dropped)
        if (list.size() < 1000) list.push_back({{"label", d.box.label}, {"voxels", d.box.voxels}, {"reason", reason_text(d.reason)}});
    json["seconds"] = stages.seconds();
    json["peak_memory"] = peak_memory();
    return json;
}

void warn_of_losses(const std::vector<morph::Grain>& grains, const std::vector<Converted>& converted, double spacing)
{
    constexpr double noticeable = 0.05;
    std::vector<std::string> hit;
    for (std::size_t g = 0; g < grains.size(); ++g) {
        const double error = converted[g].volume_error(), lost = converted[g].voids.solid_lost / converted[g].report.voxel_volume;
        const int pieces = converted[g].report.solid_components;
        std::string what;
        if (lost > noticeable) what += fmt::format(" loses {:.0f} % of its solid", 100.0 * lost);
        if (std::abs(error) > 0.01) what += fmt::format("{} is {:.0f} % {} in volume", what.empty() ? "" : ",", 100.0 * std::abs(error), error < 0 ? "short" : "over");
        if (pieces > 1) what += fmt::format("{} falls into {} pieces", what.empty() ? "" : " and", pieces);
        if (!what.empty()) hit.push_back(fmt::format("grain {} (label {}){}", g + 1, grains[g].box.label, what));
    }
    if (hit.empty()) return;
    std::string text = hit[0];
    for (std::size_t n = 1; n < std::min<std::size_t>(hit.size(), 3); ++n) text += ", " + hit[n];
    if (hit.size() > 3) text += fmt::format(" and {} more", hit.size() - 3);
    spdlog::warn("parts are thinner than the spacing of {}: {}; take a finer --spacing", short_length(spacing), text);
}

std::string human_summary(const Options& o, const nlohmann::ordered_json& json)
{
    double seconds = 0;
    for (const auto& [stage, value] : json["seconds"].items()) seconds += value.get<double>();
    return fmt::format(
        "{}: {} grains, {} of them touching others\n"
        "dropped: {} ({} at the border, {} too small, {} too thin, {} too coarse)\n"
        "median diameter {}, intraparticle porosity {:.4f}\n"
        "level sets at {}: volume within {:.3f} %, {:.2f} % of the voids in place\n"
        "{:.1f} s, {:.0f} MB\n",
        o.output.string(), json["grains"].get<std::size_t>(), json["touching"].get<std::size_t>(), json["dropped"].get<std::size_t>(),
        json["dropped_border"].get<std::size_t>(), json["dropped_small"].get<std::size_t>(), json["dropped_thin"].get<std::size_t>(), json["dropped_coarse"].get<std::size_t>(),
        short_length(json["equivalent_diameter_median"].get<double>()), json["intraparticle_porosity"].get<double>(),
        short_length(json["spacing"].get<double>()), 100.0 * std::abs(json["largest_volume_error"].get<double>()),
        100.0 * json["void_overlap"].get<double>(), seconds,
        json["peak_memory"].get<double>() / 1e6);
}

}  // namespace coral::csct2ls
