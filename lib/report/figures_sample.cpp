// Figures of the sample and of what is left of it. Numbers in brackets are the figures of Huang et al. that they answer.
#include <algorithm>

#include "report/detail/figures.h"
#include "report/summary.h"

namespace coral::report::detail {

std::vector<std::string> layer_names(std::size_t layers)
{
    if (layers == 3) return {"bottom", "middle", "top"};
    std::vector<std::string> names;
    for (std::size_t k = 1; k <= layers; ++k) names.push_back(std::to_string(k) + (k == 1 ? " (bottom)" : k == layers ? " (top)" : ""));
    return names;
}

Figure layer_bars(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "fines_left";
    figure.title = "Fines per layer before and after";
    figure.caption = "Fines in each layer of the initial height at the start (outlined) and at the end (filled); the lines span the repeats [Fig. 24].";
    figure.kind = FigureKind::bars;
    figure.x_column = "layer";
    figure.x_label = "layer";
    figure.table.columns = {"case", "layer", "count_start", "count_end", "count_end_low", "count_end_high"};
    figure.panels = {{"", "fines [count]", 1, false, {{"count_start", "start", {}, {}, {}}, {"count_end", "end", "count_end_low", "count_end_high", {}}}, {}}};
    for (const CaseData& data : cases) {
        const Series* fines = data.find("fines_count");
        if (!fines || !has_fines(data)) continue;
        figure.categories = layer_names(std::max(fines->width, figure.categories.size()));
        const std::size_t last = data.time.size() - 1;
        for (std::size_t layer = 0; layer < fines->width; ++layer) {
            const bool spread = data.repeats > 1;
            figure.table.add({data.name, static_cast<double>(layer), number_cell(fines->at(0, layer)), number_cell(fines->at(last, layer)),
                              number_cell(spread ? data.low.at("fines_count").at(last, layer) : NAN),
                              number_cell(spread ? data.high.at("fines_count").at(last, layer) : NAN)});
        }
    }
    return figure;
}

Figure gradation(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "particle_size_distribution";
    figure.title = "Particle size distribution";
    figure.caption = "Mass passing over equivalent diameter (of the filled shape), from the grains of the sample [Fig. 8].";
    figure.kind = FigureKind::steps;
    figure.x_column = "diameter";
    figure.x_label = "equivalent diameter [mm]";
    figure.x_factor = 1000;
    figure.x_logarithmic = true;
    figure.table.columns = {"case", "diameter", "passing"};
    figure.panels = {{"", "mass passing [%]", 100, false, {{"passing", {}, {}, {}, {}}}, {}}};
    for (const CaseData& data : cases)
        for (std::size_t i = 0; i < data.psd_diameter.size(); ++i)
            if (data.psd_diameter[i] > 0) figure.table.add({data.name, data.psd_diameter[i], number_cell(data.psd_passing[i])});
    return figure;
}

Figure stability_table(const std::vector<CaseData>& cases)
{
    Figure figure;
    figure.name = "stability_criteria";
    figure.title = "Internal stability of the samples";
    figure.caption = "Criteria from the sample's own gradation and porosity, with limit and verdict [Table 1].";
    figure.kind = FigureKind::table;
    figure.x_column = "criterion";
    figure.table.columns = {"case", "criterion", "value", "threshold", "verdict"};
    figure.panels = {{"", "", 1, false, {{"value", {}, {}, {}, {}}}, {}}};
    for (const CaseData& data : cases)
        for (const Criterion& c : data.criteria) figure.table.add({data.name, c.name, number_cell(c.value), number_cell(c.threshold), c.verdict});
    return figure;
}

}  // namespace coral::report::detail
