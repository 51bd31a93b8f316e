// Bodies inside a cylindrical wall: closed forms of motion, energy, friction, and the same force from nodes as from spheres.
#include <gtest/gtest.h>

#include "core/error.h"
#include "polyhedra_for_tests.h"
#include "shapes_for_tests.h"

using namespace coral;
using namespace coral::dem;
using namespace coral::dem::testing;

namespace {

constexpr double g = 9.81, pi = std::numbers::pi;
const Eigen::Vector2d axis(4e-3, -1e-3);

Vec3 in_cylinder(double across, double angle, double z) { return {axis.x() + across * std::cos(angle), axis.y() + across * std::sin(angle), z}; }

double off_axis(const World& world, int body) { return (world.position(body).head<2>() - axis).norm(); }

}  // namespace

TEST(Cylinder, pushes_a_sphere_towards_the_axis_by_its_overlap)
{
    World world = quiet_world(0.0, 0.7);
    world.add_cylinder(axis, 6e-3);
    const int shape = world.add_shape(Shape::sphere()), b = add_sphere(world, shape, 2e-3, in_cylinder(5.02e-3, 2.1, 0.3));
    const std::vector<Contact> c = world.contacts();
    ASSERT_EQ(c.size(), 1u);
    EXPECT_NEAR(c[0].overlap, 2e-5, 1e-15);
    EXPECT_NEAR((c[0].normal_force - 2e5 * 2e-5 * Vec3(-std::cos(2.1), -std::sin(2.1), 0)).norm(), 0.0, 1e-9);
    EXPECT_NEAR((c[0].point - in_cylinder(6e-3, 2.1, 0.3)).norm(), 0.0, 1e-14);
    EXPECT_EQ(c[0].second, -1);
    EXPECT_NEAR((world.wall_force(0) + world.contact_forces()[0]).norm(), 0.0, 1e-12);
    world.set_pose(b, in_cylinder(4.99e-3, 0.4, 0), Quat::Identity());
    EXPECT_TRUE(world.contacts().empty());
}

TEST(Cylinder, refuses_a_size_that_is_none_and_to_move)
{
    World world = quiet_world(0.0, 0.7);
    for (const double radius : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        EXPECT_THROW(world.add_cylinder(axis, radius), Error);
    EXPECT_THROW(world.add_cylinder(axis, 1.0, 3), Error);
    const int wall = world.add_cylinder(axis, 1.0);
    EXPECT_NO_THROW(world.set_wall_velocity(wall, Vec3::Zero()));
    try {
        world.set_wall_velocity(wall, Vec3(0, 0, 1));
        FAIL() << "it moved";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("is a cylinder and does not move"), std::string::npos) << error.what();
    }
}

TEST(Cylinder, thousand_elastic_bounces_keep_energy_and_angular_momentum)
{
    // Smooth wall: a billiard in a circle. Every chord is as long as the first, so the bounces are counted by the way.
    for (const double sideways : {0.0, 0.12, 0.35}) {
        World world = quiet_world(0.0, 0.0);
        world.add_cylinder(axis, 1.4e-3);
        const int shape = world.add_shape(Shape::sphere());
        const double speed = 0.4, r = 1e-3, path = 1.4e-3 - r;
        const int b = add_sphere(world, shape, 2 * r, in_cylinder(path * 0.999, 0, 0), {-std::sqrt(speed * speed - sideways * sideways), sideways, 0.05});
        const double chord = 2 * path * std::sqrt(1 - sideways * sideways / (speed * speed));
        const double before = world.energy().kinetic, turn = path * 0.999 * sideways;
        world.advance(1000 * chord / speed);
        EXPECT_GT(world.counters().contacts, 1000);
        const Energy e = world.energy();
        RecordProperty("relative_drift", std::to_string(e.stored() / before - 1.0));
        EXPECT_NEAR(e.stored() / before, 1.0, 1e-6) << sideways;
        EXPECT_NEAR(e.closure / before, 0.0, 1e-6) << sideways;
        const Vec3 arm = world.position(b) - in_cylinder(0, 0, 0), moment = arm.cross(world.velocity(b));
        EXPECT_NEAR(moment.z() / (path * speed), turn / (path * speed), 1e-6) << "the wall pushes towards the axis";
        EXPECT_NEAR(world.velocity(b).z(), 0.05, 1e-12);
    }
}

