#include "report/pool.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace coral::report {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Times that all runs have; they must agree.
std::vector<double> common_times(const std::vector<const CaseData*>& runs)
{
    std::vector<double> times = runs.front()->time;
    for (const CaseData* run : runs) {
        times.resize(std::min(times.size(), run->time.size()));
        const double step = times.size() > 1 ? times[1] - times[0] : 0;
        for (std::size_t i = 0; i < times.size(); ++i)
            if (std::abs(times[i] - run->time[i]) <= 1e-6 * step + 1e-15) continue;
            else if (i + 1 == times.size()) times.pop_back();  // a run that stopped between two outputs
            else
                throw Error(run->folder.string(), "has other output times than the runs it is to be averaged with",
                            "give it a label of its own, or run them with the same [output] interval");
    }
    return times;
}

struct Spread {
    Series mean, low, high;
};

Spread spread_of(const std::vector<const CaseData*>& runs, const std::string& name, std::size_t steps)
{
    Spread spread;
    for (const CaseData* run : runs)
        if (const Series* series = run->find(name)) spread.mean.unit = series->unit, spread.mean.width = series->width;
    spread.low = spread.high = spread.mean;
    for (std::size_t i = 0; i < steps * spread.mean.width; ++i) {
        double sum = 0, count = 0, low = HUGE_VAL, high = -HUGE_VAL;
        for (const CaseData* run : runs) {
            const Series* series = run->find(name);
            if (!series || series->width != spread.mean.width || !std::isfinite(series->values[i])) continue;
            sum += series->values[i];
            count += 1;
            low = std::min(low, series->values[i]);
            high = std::max(high, series->values[i]);
        }
        spread.mean.values.push_back(count > 0 ? sum / count : unknown);
        spread.low.values.push_back(count > 0 ? low : unknown);
        spread.high.values.push_back(count > 0 ? high : unknown);
    }
    return spread;
}

CaseData pool(const std::vector<const CaseData*>& runs)
{
    CaseData pooled = *runs.front();
    pooled.name = pooled.label;
    pooled.repeats = runs.size();
    pooled.time = common_times(runs);
    std::map<std::string, Series> names;
    for (const CaseData* run : runs) names.insert(run->series.begin(), run->series.end());
    for (const auto& entry : names) {
        Spread spread = spread_of(runs, entry.first, pooled.time.size());
        pooled.series[entry.first] = std::move(spread.mean);
        pooled.low[entry.first] = std::move(spread.low);
        pooled.high[entry.first] = std::move(spread.high);
    }
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    for (std::size_t k = 1; k < runs.size(); ++k) {
        const Migration& more = runs[k]->migration;
        append(pooled.migration.path_length, more.path_length);
        append(pooled.migration.layer, more.layer);
        append(pooled.trapped.way_out, runs[k]->trapped.way_out);
    }
    return pooled;
}

}  // namespace

std::vector<CaseData> pool_repeats(const std::vector<CaseData>& cases)
{
    std::vector<std::vector<const CaseData*>> groups;
    for (const CaseData& data : cases) {
        const auto known = std::ranges::find_if(groups, [&](const auto& group) { return !data.label.empty() && group.front()->label == data.label; });
        if (known == groups.end()) groups.push_back({&data});
        else known->push_back(&data);
    }
    std::vector<CaseData> pooled;
    for (const auto& group : groups) pooled.push_back(group.size() == 1 ? *group.front() : pool(group));
    return pooled;
}

}  // namespace coral::report
