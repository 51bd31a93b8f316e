#include "suffusion/frame_writer.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "suffusion/frames.h"
#include "suffusion/slices.h"

namespace coral::suffusion {

namespace fs = std::filesystem;
using Eigen::Vector3d;

namespace {

constexpr int slice_pixels = 600;

std::string file_name(const char* kind, std::size_t number, const char* extension) { return fmt::format("{}_{:05}.{}", kind, number, extension); }

void add(FrameArray& array, const Vector3d& v)
{
    for (int axis = 0; axis < 3; ++axis) array.values.push_back(static_cast<float>(v[axis]));
}

}  // namespace

FrameWriter::FrameWriter(const Simulation& simulation)
    : interval_(simulation.scene().description.output.frames), duration_(simulation.scene().description.time.duration)
{
    if (!(interval_ > 0)) return;
    if (simulation.has_flow()) {
        slice_row_ = slice_row(simulation);
        regions_.emplace(simulation.scene());
    }
    const dem::World& world = simulation.scene().world;
    for (int body = 0; body < world.body_count(); ++body) {
        const std::size_t shape = static_cast<std::size_t>(world.shape_id(body));
        if (shape >= surfaces_.size()) surfaces_.resize(shape + 1);
        if (surfaces_[shape].polygons.empty()) surfaces_[shape] = viewing_surface(world.shape(body));
        any_surface_ = any_surface_ || !surfaces_[shape].polygons.empty();
    }
}

void FrameWriter::clear() const
{
    std::error_code ignored;
    if (!fs::is_directory(folder_)) return;
    std::vector<fs::path> old;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_, ignored)) {
        const std::string extension = entry.path().extension().string(), name = entry.path().filename().string();
        if ((extension == ".vti" || extension == ".vtu" || extension == ".pvd" || extension == ".png") && (name.starts_with("fluid") || name.starts_with("slice") || name.starts_with("bodies") || name.starts_with("surfaces"))) old.push_back(entry.path());
    }
    for (const fs::path& file : old) fs::remove(file, ignored);
}

void FrameWriter::resume(std::size_t count)
{
    times_.clear();
    for (std::size_t i = 0; i < count; ++i) times_.push_back(std::min(static_cast<double>(i) * interval_, duration_));
}

void FrameWriter::write_bodies(const Simulation& simulation, const std::string& name) const
{
    const Scene& scene = simulation.scene();
    std::vector<Vector3d> positions;
    std::array<FrameArray, 8> arrays{{{"id", 1, {}}, {"radius", 1, {}}, {"shape", 1, {}}, {"role", 1, {}}, {"eroded", 1, {}}, {"velocity", 3, {}}, {"angular_velocity", 3, {}}, {"fluid_force", 3, {}}}};
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const int body = static_cast<int>(i);
        if (!scene.world.active(body)) continue;
        positions.push_back(scene.world.position(body));
        arrays[0].values.push_back(static_cast<float>(i));
        arrays[1].values.push_back(static_cast<float>(scene.world.equivalent_radius(body)));
        arrays[2].values.push_back(static_cast<float>(scene.world.shape_id(body)));
        arrays[3].values.push_back(scene.bodies[i].coarse ? 0.f : scene.bodies[i].fine ? 1.f : 2.f);
        arrays[4].values.push_back(simulation.eroded(i) ? 1.f : 0.f);
        add(arrays[5], scene.world.velocity(body));
        add(arrays[6], scene.world.angular_velocity(body));
        add(arrays[7], simulation.fluid_force(i));
    }
    write_points(folder_ / name, positions, arrays);
}

void FrameWriter::write_surfaces(const Simulation& simulation, const std::string& name) const
{
    const dem::World& world = simulation.scene().world;
    std::vector<Vector3d> positions;
    std::vector<std::vector<int>> polygons;
    std::array<FrameArray, 3> arrays{{{"id", 1, {}}, {"shape", 1, {}}, {"velocity", 3, {}}}};
    for (int body = 0; body < world.body_count(); ++body) {
        if (!world.active(body)) continue;
        const Surface& surface = surfaces_[static_cast<std::size_t>(world.shape_id(body))];
        const int first = static_cast<int>(positions.size());
        for (const Vector3d& v : surface.vertices) positions.push_back(world.position(body) + world.orientation(body) * (world.scale(body) * v));
        for (std::vector<int> polygon : surface.polygons) {
            for (int& v : polygon) v += first;
            polygons.push_back(std::move(polygon));
            arrays[0].values.push_back(static_cast<float>(body));
            arrays[1].values.push_back(static_cast<float>(world.shape_id(body)));
            add(arrays[2], world.velocity(body));
        }
    }
    write_polygons(folder_ / name, positions, polygons, arrays);
}

void FrameWriter::write_fluid(const Simulation& simulation, const std::string& name) const
{
    const fluid::Flow& flow = simulation.flow();
    const fluid::GridSpec& grid = flow.grid();
    std::array<FrameArray, 4> arrays{{{"velocity", 3, {}}, {"pressure", 1, {}}, {"void_fraction", 1, {}}, {"solid_fraction", 1, {}}}};
    for (FrameArray& a : arrays) a.values.reserve(static_cast<std::size_t>(a.width) * grid.cell_count());
    for (int k = 0; k < grid.cells.z(); ++k)
        for (int j = 0; j < grid.cells.y(); ++j)
            for (int i = 0; i < grid.cells.x(); ++i) {
                const std::size_t at = flow.layout().index(i, j, k);
                add(arrays[0], flow.cell_velocity(i, j, k));
                arrays[1].values.push_back(static_cast<float>(flow.options().density * flow.pressure()[at]));
                arrays[2].values.push_back(flow.porous() ? static_cast<float>(flow.porous_fields().void_fraction[at]) : 1.f);
                arrays[3].values.push_back(static_cast<float>(simulation.solid_fraction(at)));
            }
    write_image(folder_ / name, grid.origin, grid.cell, grid.cells, arrays);
}

void FrameWriter::write(const Simulation& simulation)
{
    std::error_code failed;
    fs::create_directories(folder_, failed);
    if (failed) throw Error(folder_.string(), "cannot be made: " + failed.message(), "choose a folder that can be written");
    const std::size_t number = times_.size();
    times_.push_back(simulation.time());
    std::vector<std::string> bodies, surfaces, fluids, slices;
    for (std::size_t i = 0; i < times_.size(); ++i) {
        bodies.push_back(file_name("bodies", i, "vtu"));
        surfaces.push_back(file_name("surfaces", i, "vtu"));
        fluids.push_back(file_name("fluid", i, "vti"));
        slices.push_back(file_name("slice", i, "vti"));
    }
    if (!simulation.scene().bodies.empty()) {
        write_bodies(simulation, bodies[number]);
        write_collection(folder_ / "bodies.pvd", times_, bodies);
    }
    if (any_surface_) {
        write_surfaces(simulation, surfaces[number]);
        write_collection(folder_ / "surfaces.pvd", times_, surfaces);
    }
    if (!simulation.has_flow()) return;
    write_fluid(simulation, fluids[number]);
    write_collection(folder_ / "fluid.pvd", times_, fluids);
    write_slice(folder_ / slices[number], simulation, *regions_, slice_row_);
    pack::write_png(draw_slice(simulation, slice_row_, slice_pixels), folder_ / file_name("slice", number, "png"));
    write_collection(folder_ / "slice.pvd", times_, slices);
}

}  // namespace coral::suffusion
