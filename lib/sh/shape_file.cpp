#include "sh/shape_file.h"

#include <algorithm>

#include "core/error.h"
#include "core/formats.h"
#include "core/hdf5.h"

namespace coral::sh {
namespace {

constexpr const char* convention =
    "r(u) = sum c_k Y_k(u) in metres about `centre`; Y real, orthonormal over the unit sphere, without Condon-Shortley phase; "
    "k = l(l+1)+m; cos(m phi) for m > 0, sin(|m| phi) for m < 0; `scale` is the volume factor the coefficients already hold";

/// The errors of a record by attribute name, for both directions.
struct NamedError {
    const char* name;
    double FitErrors::*value;
};
constexpr NamedError named_errors[] = {
    {"rms_error", &FitErrors::rms_error},         {"max_error", &FitErrors::max_error},
    {"volume_error", &FitErrors::volume_error},   {"area_error", &FitErrors::area_error},
    {"inertia_error", &FitErrors::inertia_error}, {"centroid_shift", &FitErrors::centroid_shift},
    {"non_star_fraction", &FitErrors::non_star_fraction},
};

ShapeRecord read_shape(const H5File& file, const std::string& group, int id)
{
    const std::string where = file.path().string() + ":" + group;
    ShapeRecord shape;
    shape.id = id;
    shape.surface.coefficients = file.read_doubles(group + "/coefficients");
    shape.surface.degree = int(std::clamp<std::int64_t>(file.integer_attribute(group, "degree"), -1, 1000));
    if (shape.surface.degree < 0 || shape.surface.degree > 200 || int(shape.surface.coefficients.size()) != coefficient_count(shape.surface.degree))
        throw Error(where, std::to_string(shape.surface.coefficients.size()) + " coefficients do not fit degree " + std::to_string(shape.surface.degree),
                    "write the file again with ls2sh");
    const std::vector<double> centre = file.numbers_attribute(group, "centre");
    if (centre.size() != 3) throw Error(where, "attribute centre does not hold three numbers", "write the file again with ls2sh");
    shape.surface.centre = Eigen::Vector3d(centre[0], centre[1], centre[2]);
    shape.surface.scale = file.number_attribute(group, "scale");
    shape.surface.method = file.string_attribute(group, "method");
    if (file.has_attribute(group, "name")) shape.name = file.string_attribute(group, "name");
    shape.volume = file.number_attribute(group, "volume");
    shape.solid_volume = file.number_attribute(group, "solid_volume");
    shape.equivalent_diameter = file.number_attribute(group, "equivalent_diameter");
    for (const NamedError& error : named_errors) shape.errors.*error.value = file.number_attribute(group, error.name);
    return shape;
}

}  // namespace

void write_shapes(const std::filesystem::path& path, std::span<const ShapeRecord> shapes, const History& history)
{
    H5File file = H5File::create(path);
    file.set_attribute("/", "content", "coralsand harmonic shapes");
    file.set_format(file_format::shapes);
    file.set_attribute("/", "convention", convention);
    file.set_attribute("/", "history", to_json(history));
    file.make_group("/shapes");
    std::vector<const ShapeRecord*> order;
    for (const ShapeRecord& shape : shapes) order.push_back(&shape);
    std::sort(order.begin(), order.end(), [](const ShapeRecord* a, const ShapeRecord* b) { return a->id < b->id; });
    for (const ShapeRecord* shape : order) {
        const std::string group = "/shapes/" + std::to_string(shape->id);
        file.write(group + "/coefficients", std::span<const double>(shape->surface.coefficients), {shape->surface.coefficients.size()});
        file.set_attribute(group, "degree", std::int64_t(shape->surface.degree));
        file.set_attribute(group, "centre", std::span<const double>(shape->surface.centre.data(), 3));
        file.set_attribute(group, "scale", shape->surface.scale);
        file.set_attribute(group, "method", shape->surface.method);
        if (!shape->name.empty()) file.set_attribute(group, "name", shape->name);
        file.set_attribute(group, "volume", shape->volume);
        file.set_attribute(group, "solid_volume", shape->solid_volume);
        file.set_attribute(group, "equivalent_diameter", shape->equivalent_diameter);
        for (const NamedError& error : named_errors) file.set_attribute(group, error.name, shape->errors.*error.value);
    }
    file.commit();
}

ShapeFile read_shapes(const std::filesystem::path& path)
{
    const H5File file = H5File::open(path);
    file.require_format(file_format::shapes);
    if (!file.exists("/shapes") || !file.has_attribute("/", "history")) throw Error(path.string(), "holds no /shapes of ours", "make it with ls2sh");
    ShapeFile result;
    result.history = history_from_json(file.string_attribute("/", "history"), path.string());
    for (const std::string& name : file.members("/shapes")) {
        if (name.empty() || name.size() > 9 || name.find_first_not_of("0123456789") != std::string::npos)
            throw Error(path.string(), "/shapes/" + name + " is no shape number", "write the file again with ls2sh");
        result.shapes.push_back(read_shape(file, "/shapes/" + name, std::stoi(name)));
    }
    std::sort(result.shapes.begin(), result.shapes.end(), [](const ShapeRecord& a, const ShapeRecord& b) { return a.id < b.id; });
    return result;
}

}  // namespace coral::sh
