// Grains: level sets and harmonic shapes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "grain-info/describe.h"
#include "sdf/vdb_io.h"
#include "sh/shape_file.h"

namespace coral::grain_info {

Report describe_grains(const std::filesystem::path& file)
{
    const sdf::GrainReader reader(file);
    Report report("level sets of grains (csct2ls)");
    report.add("grains", reader.ids().size());
    std::vector<double> diameters, porosities, spacings;
    std::vector<std::string> lines;
    double volume = 0, apparent = 0, inside = 0, outside = 0;
    Json grains = Json::array();
    for (const int id : reader.ids()) {
        const sdf::GrainLevelSet grain = reader.read(id);
        diameters.push_back(grain.equivalent_diameter);
        spacings.push_back(grain.solid.spacing);
        volume += grain.volume;
        apparent += grain.apparent_volume;
        inside = std::max(inside, grain.solid.inside_limit / grain.solid.spacing);
        outside = std::max(outside, grain.solid.outside_limit / grain.solid.spacing);
        const Eigen::Vector3i& size = grain.solid.size;
        grains.push_back({{"id", id}, {"label", grain.label}, {"equivalent_diameter", grain.equivalent_diameter}, {"volume", grain.volume},
                          {"intraparticle_porosity", grain.intraparticle_porosity}, {"nodes", {size.x(), size.y(), size.z()}}});
        lines.push_back(fmt::format("grain_{}: {} wide, porosity {}, {} x {} x {} nodes", id, metres(grain.equivalent_diameter), percent(grain.intraparticle_porosity), size.x(), size.y(), size.z()));
    }
    report.lengths("spacing", spacings);
    report.add("band", {inside, outside}, fmt::format("{:.3g} nodes inside, {:.3g} outside", inside, outside));
    report.lengths("equivalent_diameter", diameters);
    if (apparent > 0) report.share("intraparticle_porosity", 1 - volume / apparent);
    report.list("each", grains, lines);
    report.history(reader.history());
    return report;
}

Report describe_shapes(const std::filesystem::path& file)
{
    const sh::ShapeFile shapes = sh::read_shapes(file);
    Report report("spherical-harmonic shapes (ls2sh)");
    report.add("shapes", shapes.shapes.size());
    std::vector<double> diameters;
    std::vector<std::string> lines;
    std::set<std::string> methods;
    int lowest = 1000, highest = 0;
    Json each = Json::array();
    for (const sh::ShapeRecord& s : shapes.shapes) {
        diameters.push_back(s.equivalent_diameter);
        methods.insert(s.surface.method);
        lowest = std::min(lowest, s.surface.degree);
        highest = std::max(highest, s.surface.degree);
        each.push_back({{"id", s.id}, {"name", s.name}, {"degree", s.surface.degree}, {"method", s.surface.method}, {"equivalent_diameter", s.equivalent_diameter}, {"volume", s.volume},
                        {"rms_error", number(s.errors.rms_error)}, {"max_error", number(s.errors.max_error)}, {"non_star_fraction", number(s.errors.non_star_fraction)}});
        lines.push_back(fmt::format("{}{}: {} wide, degree {}, {}{}", s.id, s.name.empty() ? "" : " " + s.name, metres(s.equivalent_diameter), s.surface.degree, s.surface.method,
                                    std::isfinite(s.errors.rms_error) ? fmt::format(", RMS error {}, worst {}", percent(s.errors.rms_error), percent(s.errors.max_error)) : ""));
    }
    std::string all;
    for (const std::string& method : methods) all += (all.empty() ? "" : ", ") + method;
    if (!shapes.shapes.empty()) report.add("degree", {lowest, highest}, lowest == highest ? std::to_string(lowest) : fmt::format("{} to {}", lowest, highest));
    report.add("method", all);
    report.lengths("equivalent_diameter", diameters);
    report.list("each", each, lines);
    report.history(shapes.history);
    return report;
}

}  // namespace coral::grain_info
