// Parts of sample.h5 that the report shows, and the history that results.h5 carries.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/error.h"
#include "core/formats.h"
#include "core/hdf5.h"
#include "dem/polyhedron.h"
#include "report/detail/read.h"

namespace coral::report::detail {
namespace {

double number_or(const H5File& file, const std::string& path, const std::string& name, double otherwise)
{
    return file.has_attribute(path, name) ? file.number_attribute(path, name) : otherwise;
}

std::vector<Body> bodies_of(const H5File& file)
{
    std::vector<Body> bodies;
    const auto shape = file.read_integers("/particles/shape");
    const auto scale = file.read_doubles("/particles/scale");
    const auto role = file.read_strings("/particles/role");
    if (scale.size() != shape.size() || role.size() != shape.size())
        throw Error(file.path().string() + ":/particles", "shape, scale and role differ in length", "pack the sample again");
    for (std::size_t i = 0; i < shape.size(); ++i) {
        const std::string group = "/shapes/" + std::to_string(shape[i]);
        bodies.push_back({role[i], shape[i], scale[i], scale[i] * number_or(file, group, "equivalent_diameter", 0)});
    }
    return bodies;
}

void read_criteria(const H5File& file, CaseData& data)
{
    if (!file.exists("/criteria/name")) return;
    const auto name = file.read_strings("/criteria/name"), verdict = file.read_strings("/criteria/verdict");
    const auto value = file.read_doubles("/criteria/value"), threshold = file.read_doubles("/criteria/threshold");
    const std::size_t count = std::min({name.size(), verdict.size(), value.size(), threshold.size()});
    const auto definition = file.exists("/criteria/definition") ? file.read_strings("/criteria/definition") : std::vector<std::string>(count);
    for (std::size_t i = 0; i < count; ++i)
        data.criteria.push_back({name[i], value[i], threshold[i], verdict[i], i < definition.size() ? definition[i] : std::string()});
}

void read_gradation(const H5File& file, CaseData& data)
{
    if (!file.exists("/psd/size") || !file.exists("/psd/passing")) return;
    data.psd_diameter = file.read_doubles("/psd/size");
    data.psd_passing = file.read_doubles("/psd/passing");
    if (data.psd_passing.size() == data.psd_diameter.size()) return;
    data.psd_diameter.clear();
    data.psd_passing.clear();
    data.notes.push_back("/psd of the sample has columns of different length and was left out.");
}

/// What the packing tells about itself, as lines of the set-up table.
void read_statistics(const H5File& file, CaseData& data)
{
    static const std::pair<const char*, const char*> lines[] = {
        {"porosity", "Porosity"}, {"interparticle_porosity", "Porosity between the grains"}, {"fines_content", "Fines content by mass"},
        {"gap_ratio", "Gap ratio"}, {"mean_pressure", "Mean pressure on the walls of the packing [Pa]"}};
    for (const auto& [name, label] : lines) {
        const double value = number_or(file, "/statistics", name, NAN);
        char text[32];
        std::snprintf(text, sizeof text, "%.4g", value);
        if (std::isfinite(value)) data.setup.push_back({label, text});
    }
}

}  // namespace

void read_sample(const std::filesystem::path& path, CaseData& data)
{
    try {
        const H5File file = H5File::open(path);
        file.require_format(file_format::sample);
        std::vector<Body> bodies = bodies_of(file);
        const auto fine = static_cast<std::size_t>(std::ranges::count(bodies, "fine", &Body::role));
        const auto of_case = static_cast<std::size_t>(std::ranges::count(data.bodies, "fine", &Body::role)), run = data.migration.id.size();
        if (run > 0 && fine + of_case != run) {
            data.notes.push_back("The sample that lies beside the results is another one than the run's (" + std::to_string(fine + of_case) + " fines, not " + std::to_string(run) +
                                 ") and was left out; run suffuse again.");
            return;
        }
        data.setup.push_back({"Grains of the sample", std::to_string(bodies.size() - fine) + " coarse, " + std::to_string(fine) + " fine"});
        data.bodies.insert(data.bodies.begin(), std::make_move_iterator(bodies.begin()), std::make_move_iterator(bodies.end()));
        data.sample = path;
        read_criteria(file, data);
        read_gradation(file, data);
        read_statistics(file, data);
    } catch (const Error& error) {
        data.notes.push_back("The sample could not be read: " + std::string(error.what()));
    }
}

Lattice read_lattice(const std::filesystem::path& sample, std::int64_t shape)
{
    Lattice lattice;
    const H5File file = H5File::open(sample);
    const std::string path = "/shapes/" + std::to_string(shape) + "/distance";
    if (!file.exists(path)) return lattice;
    const auto dims = file.dims(path);
    const auto origin = file.numbers_attribute(path, "origin");
    if (dims.size() != 3 || origin.size() != 3) throw Error(sample.string() + ":" + path, "is no lattice", "pack the sample again");
    lattice.size = {static_cast<int>(dims[2]), static_cast<int>(dims[1]), static_cast<int>(dims[0])};
    lattice.origin = {origin[0], origin[1], origin[2]};
    lattice.spacing = file.number_attribute(path, "spacing");
    lattice.distance = file.read_floats(path);
    return lattice;
}

Mesh read_polyhedron(const std::filesystem::path& sample, std::int64_t shape)
{
    Mesh mesh;
    const H5File file = H5File::open(sample);
    const std::string path = "/shapes/" + std::to_string(shape) + "/vertices";
    if (!file.exists(path)) return mesh;
    const auto numbers = file.read_doubles(path);
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
    const dem::Polyhedron polyhedron(points, path);
    // Corners of their own for every face, so that edges stay sharp where normals are averaged.
    for (const std::vector<int>& face : polyhedron.faces()) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const int v : face) mesh.vertices.push_back(polyhedron.vertices()[static_cast<std::size_t>(v)]);
        for (std::uint32_t k = 2; k < face.size(); ++k) mesh.triangles.push_back({first, first + k - 1, first + k});
    }
    return mesh;
}

void read_history(const H5File& file, CaseData& data)
{
    try {
        std::string text;
        if (file.has_attribute("/", "history")) text = file.string_attribute("/", "history");
        else if (file.exists("/history")) text = file.read_strings("/history").at(0);
        if (!text.empty()) data.history = history_from_json(text, file.path().string());
    } catch (const std::exception& error) {
        data.notes.push_back("The history could not be read: " + std::string(error.what()));
    }
}

}  // namespace coral::report::detail