TEST(Cylinder, sphere_rolls_in_the_trough_with_the_period_of_a_rolling_sphere)
{
    // Gravity across the axis. Small swings: T = 2 pi sqrt((R - r)/g) sliding without friction, sqrt(7/5) as long rolling without slip.
    for (const double friction : {0.0, 0.8}) {
        World world = quiet_world(0.0, friction, {0, -g, 0});
        const double radius = 0.02, r = 2e-3, angle = 0.05;
        world.add_cylinder(axis, radius);
        const int shape = world.add_shape(Shape::sphere());
        const double mass = 2780 * 4 * pi / 3 * r * r * r, sink = mass * g / 2e5;
        const int b = add_sphere(world, shape, 2 * r, in_cylinder(radius - r + sink, -pi / 2 + angle, 0));
        double first = 0, last = 0, before = world.position(b).x() - axis.x();
        int crossings = 0;
        while (crossings < 11) {
            world.step(world.auto_time_step());
            const double now = world.position(b).x() - axis.x();
            if ((before > 0) != (now > 0)) {
                last = world.time();
                if (crossings++ == 0) first = last;
            }
            before = now;
        }
        const double period = (last - first) / 5, amplitude = 1 + angle * angle / 16;
        EXPECT_NEAR(period / (2 * pi * std::sqrt((friction > 0 ? 1.4 : 1.0) * (radius - r) / g) * amplitude), 1.0, 2e-3) << friction;
        EXPECT_NEAR(world.energy().closure / (mass * g * (radius - r) * angle * angle), 0.0, 1e-6);
    }
}

TEST(Cylinder, holds_a_stack_of_twenty)
{
    // Zigzag between the walls of a tube of 1.6 diameters: the sides carry what planes carry, and the base the whole weight.
    World world = quiet_world(0.3, 0.0, {0, 0, -g});
    const double r = 1e-3, radius = 1.6 * r, aside = radius - r, up = 2 * std::sqrt(r * r - aside * aside);
    world.add_cylinder(axis, radius);
    const int base = world.add_plane(Vec3::Zero(), Vec3::UnitZ()), shape = world.add_shape(Shape::sphere());
    double weight = 0;
    for (int k = 0; k < 20; ++k) weight += g * world.mass(add_sphere(world, shape, 2 * r, in_cylinder(k % 2 ? aside : -aside, 0.3, r + k * up)));
    world.advance(0.4);
    EXPECT_LT(world.statistics().max_speed, 1e-7);
    EXPECT_NEAR(world.wall_force(base).z(), -weight, 1e-4 * weight) << "a smooth tube carries nothing along its axis";
    EXPECT_NEAR(world.wall_force(0).z(), 0.0, 1e-15);
    const double slope = aside / (0.5 * up);  // of the lines of centres, sideways over upwards
    for (const Contact& c : world.contacts()) {
        if (c.second != -1) continue;
        // The line of centres below carries the weight from this sphere on, that above the weight from the next one on.
        const int above = 20 - c.first - 1, carried = c.first == 0 ? above : 2 * above + 1;
        EXPECT_NEAR(c.normal_force.norm(), carried * weight / 20 * slope, 0.02 * weight * slope) << c.first;
    }
    EXPECT_NEAR(world.energy().closure / (weight * r), 0.0, 1e-6);
}

TEST(Cylinder, spheres_pressed_apart_roll_down_like_gears)
{
    // Two spheres across the bore, in balance. Their sides that face each other move alike, so nothing brakes them there: 5/7 g.
    World world = quiet_world(0.0, 0.6, {0, 0, -g});
    const double r = 1e-3, overlap = 0.7e-6, time = 0.02, acceleration = 5.0 / 7 * g;
    world.add_cylinder(axis, 2 * r - 1.5 * overlap);
    const int shape = world.add_shape(Shape::sphere());
    const int a = add_sphere(world, shape, 2 * r, in_cylinder(r - overlap / 2, 0.3, 0)), b = add_sphere(world, shape, 2 * r, in_cylinder(r - overlap / 2, 0.3 + pi, 0));
    world.advance(time);
    EXPECT_NEAR(-world.position(a).z() / (0.5 * acceleration * time * time), 1.0, 1e-3);
    EXPECT_NEAR(world.position(a).z(), world.position(b).z(), 1e-12);
    EXPECT_NEAR(world.angular_velocity(a).norm() / (acceleration * time / r), 1.0, 1e-3);
    EXPECT_NEAR(world.energy().closure / (world.mass(a) * acceleration * acceleration * time * time), 0.0, 1e-6);
}

