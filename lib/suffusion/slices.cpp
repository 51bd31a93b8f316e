#include "suffusion/slices.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "suffusion/frames.h"

namespace coral::suffusion {

using Eigen::Vector3d;

namespace {

using Colour = std::array<double, 3>;

/// Five colours of viridis, which colour-blind readers and grey printers order alike; linear between them.
Colour speed_colour(double share)
{
    static constexpr std::array<Colour, 5> stops{{{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
    const double at = std::clamp(share, 0.0, 1.0) * (stops.size() - 1);
    const std::size_t low = std::min(static_cast<std::size_t>(at), stops.size() - 2);
    Colour colour;
    for (std::size_t c = 0; c < 3; ++c) colour[c] = stops[low][c] + (at - static_cast<double>(low)) * (stops[low + 1][c] - stops[low][c]);
    return colour;
}

constexpr Colour solid_colour{150, 150, 150}, fine_colour{230, 120, 30};

void add(FrameArray& array, const Vector3d& v)
{
    for (int axis = 0; axis < 3; ++axis) array.values.push_back(static_cast<float>(v[axis]));
}

/// Fines that the plane y cuts: centre on the plane and radius of the cut.
struct Disc {
    double x, z, squared_radius;
};

std::vector<Disc> cut_fines(const Scene& scene, double y)
{
    std::vector<Disc> discs;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const int body = static_cast<int>(i);
        if (!scene.bodies[i].fine || !scene.world.active(body)) continue;
        const Vector3d& p = scene.world.position(body);
        const double squared = std::pow(0.5 * scene.bodies[i].diameter, 2) - std::pow(p.y() - y, 2);
        if (squared > 0) discs.push_back({p.x(), p.z(), squared});
    }
    return discs;
}

}  // namespace

int slice_row(const Simulation& simulation)
{
    const Scene& scene = simulation.scene();
    const DomainSpec& domain = *scene.description.domain;
    const Vector3d middle = domain.origin + 0.5 * domain.size;
    double y = middle.y(), nearest = HUGE_VAL;
    for (std::size_t g = 0; g < scene.bodies.size(); ++g) {
        const Vector3d x = scene.wrapped(scene.world.position(static_cast<int>(g)));
        if (!scene.bodies[g].apparent || (x - middle).norm() >= nearest) continue;
        nearest = (x - middle).norm();
        y = x.y();
    }
    return std::clamp(static_cast<int>(std::floor((y - domain.origin.y()) / domain.cell)), 0, domain.cells.y() - 1);
}

void write_slice(const std::filesystem::path& file, const Simulation& simulation, const RegionFinder& regions, int row)
{
    const fluid::Flow& flow = simulation.flow();
    const fluid::GridSpec& grid = flow.grid();
    const std::vector<Region> region_of = regions.find(simulation);
    std::array<FrameArray, 4> arrays{{{"velocity", 3, {}}, {"pressure", 1, {}}, {"solid_fraction", 1, {}}, {"region", 1, {}}}};
    for (int k = 0; k < grid.cells.z(); ++k)
        for (int i = 0; i < grid.cells.x(); ++i) {
            const std::size_t at = flow.layout().index(i, row, k);
            const std::size_t plain = static_cast<std::size_t>(i) + static_cast<std::size_t>(grid.cells.x()) *
                                      (static_cast<std::size_t>(row) + static_cast<std::size_t>(grid.cells.y()) * static_cast<std::size_t>(k));
            add(arrays[0], flow.cell_velocity(i, row, k));
            arrays[1].values.push_back(static_cast<float>(flow.options().density * flow.pressure()[at]));
            arrays[2].values.push_back(static_cast<float>(simulation.solid_fraction(at)));
            arrays[3].values.push_back(static_cast<float>(region_of[plain]));
        }
    write_image(file, grid.origin + Vector3d(0, row * grid.cell, 0), grid.cell, {grid.cells.x(), 1, grid.cells.z()}, arrays);
}

double slice_speed_scale(const Simulation& simulation, int row)
{
    double speed = 0;
    for (const FaceCondition& face : simulation.scene().description.boundary)
        if (face.kind == BoundaryKind::inlet) speed = std::max(speed, 5 * face.velocity.norm());
    if (speed > 0) return speed;
    const fluid::Flow& flow = simulation.flow();
    for (int k = 0; k < flow.grid().cells.z(); ++k)
        for (int i = 0; i < flow.grid().cells.x(); ++i) speed = std::max(speed, flow.cell_velocity(i, row, k).norm());
    return speed;
}

pack::Picture draw_slice(const Simulation& simulation, int row, int pixels)
{
    const fluid::Flow& flow = simulation.flow();
    const fluid::GridSpec& grid = flow.grid();
    const int nx = grid.cells.x(), nz = grid.cells.z();
    const double scale = slice_speed_scale(simulation, row), per_cell = static_cast<double>(std::max(pixels, 16)) / std::max(nx, nz);
    pack::Picture picture{std::max(1, static_cast<int>(nx * per_cell)), std::max(1, static_cast<int>(nz * per_cell)), {}};
    picture.rgb.resize(3 * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height));
    const std::vector<Disc> discs = cut_fines(simulation.scene(), grid.origin.y() + (row + 0.5) * grid.cell);
    for (int v = 0; v < picture.height; ++v)
        for (int u = 0; u < picture.width; ++u) {
            const double x = (u + 0.5) / per_cell, z = nz - (v + 0.5) / per_cell;  // in cells
            const int i = std::clamp(static_cast<int>(x), 0, nx - 1), k = std::clamp(static_cast<int>(z), 0, nz - 1);
            const double solid = std::clamp(simulation.solid_fraction(flow.layout().index(i, row, k)), 0.0, 1.0);
            const Colour open = speed_colour(scale > 0 ? flow.cell_velocity(i, row, k).norm() / scale : 0);
            const double px = grid.origin.x() + x * grid.cell, pz = grid.origin.z() + z * grid.cell;
            const bool fine = std::ranges::any_of(discs, [&](const Disc& d) { return std::pow(px - d.x, 2) + std::pow(pz - d.z, 2) < d.squared_radius; });
            for (std::size_t c = 0; c < 3; ++c)
                picture.rgb[3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(u)) + c] =
                    static_cast<std::uint8_t>(std::lround(fine ? fine_colour[c] : solid * solid_colour[c] + (1 - solid) * open[c]));
        }
    return picture;
}

}  // namespace coral::suffusion
