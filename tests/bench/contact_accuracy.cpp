// Speed against error of contact: nodes on a surface against the error of the force, time step against the drift of energy.
#include <random>

#include "bench/table.h"
#include "dem/shapes_for_tests.h"

namespace {

using namespace coral::dem;
using coral::bench::heading;
using coral::bench::line;
using coral::dem::testing::Quat;
using coral::dem::testing::Vec3;

constexpr double radius = 7.5e-3, spacing = 2e-4;

/// Contact force of two balls with lattices at an overlap and a turn of both [N], and seconds for one step.
double force(const std::shared_ptr<const Shape>& shape, double overlap, const Quat& turn, double& time)
{
    World world = testing::quiet_world(0, 0);
    BodySpec body;
    body.shape = world.add_shape(shape);
    body.orientation = turn;
    const int first = world.add_body(body);
    body.position = Vec3(2 * radius - overlap, 0, 0);
    body.orientation = turn.conjugate();
    world.add_body(body);
    world.step(1e-12);  // lists
    time += coral::bench::seconds([&] {
        for (int i = 0; i < 20; ++i) world.step(1e-12);
    }) / 20;
    return world.contact_forces()[static_cast<std::size_t>(first)].norm();
}

std::vector<Quat> turns(int count)
{
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    std::vector<Quat> list;
    for (int i = 0; i < count; ++i) {
        const double w = normal(random), x = normal(random), y = normal(random);
        list.push_back(Quat(w, x, y, normal(random)).normalized());
    }
    return list;
}

void node_counts()
{
    heading("Two balls of 15 mm with lattices of 200 um: nodes against the scatter of the contact force over 24 turns",
            {"nodes", "overlap [um]", "mean error", "rms error", "step [us]"});
    const auto reference = testing::grid_ball(radius, spacing, 60000, 1e-3);
    for (double overlap : {2e-5, 1e-4}) {
        double exact = 0, ignored = 0;
        for (const Quat& turn : turns(6)) exact += force(reference, overlap, turn, ignored) / 6;
        for (int nodes : {1000, 2500, 6000, 15000}) {
            const auto shape = testing::grid_ball(radius, spacing, nodes, 1e-3);
            double mean = 0, square = 0, time = 0;
            const int count = 24;
            for (const Quat& turn : turns(count)) {
                const double error = force(shape, overlap, turn, time) / exact - 1;
                mean += error / count;
                square += error * error / count;
            }
            line({static_cast<double>(nodes), 1e6 * overlap, mean, std::sqrt(square), 1e6 * time / count});
        }
    }
}

/// Relative change of energy in one elastic collision at v [m/s], and the steps it took.
double drift(const std::shared_ptr<const Shape>& shape, double scale, double gap, double step_fraction, double& steps)
{
    World world = testing::quiet_world(0, 0);
    BodySpec body;
    body.shape = world.add_shape(shape);
    body.scale = scale;
    body.velocity = Vec3(0.5, 0, 0);
    body.orientation = Quat(0.8, 0.3, -0.4, 0.33).normalized();
    world.add_body(body);
    body.position = Vec3(gap, 0, 0);
    body.velocity = Vec3(-0.5, 0, 0);
    world.add_body(body);
    const double before = world.energy().kinetic, dt = step_fraction * world.critical_time_step();
    steps = 0;
    while ((world.position(1) - world.position(0)).x() <= gap && steps < 1e6) {
        world.step(dt);
        ++steps;
    }
    return world.energy().kinetic / before - 1;
}

void time_steps()
{
    heading("Elastic head-on collision at 1 m/s: time step against the drift of energy",
            {"step / critical", "spheres", "lattices, 6000", "steps, spheres", "steps, lattices"});
    const auto sphere = Shape::sphere();
    const auto ball = testing::grid_ball(radius, spacing, 6000, 1e-3);
    for (double fraction : {0.05, 0.1, 0.2, 0.3, 0.5, 1.0}) {
        double sphere_steps = 0, ball_steps = 0;
        const double of_spheres = drift(sphere, 2 * radius, 2.001 * radius, fraction, sphere_steps);
        const double of_balls = drift(ball, 1, 2.001 * radius, fraction, ball_steps);
        line({fraction, of_spheres, of_balls, sphere_steps, ball_steps});
    }
}

}  // namespace

int main()
{
    node_counts();
    time_steps();
}
