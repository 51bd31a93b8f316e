#include "report/case_data.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "core/formats.h"
#include "core/hdf5.h"
#include "core/output_file.h"
#include "core/text.h"
#include "report/detail/read.h"

namespace coral::report {
namespace {

namespace fs = std::filesystem;

std::string unit_of(const H5File& file, const std::string& path)
{
    return file.has_attribute(path, "unit") ? file.string_attribute(path, "unit") : std::string("1");
}

void read_series(const H5File& file, CaseData& data)
{
    const std::string where = file.path().string();
    if (!file.exists("/series/time"))
        throw Error(where, "holds no /series/time", "is it the results.h5 of a suffuse run?");
    data.time = file.read_doubles("/series/time");
    if (data.time.empty()) throw Error(where, "holds no output yet", "let suffuse run past its first output");
    for (const std::string& name : file.members("/series")) {
        if (name == "time") continue;
        const std::string path = "/series/" + name;
        const auto dims = file.dims(path);
        Series series;
        series.unit = unit_of(file, path);
        for (std::size_t i = 1; i < dims.size(); ++i) series.width *= dims[i];
        if (dims.empty() || dims[0] != data.time.size() || series.width == 0)
            throw Error(where + ":" + path, "has another number of times than /series/time", "run suffuse again");
        series.values = file.read_doubles(path);
        data.series.emplace(name, std::move(series));
    }
}

/// Dataset of `rows * width` numbers, or empty with a note when its size is another.
std::vector<double> optional_array(const H5File& file, const std::string& path, std::size_t count, CaseData& data)
{
    if (!file.exists(path)) return {};
    std::vector<double> values = file.read_doubles(path);
    if (values.size() == count) return values;
    data.notes.push_back(path + " of results.h5 has an unexpected size and was left out.");
    return {};
}

void read_tracks(const H5File& file, CaseData& data)
{
    if (!file.exists("/trajectories/id")) return;
    Tracks& tracks = data.tracks;
    tracks.id = file.read_integers("/trajectories/id");
    tracks.time = file.exists("/trajectories/time") ? file.read_doubles("/trajectories/time") : data.time;
    const std::size_t count = tracks.id.size() * tracks.time.size();
    tracks.position = optional_array(file, "/trajectories/position", 3 * count, data);
    tracks.orientation = optional_array(file, "/trajectories/orientation", 4 * count, data);
    tracks.speed = optional_array(file, "/trajectories/speed", count, data);
}

void read_migration(const H5File& file, CaseData& data)
{
    if (!file.exists("/migration/id")) return;
    Migration& migration = data.migration;
    migration.id = file.read_integers("/migration/id");
    const std::size_t count = migration.id.size();
    migration.path_length = optional_array(file, "/migration/path_length", count, data);
    migration.net_displacement = optional_array(file, "/migration/net_displacement", count, data);
    const auto flags = [&](const std::string& path) {
        std::vector<std::int64_t> values;
        if (file.exists(path)) values = file.read_integers(path);
        if (values.size() != count) values.clear();
        return values;
    };
    migration.layer = flags("/migration/layer");
    migration.eroded = flags("/migration/eroded");
    migration.state = flags("/migration/state");
    migration.cloggings = flags("/migration/cloggings");
}

void read_trapped(const H5File& file, CaseData& data)
{
    if (!file.exists("/trapped/fine")) return;
    TrappedFines& trapped = data.trapped;
    trapped.fine = file.read_integers("/trapped/fine");
    trapped.grain = file.read_integers("/trapped/grain");
    trapped.enclosed = file.read_integers("/trapped/enclosed");
    if (trapped.grain.size() == trapped.fine.size() && trapped.enclosed.size() == trapped.fine.size()) return;
    trapped = {};
    data.notes.push_back("/trapped of results.h5 has columns of different length and was left out.");
}

/// How the throats that fines came through (or cannot leave by) compare with them.
void compare_throats(const H5File& file, CaseData& data)
{
    if (!file.exists("/trapped/throat")) return;
    const std::vector<double> throat = file.read_doubles("/trapped/throat");
    const std::vector<std::int64_t>& fine = data.trapped.fine;
    for (std::size_t k = 0; k < std::min(throat.size(), fine.size()); ++k) {
        const auto body = static_cast<std::size_t>(fine[k]);
        if (body < data.bodies.size() && data.bodies[body].diameter > 0) data.trapped.way_out.push_back(throat[k] / data.bodies[body].diameter);
    }
}

/// Every number below a group as one line, sub-groups with their names in front.
void read_performance(const H5File& file, const std::string& group, const std::string& prefix, CaseData& data)
{
    for (const std::string& name : file.members(group)) {
        const std::string path = group + "/" + name;
        if (!file.members(path).empty()) {
            read_performance(file, path, prefix + name + ": ", data);
            continue;
        }
        std::string text;
        try {
            const std::vector<double> values = file.read_doubles(path);
            if (values.size() > 8) continue;  // a record over time, not a total
            for (double value : values) text += (text.empty() ? "" : ", ") + to_text(value);
        } catch (const Error&) {
            for (const std::string& value : file.read_strings(path)) text += (text.empty() ? "" : ", ") + value;
        }
        const std::string unit = unit_of(file, path);
        data.performance.push_back({prefix + name, unit == "1" ? text : text + " " + unit});
    }
}

}  // namespace

const Series* CaseData::find(const std::string& series_name) const
{
    const auto it = series.find(series_name);
    return it == series.end() ? nullptr : &it->second;
}

CaseData read_case(const fs::path& folder)
{
    if (!fs::is_directory(folder))
        throw UsageError(folder.string(), "no such case folder", "give the folder that make-case wrote");
    const fs::path results = folder / "results.h5";
    if (!fs::exists(results)) throw Error(folder.string(), "holds no results.h5", "run suffuse first: suffuse " + folder.string());

    CaseData data;
    data.folder = folder;
    fs::path named = fs::absolute(folder).lexically_normal();
    if (!named.has_filename()) named = named.parent_path();
    data.name = named.filename().string();
    const H5File file = H5File::open(results);
    file.require_format(file_format::results);
    read_series(file, data);
    read_tracks(file, data);
    read_migration(file, data);
    read_trapped(file, data);
    if (const Series* fines = data.find("fines_count")) data.layers = fines->width;
    read_performance(file, "/performance", "", data);
    detail::read_history(file, data);
    if (file.exists("/case")) data.case_toml = file.read_strings("/case").at(0);
    if (data.case_toml.empty() && fs::is_regular_file(folder / "case.toml")) data.case_toml = read_text_file(folder / "case.toml");
    detail::read_case_text(data);
    const bool named_sample = !data.sample.empty();
    const fs::path sample = folder / (named_sample ? data.sample : fs::path("sample.h5"));
    data.sample.clear();
    if (fs::is_regular_file(sample)) detail::read_sample(sample, data);
    else if (named_sample) data.notes.push_back("The sample " + sample.filename().string() + " that the case names is not there.");
    compare_throats(file, data);
    return data;
}

std::vector<CaseData> read_cases(const std::vector<fs::path>& folders)
{
    std::vector<CaseData> cases;
    for (const fs::path& given : folders) {
        const std::string text = given.string();
        const std::size_t sign = text.find('=');
        const bool labelled = sign != std::string::npos && sign > 0 && !fs::exists(given);
        cases.push_back(read_case(labelled ? fs::path(text.substr(sign + 1)) : given));
        if (labelled) cases.back().label = text.substr(0, sign);
    }
    std::map<std::string, int> count, labels;
    for (const CaseData& data : cases) ++count[data.name], ++labels[data.label];
    for (CaseData& data : cases) {
        const fs::path parent = fs::absolute(data.folder / ".").lexically_normal().parent_path().parent_path();
        if (!data.label.empty()) data.name = labels[data.label] > 1 ? data.label + " (" + data.name + ")" : data.label;
        else if (count[data.name] > 1) data.name = (parent.filename() / data.name).string();
    }
    // gnuplot ends a field of a csv at the first double quote or comma inside it, quoted or not.
    for (CaseData& data : cases)
        for (std::string* text : {&data.name, &data.label}) {
            std::ranges::replace(*text, '"', '\'');
            std::ranges::replace(*text, ',', ';');
        }
    std::set<std::string> seen;
    for (CaseData& data : cases) {
        const std::string name = data.name;
        for (int k = 2; !seen.insert(data.name).second; ++k) data.name = name + " (" + std::to_string(k) + ")";
    }
    return cases;
}

std::vector<std::string> column_names(const std::string& series, std::size_t width)
{
    if (width == 1) return {series};
    static const char* const layers[] = {"bottom", "middle", "top"};
    static const char* const axes[] = {"x", "y", "z"};
    static const char* const pairs[] = {"xx", "yy", "zz", "xy", "xz", "yz"};
    std::vector<std::string> names;
    for (std::size_t i = 0; i < width; ++i) {
        std::string suffix = std::to_string(i + 1);
        if (width == 3) suffix = series == "fines_count" ? layers[i] : axes[i];
        if (width == 6 && series == "contact_fabric") suffix = pairs[i];
        names.push_back(series + "_" + suffix);
    }
    return names;
}

}  // namespace coral::report
