#include "suffusion/results.h"

#include <algorithm>

#include "core/error.h"
#include "core/formats.h"
#include "core/hdf5.h"

namespace coral::suffusion {

namespace {

void write_column(H5File& h5, const std::string& group, const Column& column, std::vector<std::size_t> dims)
{
    const std::string path = group + "/" + column.name;
    if (column.width > 1) dims.push_back(column.width);
    h5.write(path, std::span<const double>(column.values), std::move(dims));
    h5.set_attribute(path, "unit", column.unit);
}

Column read_column(const H5File& h5, const std::string& group, const std::string& name, std::size_t plain_rank)
{
    const std::string path = group + "/" + name;
    const std::vector<std::size_t> dims = h5.dims(path);
    return {name, h5.string_attribute(path, "unit"), dims.size() > plain_rank ? std::max<std::size_t>(dims.back(), 1) : 1, h5.read_doubles(path)};
}

void write_trapped(H5File& h5, const std::vector<Trapped>& trapped)
{
    std::vector<std::int64_t> fine, grain, enclosed;
    std::vector<double> since, throat;
    for (const Trapped& t : trapped) {
        fine.push_back(t.fine);
        grain.push_back(t.grain);
        enclosed.push_back(t.enclosed);
        since.push_back(t.since);
        throat.push_back(t.throat);
    }
    const std::size_t n = trapped.size();
    h5.write("/trapped/fine", std::span<const std::int64_t>(fine), {n});
    h5.write("/trapped/grain", std::span<const std::int64_t>(grain), {n});
    h5.write("/trapped/enclosed", std::span<const std::int64_t>(enclosed), {n});
    h5.write("/trapped/since", std::span<const double>(since), {n});
    h5.set_attribute("/trapped/since", "unit", "s");
    h5.write("/trapped/throat", std::span<const double>(throat), {n});
    h5.set_attribute("/trapped/throat", "unit", "m");
}

std::vector<Trapped> read_trapped(const H5File& h5)
{
    if (!h5.exists("/trapped/fine")) return {};
    const auto fine = h5.read_integers("/trapped/fine"), grain = h5.read_integers("/trapped/grain"), enclosed = h5.read_integers("/trapped/enclosed");
    const auto since = h5.read_doubles("/trapped/since");
    // Results of before have no throats; a run that goes on finds them at its next output.
    const auto throat = h5.exists("/trapped/throat") ? h5.read_doubles("/trapped/throat") : std::vector<double>(fine.size(), 0.0);
    if (grain.size() != fine.size() || enclosed.size() != fine.size() || since.size() != fine.size() || throat.size() != fine.size())
        throw Error(h5.path().string() + ":/trapped", "has columns of different length", "run suffuse again");
    std::vector<Trapped> trapped;
    for (std::size_t i = 0; i < fine.size(); ++i) trapped.push_back({fine[i], grain[i], enclosed[i] != 0, since[i], throat[i]});
    return trapped;
}

}  // namespace

std::size_t Results::rows() const { return series.empty() ? 0 : series.front().values.size() / series.front().width; }

Column& Results::column(const std::string& name)
{
    for (Column& c : series)
        if (c.name == name) return c;
    series.push_back({name, "", 1, {}});
    return series.back();
}

void Results::truncate(std::size_t count)
{
    for (Column& c : series) c.values.resize(std::min(c.values.size(), count * c.width));
    for (Column& c : trajectories) c.values.resize(std::min(c.values.size(), count * tracked.size() * c.width));
}

void write_results(const std::filesystem::path& file, const Results& results)
{
    H5File h5 = H5File::create(file);
    h5.set_format(file_format::results);
    const std::size_t rows = results.rows(), bodies = results.tracked.size();
    // By name, so that the file does not depend on whether the run was resumed.
    std::vector<const Column*> series;
    for (const Column& column : results.series) series.push_back(&column);
    std::ranges::sort(series, {}, [](const Column* c) { return c->name; });
    for (const Column* column : series) write_column(h5, "/series", *column, {rows});
    h5.write("/trajectories/id", std::span<const std::int64_t>(results.tracked), {bodies});
    for (const Column& column : results.trajectories) write_column(h5, "/trajectories", column, {rows, bodies});
    const std::size_t fines = results.fines.size();
    h5.write("/migration/id", std::span<const std::int64_t>(results.fines), {fines});
    h5.write("/migration/path_length", std::span<const double>(results.path_length), {fines});
    h5.write("/migration/net_displacement", std::span<const double>(results.net_displacement), {fines});
    for (const char* name : {"path_length", "net_displacement"}) h5.set_attribute(std::string("/migration/") + name, "unit", "m");
    h5.write("/migration/layer", std::span<const std::int64_t>(results.layer), {fines});
    h5.write("/migration/eroded", std::span<const std::int64_t>(results.eroded), {fines});
    h5.write("/migration/state", std::span<const std::int64_t>(results.state), {fines});
    h5.write("/migration/cloggings", std::span<const std::int64_t>(results.cloggings), {fines});
    write_trapped(h5, results.trapped);
    for (const Measure& m : results.performance) {
        h5.write("/performance/" + m.name, std::span<const double>(&m.value, 1), {1});
        h5.set_attribute("/performance/" + m.name, "unit", m.unit);
    }
    h5.set_attribute("/", "history", results.history);
    const std::string text[] = {results.case_text};
    h5.write("/case", std::span<const std::string>(text));
    h5.commit();
}

Results read_results(const std::filesystem::path& file)
{
    const H5File h5 = H5File::open(file);
    h5.require_format(file_format::results);
    if (!h5.exists("/series/time") || !h5.exists("/trajectories/id"))
        throw Error(file.string(), "holds no /series/time: it is not a results file", "run suffuse without --resume to start anew");
    Results results;
    results.series.push_back(read_column(h5, "/series", "time", 1));
    for (const std::string& name : h5.members("/series"))
        if (name != "time") results.series.push_back(read_column(h5, "/series", name, 1));
    results.tracked = h5.read_integers("/trajectories/id");
    for (const std::string& name : h5.members("/trajectories"))
        if (name != "id") results.trajectories.push_back(read_column(h5, "/trajectories", name, 2));
    results.fines = h5.read_integers("/migration/id");
    results.path_length = h5.read_doubles("/migration/path_length");
    results.net_displacement = h5.read_doubles("/migration/net_displacement");
    results.layer = h5.read_integers("/migration/layer");
    results.eroded = h5.read_integers("/migration/eroded");
    if (h5.exists("/migration/state")) results.state = h5.read_integers("/migration/state");
    if (h5.exists("/migration/cloggings")) results.cloggings = h5.read_integers("/migration/cloggings");
    results.trapped = read_trapped(h5);
    for (const std::string& name : h5.members("/performance"))
        results.performance.push_back({name, h5.string_attribute("/performance/" + name, "unit"), h5.read_doubles("/performance/" + name).at(0)});
    if (h5.has_attribute("/", "history")) results.history = h5.string_attribute("/", "history");
    if (h5.exists("/case")) results.case_text = h5.read_strings("/case").at(0);
    return results;
}

}  // namespace coral::suffusion
