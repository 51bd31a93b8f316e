// Energy of collisions and of a falling bed: what an elastic bounce keeps, and how well the ledger closes, by pair, law and time step.
#include <cmath>
#include <cstdio>
#include <random>

#include "dem/polyhedra_for_tests.h"

namespace {

using namespace coral::dem;
using coral::dem::testing::Quat;
using coral::dem::testing::Vec3;

constexpr double diameter = 2e-3;

struct Body {
    const char* name;
    std::shared_ptr<const Shape> shape;
    double scale() const { return diameter / (2.0 * shape->equivalent_radius()); }
};

struct Result {
    double kept = 0, closure = 0, dissipated = 0;
};

/// Means over oblique collisions of two spinning bodies at 1 m/s.
Result collide(const Body& first, const Body& second, double damping, double friction, double fraction)
{
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    const auto vector = [&] {
        const double x = normal(random), y = normal(random);
        return Vec3(x, y, normal(random));
    };
    const auto turn = [&] {
        const Vec3 v = vector();
        return Quat(normal(random), v.x(), v.y(), v.z()).normalized();
    };
    constexpr int count = 5;
    Result mean;
    for (int k = 0; k < count; ++k) {
        World world = testing::quiet_world(damping, friction);
        BodySpec body;
        for (const double side : {-1.0, 1.0}) {
            const Body& b = side < 0.0 ? first : second;
            body.shape = world.add_shape(b.shape);
            body.scale = b.scale();
            body.position = Vec3(0.75 * side * diameter, 0.1e-3 * normal(random), 0.1e-3 * normal(random));
            body.velocity = Vec3(-0.5 * side, 0, 0) + 0.05 * vector();
            body.angular_velocity = 50.0 * vector();
            body.orientation = turn();
            world.add_body(body);
        }
        const double dt = fraction * world.auto_time_step();
        for (int step = 0; step < 20000 && (world.position(1) - world.position(0)).norm() < 1.6 * diameter; ++step) world.step(dt);
        const Energy e = world.energy();
        mean.kept += std::abs(e.stored() / e.initial - 1.0) / count;
        mean.closure += std::abs(e.closure / e.initial) / count;
        mean.dissipated += (e.friction + e.damping) / e.initial / count;
    }
    return mean;
}

/// Spheres and stones that fall into a box and settle.
void bed(const Body& body, int edge)
{
    World world = testing::quiet_world(0.3, 0.7, Vec3(0, 0, -9.81));
    const int shape = world.add_shape(body.shape);
    const double pitch = 1.5 * diameter;
    world.add_box(Vec3::Zero(), Vec3(edge * pitch, edge * pitch, 2 * edge * pitch));
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> shift(-0.05 * diameter, 0.05 * diameter);
    for (int i = 0; i < edge * edge * edge; ++i) {
        BodySpec spec;
        spec.shape = shape;
        spec.scale = body.scale();
        const double dx = shift(random), dy = shift(random);
        spec.position = pitch * Vec3(i % edge + 0.5, i / edge % edge + 0.5, i / edge / edge + 0.5) + Vec3(dx, dy, shift(random));
        world.add_body(spec);
    }
    double worst = 0.0;
    for (int k = 0; k < 10; ++k) {
        world.advance(0.01);
        const Energy e = world.energy();
        worst = std::max(worst, std::abs(e.closure) / (e.initial + e.gravity_work));
    }
    const Energy e = world.energy();
    std::printf("%-22s %8d %12.2e %14.3f %16.1e\n", body.name, edge * edge * edge, e.initial + e.gravity_work, (e.friction + e.damping) / (e.initial + e.gravity_work), worst);
}

}  // namespace

int main()
{
    const Body sphere{"sphere", Shape::sphere()}, ball{"lattice, 6000 nodes", testing::grid_ball(0.5, 0.5 / 37, 6000, 0.6)},
        stone{"polyhedron, 26 faces", testing::polyhedron_shape(testing::stone(26, 1))};
    std::printf("%-44s %8s | %12s %12s | %10s %12s\n", "collision", "step", "elastic:", "", "zeta 0.3,", "mu 0.7");
    std::printf("%-44s %8s | %12s %12s | %10s %12s\n", "", "/ auto", "|dE|/E", "closure/E", "lost", "closure/E");
    const Body* pairs[][2] = {{&sphere, &sphere}, {&sphere, &ball}, {&sphere, &stone}, {&ball, &ball}, {&stone, &ball}, {&stone, &stone}};
    for (const auto& pair : pairs)
        for (const double fraction : {1.0, 0.3}) {
            const Result elastic = collide(*pair[0], *pair[1], 0.0, 0.0, fraction), lossy = collide(*pair[0], *pair[1], 0.3, 0.7, fraction);
            std::printf("%-20s - %-21s %8.2f | %12.1e %12.1e | %10.3f %12.1e\n", pair[0]->name, pair[1]->name, fraction, elastic.kept, elastic.closure,
                        lossy.dissipated, lossy.closure);
        }
    std::printf("\n%-22s %8s %12s %14s %16s\n", "bed that settles", "bodies", "energy [J]", "dissipated", "worst closure");
    bed(sphere, 8);
    bed(stone, 3);
    bed(ball, 3);
}
