// 50 grains with lattices, pressed together in a box: makes the scene and the distances that YADE reads, and times our own steps on it.
//     peer_grains make SCENE LATTICE
//     peer_grains run SCENE STATE WARM STEPS THREADS [SKIN]
#include <cstdlib>
#include <random>

#include "bench/peers/scene.h"
#include "core/parallel.h"
#include "dem/shapes_for_tests.h"

namespace {

using namespace coral::dem;
using namespace coral::bench;
using Vec3 = Eigen::Vector3d;
using Quat = Eigen::Quaterniond;

// An ellipsoid with the volume of a ball of 15 mm: YADE casts rays from the centre to place its nodes and takes one contact a pair, so that
// voids and several patches would be lost on it.
const Vec3 semi_axes(8.5e-3, 7.5e-3, 6.617647e-3);
constexpr int count = 50, nodes = 6000;
constexpr double spacing = 2e-4, edge = 0.06, pressure = 5e4;

World make_world(const Scene& scene, double skin)
{
    World world = empty_world(scene, skin);
    BodySpec body;
    body.shape = world.add_shape(testing::grid_ellipsoid(semi_axes, spacing, nodes, 1e-3));
    for (const std::vector<double>& row : scene.bodies) {
        body.position = {row.at(0), row.at(1), row.at(2)};
        body.orientation = {row.at(3), row.at(4), row.at(5), row.at(6)};
        world.add_body(body);
    }
    return world;
}

void keep_state(Scene& scene, const World& world)
{
    for (int i = 0; i < world.body_count(); ++i) {
        const Vec3& x = world.position(i);
        const Quat& q = world.orientation(i);
        scene.bodies[static_cast<std::size_t>(i)] = {x.x(), x.y(), x.z(), q.w(), q.x(), q.y(), q.z()};
    }
}

/// Force / overlap of the mean contact [N/m]: ours is soft at first, and a code with one spring a pair needs this one to hold the scene.
double secant_stiffness(const World& world)
{
    double force = 0, overlap = 0;
    for (const Contact& contact : world.contacts()) {
        force += contact.normal_force.norm();
        overlap += contact.overlap;
    }
    return force / overlap;
}

/// Lowers the top face until it carries the pressure; slower each time, since the grains give way while they come to rest.
void compress(World& world, int top)
{
    const double target = pressure * edge * edge;
    const auto face_force = [&] { return world.wall_force(top).norm(); };
    double height = 0;  // the top face starts far above the grains
    for (int i = 0; i < world.body_count(); ++i) height = std::max(height, world.position(i).z());
    world.set_wall_velocity(top, Vec3(0, 0, -1));
    world.advance((world.wall_point(top).z() - height - semi_axes.x()) / 1.0);
    for (double speed : {0.05, 0.01, 0.002, 0.0004}) {
        world.set_wall_velocity(top, Vec3(0, 0, -speed));
        while (face_force() < target) world.advance(1e-4);
        world.set_wall_velocity(top, Vec3::Zero());
        settle(world, 0, semi_axes.y());
    }
    std::fprintf(stderr, "top face carries %.1f kPa\n", 1e-3 * face_force() / (edge * edge));
}

void make(const std::string& file, const std::string& lattice)
{
    Scene scene;
    write_law(scene);
    const double pitch = edge / 3;
    scene.header["lower"] = {0, 0, 0};
    scene.header["upper"] = {edge, edge, pitch * (count / 9 + 1)};
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    for (int i = 0; i < count; ++i) {
        const double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
        const Quat q = Quat(w, x, y, z).normalized();
        scene.bodies.push_back({pitch * (i % 3 + 0.5), pitch * (i / 3 % 3 + 0.5), pitch * (i / 9 + 0.5), q.w(), q.x(), q.y(), q.z()});
    }
    World world = make_world(scene, 5e-4);
    settle(world, 0, semi_axes.y());
    const int top = world.wall_count() - 1;
    compress(world, top);
    keep_state(scene, world);
    scene.header["upper"] = {edge, edge, world.wall_point(top).z()};
    scene.header["secant_stiffness"] = {secant_stiffness(world)};
    scene.header["nodes"] = {nodes};
    scene.header["semi_axes"] = {semi_axes.x(), semi_axes.y(), semi_axes.z()};
    write_scene(file, scene);

    // YADE looks for contact wherever boxes around the lattices overlap: the tightest lattice is its fastest.
    const auto table = testing::tabulate([](const Vec3& p) { return testing::ellipsoid_distance(p, semi_axes); },
                                         semi_axes.array() + 2 * spacing, spacing);
    Scene grid;
    grid.header["spacing"] = {table->spacing};
    grid.header["origin"] = {table->origin.x(), table->origin.y(), table->origin.z()};
    grid.header["size"] = {double(table->size.x()), double(table->size.y()), double(table->size.z())};
    for (int i = 0; i < table->size.x(); ++i)
        for (int j = 0; j < table->size.y(); ++j) {
            std::vector<double>& line = grid.bodies.emplace_back();
            for (int k = 0; k < table->size.z(); ++k) line.push_back(double(table->distance[table->index(i, j, k)]));
        }
    write_scene(lattice, grid);
}

void run(const std::string& file, const std::string& state, int warm, int steps, double skin)
{
    Scene scene = read_scene(file);
    World world = make_world(scene, skin);
    measure(world, scene.number("time_step"), warm, steps);
    keep_state(scene, world);
    write_scene(state, scene);
}

}  // namespace

int main(int argc, char** argv)
try {
    const std::string verb = argc > 3 ? argv[1] : "";
    if (verb == "make") make(argv[2], argv[3]);
    else if (verb == "run" && argc >= 7) {
        coral::set_thread_count(std::atoi(argv[6]));
        run(argv[2], argv[3], std::atoi(argv[4]), std::atoi(argv[5]), argc > 7 ? std::atof(argv[7]) : 0);
    } else {
        std::fputs("peer_grains make SCENE LATTICE | peer_grains run SCENE STATE WARM STEPS THREADS [SKIN]\n", stderr);
        return 2;
    }
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
