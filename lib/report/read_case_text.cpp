// Set-up of a run as its case.toml states it. The solver checks that file; here a value that cannot be read is left out.
#include <Eigen/Core>
#include <cmath>

#include "core/config.h"
#include "core/error.h"
#include "core/text.h"
#include "report/detail/read.h"

namespace coral::report::detail {
namespace {

using Eigen::Vector3d;

std::string quantity_text(double value, Dimension dimension) { return format_quantity(value, dimension); }

/// One line of the set-up table when the key is there.
void add_quantity(const ConfigTable& table, const std::string& key, Dimension dimension, const std::string& label, CaseData& data)
{
    if (!table.has(key)) return;
    if (table.is_string(key) && table.string(key) == "auto") {
        data.setup.push_back({label, "automatic"});
        return;
    }
    data.setup.push_back({label, quantity_text(table.quantity(key, dimension, 0.0), dimension)});
}

std::string vector_text(const Vector3d& v, Dimension dimension)
{
    const std::string unit(si_unit(dimension));
    return "(" + to_text(v.x()) + ", " + to_text(v.y()) + ", " + to_text(v.z()) + ") " + unit;
}

void read_domain(const ConfigTable& root, CaseData& data)
{
    if (!root.has("domain")) return;
    const ConfigTable domain = root.table("domain");
    const Vector3d origin = domain.vector("origin", Dimension::length, Vector3d::Zero());
    const Vector3d size = domain.vector("size", Dimension::length, Vector3d::Zero());
    for (int k = 0; k < 3; ++k) {
        data.domain_origin[k] = origin[k];
        data.domain_size[k] = size[k];
    }
    const auto times = [](double a, double b, double c, Dimension d) {
        return quantity_text(a, d) + " × " + quantity_text(b, d) + " × " + quantity_text(c, d);
    };
    data.setup.push_back({"Domain", times(size.x(), size.y(), size.z(), Dimension::length)});
    const double cell = domain.quantity("cell", Dimension::length, 0.0);
    if (cell <= 0) return;
    std::string cells;
    for (int k = 0; k < 3; ++k) cells += (k ? " × " : "") + std::to_string(std::lround(size[k] / cell));
    data.setup.push_back({"Fluid cells", cells + " of " + quantity_text(cell, Dimension::length)});
}

void read_boundary(const ConfigTable& root, CaseData& data)
{
    if (!root.has("boundary")) return;
    const ConfigTable boundary = root.table("boundary");
    for (const std::string& face : boundary.keys()) {
        const ConfigTable condition = boundary.table(face);
        std::string text = condition.string("type", "?");
        if (condition.has("velocity")) text += ", velocity " + vector_text(condition.vector("velocity", Dimension::velocity, Vector3d::Zero()), Dimension::velocity);
        if (condition.has("pressure")) text += ", pressure " + quantity_text(condition.quantity("pressure", Dimension::pressure, 0.0), Dimension::pressure);
        data.setup.push_back({"Face " + face, text});
    }
}

void read_fluid_and_grains(const ConfigTable& root, CaseData& data)
{
    if (root.has("fluid")) {
        const ConfigTable fluid = root.table("fluid");
        add_quantity(fluid, "density", Dimension::density, "Fluid density", data);
        add_quantity(fluid, "kinematic_viscosity", Dimension::kinematic_viscosity, "Kinematic viscosity", data);
    }
    if (root.has("gravity"))
        data.setup.push_back({"Gravity", vector_text(root.table("gravity").vector("vector", Dimension::acceleration, Vector3d(0, 0, -9.81)), Dimension::acceleration)});
    if (!root.has("material")) return;
    const ConfigTable materials = root.table("material");
    for (const std::string& name : materials.keys()) {
        const ConfigTable material = materials.table(name);
        const std::string of = name == "default" ? "" : " (" + name + ")";
        add_quantity(material, "density", Dimension::density, "Grain density" + of, data);
        add_quantity(material, "normal_stiffness", Dimension::stiffness, "Normal stiffness" + of, data);
        add_quantity(material, "tangential_stiffness", Dimension::stiffness, "Tangential stiffness" + of, data);
        add_quantity(material, "friction", Dimension::number, "Friction coefficient" + of, data);
        add_quantity(material, "damping", Dimension::number, "Damping" + of, data);
    }
}

void read_walls_and_bodies(const ConfigTable& root, CaseData& data)
{
    for (const ConfigTable& wall : root.tables("wall")) {
        if (wall.string("type", "") != "plate") continue;
        const Plate plate{wall.quantity("z", Dimension::length, 0.0), wall.quantity("hole", Dimension::length, 0.0),
                          wall.quantity("pitch", Dimension::length, 0.0)};
        data.plates.push_back(plate);
        data.setup.push_back({"Filter plate", "square holes of " + quantity_text(plate.hole, Dimension::length) + " every " +
                                                  quantity_text(plate.pitch, Dimension::length) + ", at z = " + quantity_text(plate.z, Dimension::length)});
    }
    for (const ConfigTable& entry : root.tables("body")) {
        const ConfigTable shape = entry.table("shape");
        Body body;
        body.role = entry.string("role", "coarse");
        body.diameter = shape.quantity("diameter", Dimension::length, 0.0) * entry.quantity("scale", Dimension::number, 1.0);
        data.bodies.push_back(body);
    }
}

}  // namespace

void read_case_text(CaseData& data)
{
    if (data.case_toml.empty()) return;
    try {
        const Config config = Config::from_text(data.case_toml, "case.toml");
        const ConfigTable& root = config.root();
        data.sample = root.string("sample", "");
        read_domain(root, data);
        read_boundary(root, data);
        read_fluid_and_grains(root, data);
        read_walls_and_bodies(root, data);
        if (root.has("time")) {
            const ConfigTable time = root.table("time");
            data.duration = time.quantity("duration", Dimension::time, 0.0);
            add_quantity(time, "duration", Dimension::time, "Duration", data);
            add_quantity(time, "dem_step", Dimension::time, "DEM step", data);
            add_quantity(time, "cfl", Dimension::number, "Courant number of the flow step", data);
        }
    } catch (const Error& error) {
        data.notes.push_back("The set-up could not be read: " + std::string(error.what()));
    }
}

}  // namespace coral::report::detail
