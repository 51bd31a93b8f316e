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
    // Watches start anew in each part of a run; counters are part of the state that a checkpoint brings back.
    const auto add_watch = [&](const char* name, double now) {
        for (const Measure& m : earlier)
            if (m.name == name) now += m.value;
        measures.push_back({name, "s", now});
    };
    const Timing& t = simulation.timing();
    const dem::Counters& dem = simulation.scene().world.counters();
    double cells = 0;
    if (simulation.has_flow()) {
        const fluid::FlowTimes& f = simulation.flow().times();
        cells = static_cast<double>(simulation.flow().grid().cell_count());
        add_watch("seconds_predictor", f.predictor);
        add_watch("seconds_poisson", f.poisson);
        add_watch("seconds_correction", f.correction);
        add_watch("seconds_grains", t.grains);
        add_watch("seconds_fines", t.fines);
        add_watch("seconds_flow", t.flow + t.grains + t.fines);
    }
    add_watch("seconds_contact", t.contact);
    measures.push_back({"seconds_contact_pairs", "s", dem.seconds_pairs});
    measures.push_back({"seconds_contact_integration", "s", dem.seconds_integration});
    measures.push_back({"seconds_contact_lists", "s", dem.seconds_lists});
    add_watch("seconds_setup", t.setup);
    add_watch("seconds_output", t.output);
    measures.push_back({"flow_steps", "1", simulation.has_flow() ? static_cast<double>(simulation.flow().times().steps) : 0});
    measures.push_back({"dem_steps", "1", static_cast<double>(dem.steps)});
    measures.push_back({"contacts", "1", static_cast<double>(dem.contacts)});
    measures.push_back({"node_tests", "1", static_cast<double>(dem.node_tests)});
    measures.push_back({"pair_tests", "1", static_cast<double>(dem.pair_tests)});
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