TEST(Cylinder, nodes_press_as_on_a_plane)
{
    // As the closed form of spheres does: kn d whatever the radius of the wall. Without the curvature in the stiffness it would be 15 % more
    // in a bore of four radii, 41 % in one of two.
    const double r = 2e-3, depth = 6e-5;
    const auto force = [&](const auto& add_wall) {
        World world = quiet_world(0.0, 0.0);
        add_wall(world);
        BodySpec body;
        body.shape = world.add_shape(grid_ball(r, 1e-4, 40000, 1e-3));
        body.position = {4e-3 - r + depth, 0, 0};
        body.orientation = Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
        world.add_body(body);
        return world.contacts().empty() ? Vec3(Vec3::Zero()) : Vec3(world.contact_forces()[0]);
    };
    const Vec3 on_plane = force([](World& world) { world.add_plane({4e-3, 0, 0}, -Vec3::UnitX()); });
    ASSERT_LT(on_plane.x(), 0.0);
    for (const double radius : {2 * r, 4 * r, 500 * r}) {
        const Vec3 inside = force([&](World& world) { world.add_cylinder(Eigen::Vector2d(4e-3 - radius, 0), radius); });
        EXPECT_NEAR(inside.x() / on_plane.x(), 1.0, 0.02) << radius / r;
        EXPECT_LT(inside.tail<2>().norm(), 0.01 * inside.norm());
    }
}

TEST(Cylinder, polyhedra_bounce_elastically_inside)
{
    for (const auto& [seed, radius] : {std::pair{1u, 5e-3}, std::pair{2u, 4e-3}}) {
        World world = quiet_world(0.0, 0.0);
        world.add_cylinder(axis, radius);
        world.add_plane(Vec3(0, 0, -4e-3), Vec3::UnitZ());
        world.add_plane(Vec3(0, 0, 4e-3), -Vec3::UnitZ());
        std::mt19937_64 random(seed);
        std::normal_distribution<double> n;
        std::vector<Vec3> corners;
        for (int k = 0; k < 20; ++k) corners.push_back(1.5e-3 * Vec3(n(random), n(random), n(random)).normalized());
        BodySpec body;
        body.shape = world.add_shape(Shape::polyhedron("stone", Polyhedron(corners, "stone"), 2000));
        body.position = in_cylinder(0.5e-3, 1, 0);
        body.velocity = {0.2, -0.15, 0.1};
        body.angular_velocity = {30, -20, 60};
        const int b = world.add_body(body);
        const double before = world.energy().kinetic;
        int bounces = 0;
        bool touched = false;
        while (bounces < 30 || touched) {
            world.step(world.auto_time_step());
            const bool now = world.statistics().contacts > 0;
            bounces += now && !touched;
            touched = now;
            ASSERT_LT(off_axis(world, b), radius);
        }
        EXPECT_NEAR(world.energy().stored() / before, 1.0, 1e-3 * bounces);
        EXPECT_NEAR(world.energy().closure / before, 0.0, 1e-6);
    }
}

TEST(Cylinder, a_world_goes_on_bit_for_bit)
{
    const auto build = [] {
        World world = quiet_world(0.2, 0.5, {0, 0, -g});
        world.add_cylinder(axis, 4e-3);
        world.add_plane(Vec3::Zero(), Vec3::UnitZ());
        const int sphere = world.add_shape(Shape::sphere()), ball = world.add_shape(grid_ball(1e-3, 1e-4, 400, 2e-3));
        for (int k = 0; k < 12; ++k) {
            const Vec3 at = in_cylinder(k % 3 ? 3.2005e-3 : 3.001e-3, k * 2.4, 1.2e-3 + 0.8e-3 * k);
            if (k % 3) {
                add_sphere(world, sphere, 1.6e-3, at, {0.02 * std::cos(k), 0.02 * std::sin(k), 0});
                continue;
            }
            BodySpec body;
            body.shape = ball;
            body.position = at;
            body.velocity = {-0.02, 0.01 * k, 0};
            world.add_body(body);
        }
        return world;
    };
    World whole = build(), stopped = build();
    whole.advance(1e-5, 2e-6);
    stopped.advance(1e-5, 2e-6);
    ASSERT_GE(stopped.contact_springs().size(), 5u) << "it stops in the middle of contacts";
    const std::vector<std::uint8_t> state = stopped.save();
    World resumed = build();
    resumed.restore(state);
    whole.advance(0.03, 2e-6);
    resumed.advance(0.03, 2e-6);
    for (int i = 0; i < whole.body_count(); ++i) {
        EXPECT_EQ(whole.position(i), resumed.position(i)) << i;
        EXPECT_EQ(whole.velocity(i), resumed.velocity(i)) << i;
        EXPECT_EQ(whole.angular_velocity(i), resumed.angular_velocity(i)) << i;
    }
    EXPECT_EQ(whole.energy().closure, resumed.energy().closure);
}
