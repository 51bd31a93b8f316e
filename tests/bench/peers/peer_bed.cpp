// 4000 spheres at rest in a box: makes the bed that all codes start from, and times our own steps on it.
//     peer_bed make BED
//     peer_bed run BED STATE WARM STEPS THREADS [SKIN]
#include <cstdlib>
#include <random>

#include "bench/peers/scene.h"
#include "core/parallel.h"

namespace {

using namespace coral::dem;
using namespace coral::bench;
using Vec3 = Eigen::Vector3d;

constexpr int count = 4000;
constexpr double smallest = 1.5e-3, largest = 3e-3, edge = 0.06;

World make_world(const Scene& scene, double skin)
{
    World world = empty_world(scene, skin);
    BodySpec body;
    body.shape = world.add_shape(Shape::sphere());
    for (const std::vector<double>& row : scene.bodies) {
        body.position = {row.at(0), row.at(1), row.at(2)};
        body.scale = 2 * row.at(3);
        if (row.size() > 6) body.velocity = {row[4], row[5], row[6]};
        world.add_body(body);
    }
    return world;
}

void make(const std::string& file)
{
    Scene scene;
    write_law(scene);
    scene.header["lower"] = {0, 0, 0};
    scene.header["upper"] = {edge, edge, edge};
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> diameter(smallest, largest), shift(-2e-5, 2e-5);
    const int row = static_cast<int>(edge / (largest + 6e-5));
    const double pitch = edge / row;
    for (int i = 0; i < count; ++i) {
        const double d = diameter(random), dx = shift(random), dy = shift(random);
        scene.bodies.push_back({pitch * (i % row + 0.5) + dx, pitch * (i / row % row + 0.5) + dy, pitch * (i / (row * row) + 0.5), 0.5 * d});
    }
    World world = make_world(scene, 0);
    settle(world, time_step, 0.25 * (smallest + largest));
    for (int i = 0; i < count; ++i) {
        const Vec3& x = world.position(i);
        scene.bodies[static_cast<std::size_t>(i)] = {x.x(), x.y(), x.z(), world.bounding_radius(i)};
    }
    write_scene(file, scene);
}

void run(const std::string& file, const std::string& state, int warm, int steps, double skin)
{
    Scene scene = read_scene(file);
    World world = make_world(scene, skin);
    measure(world, scene.number("time_step"), warm, steps);
    for (int i = 0; i < world.body_count(); ++i) {
        const Vec3 &x = world.position(i), &v = world.velocity(i);
        scene.bodies[static_cast<std::size_t>(i)] = {x.x(), x.y(), x.z(), world.bounding_radius(i), v.x(), v.y(), v.z()};
    }
    write_scene(state, scene);
}

}  // namespace

int main(int argc, char** argv)
try {
    const std::string verb = argc > 2 ? argv[1] : "";
    if (verb == "make") make(argv[2]);
    else if (verb == "run" && argc >= 7) {
        coral::set_thread_count(std::atoi(argv[6]));
        run(argv[2], argv[3], std::atoi(argv[4]), std::atoi(argv[5]), argc > 7 ? std::atof(argv[7]) : 0);
    } else {
        std::fputs("peer_bed make BED | peer_bed run BED STATE WARM STEPS THREADS [SKIN]\n", stderr);
        return 2;
    }
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
