#include "suffusion/performance.h"

#include "core/parallel.h"

namespace coral::suffusion {

std::vector<Measure> performance_of(const Simulation& simulation, std::span<const Measure> earlier)
{
    std::vector<Measure> measures;
    const auto value = [&](const char* name) {
        for (const Measure& m : measures)
            if (m.name == name) return m.value;
        return 0.0;
    };
    const auto count = [&](const char* name, const char* unit, double now) {
        for (const Measure& m : earlier)
            if (m.name == name) now += m.value;
        measures.push_back({name, unit, now});
    };
    const Timing& t = simulation.timing();
    const dem::Counters& dem = simulation.scene().world.counters();
    double cells = 0;
    if (simulation.has_flow()) {
        const fluid::FlowTimes& f = simulation.flow().times();
        cells = static_cast<double>(simulation.flow().grid().cell_count());
        count("seconds_predictor", "s", f.predictor);
        count("seconds_poisson", "s", f.poisson);
        count("seconds_correction", "s", f.correction);
        count("seconds_grains", "s", t.grains);
        count("seconds_fines", "s", t.fines);
        count("seconds_flow", "s", t.flow + t.grains + t.fines);
    }
    count("seconds_contact", "s", t.contact);
    count("seconds_contact_pairs", "s", dem.seconds_pairs);
    count("seconds_contact_integration", "s", dem.seconds_integration);
    count("seconds_contact_lists", "s", dem.seconds_lists);
    count("seconds_setup", "s", t.setup);
    count("seconds_output", "s", t.output);
    count("flow_steps", "1", simulation.has_flow() ? static_cast<double>(simulation.flow().times().steps) : 0);
    count("dem_steps", "1", static_cast<double>(dem.steps));
    count("contacts", "1", static_cast<double>(dem.contacts));
    count("node_tests", "1", static_cast<double>(dem.node_tests));
    count("pair_tests", "1", static_cast<double>(dem.pair_tests));
    measures.push_back({"cells", "1", cells});
    measures.push_back({"threads", "1", static_cast<double>(thread_count())});
    const double flow_seconds = value("seconds_flow"), contact_seconds = value("seconds_contact"), pair_seconds = value("seconds_contact_pairs");
    const double flow_steps = value("flow_steps"), dem_steps = value("dem_steps");
    if (flow_steps > 0) measures.push_back({"milliseconds_per_flow_step", "ms", 1e3 * flow_seconds / flow_steps});
    if (flow_seconds > 0) measures.push_back({"cells_per_second", "s-1", cells * flow_steps / flow_seconds});
    if (dem_steps > 0) measures.push_back({"milliseconds_per_dem_step", "ms", 1e3 * contact_seconds / dem_steps});
    if (pair_seconds > 0) {
        measures.push_back({"contacts_per_second", "s-1", value("contacts") / pair_seconds});
        measures.push_back({"node_tests_per_second", "s-1", value("node_tests") / pair_seconds});
    }
    return measures;
}

}  // namespace coral::suffusion
