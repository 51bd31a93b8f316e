// Spheres and walls against closed forms.
#include <gtest/gtest.h>

#include "core/error.h"
#include "shapes_for_tests.h"

using namespace coral;
using namespace coral::dem;
using namespace coral::dem::testing;

namespace {
constexpr double g = 9.81;
}

TEST(Motion, free_fall_is_exact)
{
    World world = quiet_world(0.3, 0.7, {0, 0, -g});
    const int shape = world.add_shape(Shape::sphere());
    const int b = add_sphere(world, shape, 2e-3, {0, 0, 1.0}, {0.1, 0, 0.2});
    world.advance(0.1, 4e-6);
    EXPECT_NEAR(world.position(b).z(), 1.0 + 0.2 * 0.1 - 0.5 * g * 0.01, 1e-12);
    EXPECT_NEAR(world.position(b).x(), 0.01, 1e-12);
    EXPECT_NEAR(world.velocity(b).z(), 0.2 - g * 0.1, 1e-12);
    EXPECT_NEAR(world.time(), 0.1, 1e-15);
}

TEST(SphereContact, elastic_spheres_exchange_velocities_at_any_stable_step)
{
    for (const double dt : {2e-7, 1e-6, 2e-6}) {
        World world = quiet_world(0.0, 0.7);
        const int shape = world.add_shape(Shape::sphere());
        add_sphere(world, shape, 1.5e-3, {0, 0, 0}, {0.1, 0, 0});
        add_sphere(world, shape, 1.5e-3, {1.6137e-3, 0, 0}, {0, 0, 0});
        world.advance(3e-3, dt);
        EXPECT_NEAR(world.velocity(0).x(), 0.0, 1e-10);
        EXPECT_NEAR(world.velocity(1).x(), 0.1, 1e-10);
        EXPECT_NEAR(momentum(world).x(), world.mass(0) * 0.1, 1e-12 * world.mass(0));
    }
}

TEST(SphereContact, thousand_bounces_between_spheres_keep_the_energy_at_the_automatic_step)
{
    // Two spheres in a one-dimensional box: between two fixed ones of the same size.
    World world = quiet_world(0.0, 0.0);
    const int shape = world.add_shape(Shape::sphere());
    const double d = 2e-3, gap = 0.3e-3;
    add_sphere(world, shape, d, {0, 0, 0}, Vec3::Zero(), Motion::fixed);
    add_sphere(world, shape, d, {d + gap, 0, 0}, {0.31, 0, 0});
    add_sphere(world, shape, d, {2 * (d + gap), 0, 0}, {-0.17, 0, 0});
    add_sphere(world, shape, d, {3 * (d + gap), 0, 0}, Vec3::Zero(), Motion::fixed);
    const double before = world.energy().kinetic;
    int bounces = 0;
    double last = world.velocity(1).x() - world.velocity(2).x();
    while (bounces < 1000 || world.statistics().contacts > 0) {
        world.step(world.auto_time_step());
        const double now = world.velocity(1).x() - world.velocity(2).x();
        bounces += last > 0.0 && now <= 0.0;
        last = now;
    }
    const Energy e = world.energy();
    RecordProperty("relative_drift", std::to_string(e.stored() / before - 1.0));
    EXPECT_NEAR(e.stored() / before, 1.0, 1e-3);
    EXPECT_NEAR(e.stored() / before, 1.0, 1e-6) << "the work of opening and closing contacts is corrected";
}

TEST(SphereContact, thousand_bounces_on_a_plane_under_gravity_keep_the_height)
{
    World world = quiet_world(0.0, 0.0, {0, 0, -g});
    const int shape = world.add_shape(Shape::sphere());
    world.add_plane(Vec3::Zero(), Vec3::UnitZ());
    const double h = 1e-5;
    add_sphere(world, shape, 2e-3, {0, 0, 1e-3 + h});
    const double period = 2.0 * std::sqrt(2.0 * h / g);
    world.advance(1000 * period);
    const Energy e = world.energy();
    EXPECT_NEAR((e.stored() - e.gravity_work) / (world.mass(0) * g * h), 0.0, 1e-3);
    EXPECT_NEAR(e.closure / (world.mass(0) * g * h), 0.0, 1e-6);
}

TEST(SphereContact, oblique_bounces_of_unequal_spheres_keep_the_energy)
{
    // The correction of closing and opening steps holds where the line of centres turns, too.
    World world = quiet_world(0.0, 0.0);
    const int shape = world.add_shape(Shape::sphere());
    world.add_box(Vec3::Zero(), Vec3(6e-3, 6e-3, 6e-3));
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> u(-0.2, 0.2);
    for (int k = 0; k < 8; ++k)
        add_sphere(world, shape, 1.5e-3 + 0.1e-3 * k, Vec3(1.5e-3 + 3e-3 * (k & 1), 1.5e-3 + 3e-3 * (k >> 1 & 1), 1.5e-3 + 3e-3 * (k >> 2 & 1)),
                   {u(random), u(random), u(random)});
    const double before = world.energy().kinetic;
    world.advance(0.5);
    EXPECT_NEAR(world.energy().stored() / before, 1.0, 1e-3);
}

TEST(SphereContact, damping_ratio_gives_the_restitution_of_the_clamped_oscillator)
{
    EXPECT_NEAR(restitution_of_damping(0.3), 0.4510, 1e-4);
    EXPECT_NEAR(restitution_of_damping(damping_of_restitution(0.3)), 0.3, 1e-12);
    for (const auto& [dt, tolerance] : {std::pair{2e-7, 5e-3}, std::pair{1e-6, 2e-2}}) {
        World world = quiet_world(0.3, 0.7);
        const int shape = world.add_shape(Shape::sphere());
        add_sphere(world, shape, 1.5e-3, {0, 0, 0}, {0.1, 0, 0});
        add_sphere(world, shape, 1.5e-3, {1.6e-3, 0, 0}, {-0.1, 0, 0});
        world.advance(3e-3, dt);
        EXPECT_NEAR((world.velocity(1) - world.velocity(0)).x() / 0.2, 0.4510, 0.4510 * tolerance);
        const Energy e = world.energy();
        EXPECT_NEAR(e.closure, 0.0, 1e-6 * e.initial);
    }
}

TEST(SphereContact, mass_ratio_of_a_thousand_follows_two_body_collision)
{
    World world = quiet_world(0.0, 0.7);
    const int shape = world.add_shape(Shape::sphere());
    add_sphere(world, shape, 15e-3, {0, 0, 0}, {0.1, 0, 0});
    add_sphere(world, shape, 1.5e-3, {8.3e-3, 0, 0});
    world.advance(4e-3, 2e-6);
    const double ratio = world.mass(0) / world.mass(1);
    EXPECT_NEAR(ratio, 1000.0, 1e-6);
    EXPECT_NEAR(world.velocity(1).x() / 0.1, 2.0 * ratio / (ratio + 1.0), 1e-3);
    EXPECT_NEAR(world.velocity(0).x() / 0.1, (ratio - 1.0) / (ratio + 1.0), 1e-5);
}

TEST(SphereContact, stack_of_twenty_carries_its_weight)
{
    World world = quiet_world(0.3, 0.7, {0, 0, -g});
    const int shape = world.add_shape(Shape::sphere());
    world.add_plane(Vec3::Zero(), Vec3::UnitZ());
    const double d = 2e-3;
    for (int k = 0; k < 20; ++k) add_sphere(world, shape, d, {0, 0, 0.5 * d + k * d});
    world.advance(0.1, 2e-6);
    const double weight = world.mass(0) * g;
    for (const Contact& c : world.contacts()) {
        const int below = c.second < 0 ? 0 : std::max(c.first, c.second);
        EXPECT_NEAR(c.normal_force.norm() / ((20 - below) * weight), 1.0, 1e-6);
        if (c.second < 0) {
            EXPECT_NEAR(c.overlap, 20.0 * weight / 2e5, 1e-12);
            EXPECT_NEAR(c.overlap, 1.142e-8, 0.001e-8);
        }
    }
    EXPECT_EQ(world.contacts().size(), 20u);
    EXPECT_LT(world.energy().kinetic, 1e-20);
    EXPECT_NEAR(world.wall_force(0).z(), -20.0 * weight, 20e-6 * weight);
    EXPECT_LT(world.statistics().unbalanced_ratio, 1e-6);
}

TEST(SphereContact, sliding_turns_to_rolling_at_five_sevenths)
{
    World world = quiet_world(0.0, 0.7, {0, 0, -g});
    const int shape = world.add_shape(Shape::sphere());
    world.add_plane(Vec3::Zero(), Vec3::UnitZ());
    const double d = 2e-3;
    const double rest = world.material(0).density * 4.0 / 3.0 * std::numbers::pi * 1e-9 * g / 2e5;
    const int b = add_sphere(world, shape, d, {0, 0, 0.5 * d - rest}, {0.1, 0, 0});
    const double expected = 2.0 * 0.1 / (7.0 * 0.7 * g);
    world.advance(0.9 * expected, 1e-6);
    EXPECT_GT(world.velocity(b).x(), world.angular_velocity(b).y() * 0.5 * d * 1.05);
    EXPECT_NEAR(world.velocity(b).x(), 0.1 - 0.7 * g * 0.9 * expected, 1e-5);
    world.advance(2.1 * expected, 1e-6);
    EXPECT_NEAR(world.velocity(b).x() / 0.1, 5.0 / 7.0, 1e-3);
    EXPECT_NEAR(world.angular_velocity(b).y() * 0.5 * d / 0.1, 5.0 / 7.0, 1e-3);
    const Energy e = world.energy();
    EXPECT_NEAR(e.friction / (e.initial - e.stored()), 1.0, 2e-2);
}

TEST(SphereContact, friction_reversal_has_the_slope_cap_and_loop_area_of_coulomb_with_a_spring)
{
    // Constant normal load by overlap: the plane moves along itself under a fixed-height, unspinnable (huge) sphere.
    World world = quiet_world(0.0, 0.7);
    const int shape = world.add_shape(Shape::sphere());
    const int plane = world.add_plane(Vec3::Zero(), Vec3::UnitZ());
    const double overlap = 1e-6;
    BodySpec b;
    b.shape = shape;
    b.scale = 2.0;
    b.density = 1e12;
    b.position = {0, 0, 1.0 - overlap};
    world.add_body(b);
    const double normal = 2e5 * overlap, limit = 0.7 * normal, stroke = 5e-6;
    const int n = 1000;
    const double dt = 1e-6, speed = stroke / (n * dt);
    double area = 0.0, last = 0.0, steepest = 0.0;
    const auto drive = [&](int count, double sign, bool loop) {
        world.set_wall_velocity(plane, {sign * speed, 0, 0});
        for (int k = 0; k < count; ++k) {
            world.step(dt);
            const double f = world.contacts()[0].tangential_force.x();
            if (loop) area += 0.5 * (f + last) * sign * speed * dt;
            steepest = std::max(steepest, std::abs(f - last) / (speed * dt));
            EXPECT_LE(std::abs(f), limit * (1.0 + 1e-9));
            last = f;
        }
    };
    drive(n, 1.0, false);
    drive(2 * n, -1.0, true);
    drive(2 * n, 1.0, true);
    EXPECT_NEAR(steepest, 1e5, 0.1);
    // The two corners of the loop lie between steps: their trapezoids miss at most kt (speed dt)^2/4 each.
    EXPECT_NEAR(area / (4.0 * limit * (stroke - limit / 1e5)), 1.0, 1e-5);
}

TEST(SphereContact, tangent_and_coincident_spheres_give_finite_forces)
{
    World world = quiet_world(0.3, 0.7);
    const int shape = world.add_shape(Shape::sphere());
    add_sphere(world, shape, 2e-3, {0, 0, 0});
    add_sphere(world, shape, 2e-3, {2e-3, 0, 0});
    add_sphere(world, shape, 2e-3, {0, 9e-3, 0});
    add_sphere(world, shape, 2e-3, {0, 9e-3, 0});
    EXPECT_EQ(world.statistics().deep_contacts, 1);
    const auto f = world.contact_forces();
    EXPECT_EQ(f[0].norm(), 0.0);
    EXPECT_TRUE(f[2].allFinite());
    EXPECT_EQ((f[2] + f[3]).norm(), 0.0);
    EXPECT_NEAR(f[2].z(), 2e5 * 0.5e-3, 1e-9) << "capped at half the radius, normal z where the centres coincide";
}

TEST(SphereContact, deep_insertion_is_relaxed_without_speed)
{
    World world = quiet_world(0.3, 0.7);
    const int shape = world.add_shape(Shape::sphere());
    add_sphere(world, shape, 2e-3, {0, 0, 0});
    add_sphere(world, shape, 2e-3, {1e-3, 0, 0});
    add_sphere(world, shape, 2e-3, {0.2e-3, 1.1e-3, 0});
    const int used = world.relax(1e-4, 500);
    EXPECT_LT(used, 500);
    EXPECT_LT(world.statistics().max_overlap, 1e-4);
    EXPECT_EQ(world.statistics().max_speed, 0.0);
    world.advance(5e-3);
    EXPECT_LT(world.statistics().max_speed, 0.05);
}

TEST(Guards, step_above_the_critical_one_is_refused)
{
    World world = quiet_world(0.3, 0.7);
    const int shape = world.add_shape(Shape::sphere());
    add_sphere(world, shape, 1.5e-3, {0, 0, 0});
    EXPECT_NEAR(world.auto_time_step(), 0.3 * std::sqrt(world.mass(0) / 4e5), 1e-12);
    EXPECT_NO_THROW(world.step(4e-6));
    EXPECT_THROW(world.step(1e-5), Error);
    EXPECT_THROW(world.step(0.0), Error);
}

TEST(Guards, a_body_without_numbers_is_named)
{
    World world = quiet_world(0.3, 0.7);
    const int shape = world.add_shape(Shape::sphere());
    add_sphere(world, shape, 2e-3, {0, 0, 0});
    add_sphere(world, shape, 2e-3, {1, 0, 0});
    world.set_external_force(1, {std::nan(""), 0, 0}, Vec3::Zero());
    try {
        world.advance(1e-4);
        FAIL();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("body 1 (coarse)"), std::string::npos) << e.what();
    }
    BodySpec bad;
    bad.position.x() = std::nan("");
    EXPECT_THROW(world.add_body(bad), Error);
}

TEST(Walls, moving_plane_does_the_work_that_the_ledger_says)
{
    World world = quiet_world(0.0, 0.0);
    const int shape = world.add_shape(Shape::sphere());
    const int wall = world.add_plane(Vec3::Zero(), Vec3::UnitX());
    add_sphere(world, shape, 2e-3, {1.2e-3, 0, 0}, {-0.1, 0, 0});
    world.set_wall_velocity(wall, {0.05, 0, 0});
    world.advance(5e-3, 1e-6);
    EXPECT_NEAR(world.velocity(0).x(), 0.1 + 2 * 0.05, 1e-9);
    const Energy e = world.energy();
    EXPECT_NEAR(e.closure, 0.0, 1e-6 * e.kinetic);
    EXPECT_NEAR(world.wall_point(wall).x(), 0.05 * 5e-3, 1e-15);
}

TEST(Walls, sphere_falls_through_a_hole_and_a_larger_one_rests_on_four_rims)
{
    World world = quiet_world(0.3, 0.0, {0, 0, -g});
    const int shape = world.add_shape(Shape::sphere());
    const double top = 2e-3, hole = 6e-3;
    world.add_plate(top, 1e-3, hole, 12e-3, {0, 0});
    const int small = add_sphere(world, shape, 5.9e-3, {12e-3, 12e-3, 8e-3});
    const int large = add_sphere(world, shape, 8e-3, {0, 0, 6e-3});
    const int on_bar = add_sphere(world, shape, 3e-3, {6e-3, 0, 3.6e-3});
    world.advance(0.1, 2e-6);
    EXPECT_LT(world.position(small).z(), -0.03);
    EXPECT_NEAR(world.position(small).x(), 12e-3, 1e-12) << "on the axis it passes without touching";
    // The rims touch the sphere at half the hole from the axis.
    const double rest = top + std::sqrt(16e-6 - 9e-6);
    EXPECT_NEAR(world.position(large).z(), rest, 1e-6);
    int rims = 0;
    for (const Contact& c : world.contacts()) rims += c.first == large;
    EXPECT_EQ(rims, 4);
    EXPECT_NEAR(world.position(on_bar).z(), top + 1.5e-3, 1e-7);
    EXPECT_LT(world.statistics().max_speed - world.velocity(small).norm(), 1e-9);
}

TEST(Walls, plate_distance_is_the_distance_to_its_solid)
{
    // Brute force: nearest of many points of the solid's surface and inside.
    World world = quiet_world(0.0, 0.0);
    const int shape = world.add_shape(Shape::sphere());
    world.add_plate(0.0, 1e-3, 2e-3, 5e-3, {0, 0});
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> u(-1.0, 1.0);
    for (int trial = 0; trial < 200; ++trial) {
        const Vec3 p(4e-3 * u(random), 4e-3 * u(random), 1.5e-3 * u(random));
        double nearest = 1.0;
        for (int i = -120; i <= 120; ++i)
            for (int j = -120; j <= 120; ++j) {
                const double x = 5e-5 * i, y = 5e-5 * j;
                const double hx = x - 5e-3 * std::nearbyint(x / 5e-3), hy = y - 5e-3 * std::nearbyint(y / 5e-3);
                if (std::abs(hx) < 1e-3 - 1e-12 && std::abs(hy) < 1e-3 - 1e-12) continue;
                const double z = std::clamp(p.z(), -1e-3, 0.0);
                nearest = std::min(nearest, (p - Vec3(x, y, z)).norm());
            }
        if (nearest < 1.2e-4) continue;
        // A sphere whose radius is a little less than that distance does not touch; a little more does.
        for (const double factor : {-1.0, 1.0}) {
            World probe = quiet_world(0.0, 0.0);
            const int s = probe.add_shape(Shape::sphere());
            probe.add_plate(0.0, 1e-3, 2e-3, 5e-3, {0, 0});
            add_sphere(probe, s, 2.0 * (nearest + factor * 4e-5), p);
            EXPECT_EQ(probe.statistics().contacts > 0, factor > 0.0) << p.transpose() << " " << nearest;
        }
    }
    (void)shape;
}

TEST(Bodies, removed_body_loses_its_contacts_and_the_ledger_closes)
{
    World world = quiet_world(0.0, 0.0, {0, 0, -g});
    const int shape = world.add_shape(Shape::sphere());
    world.add_plane(Vec3::Zero(), Vec3::UnitZ());
    const double d = 2e-3;
    for (int k = 0; k < 3; ++k) add_sphere(world, shape, d, {0, 0, 0.5 * d + k * d});
    world.advance(2e-3);
    world.remove_body(1);
    EXPECT_EQ(world.active_count(), 2);
    world.advance(2e-3);
    EXPECT_EQ(world.body_count(), 3);
    EXPECT_FALSE(world.active(1));
    const Energy e = world.energy();
    EXPECT_NEAR(e.closure, 0.0, 1e-6 * world.mass(0) * g * d);
    for (const Contact& c : world.contacts()) EXPECT_TRUE(c.first != 1 && c.second != 1);
}

TEST(Periodic, spheres_collide_through_the_border)
{
    WorldOptions o;
    o.gravity.setZero();
    o.period = {0.01, 0, 0};
    World world(o);
    world.add_material({"default", 2780.0, 2e5, 1e5, 0.0, 0.0});
    const int shape = world.add_shape(Shape::sphere());
    add_sphere(world, shape, 2e-3, {0.002, 0, 0}, {-0.1, 0, 0});
    add_sphere(world, shape, 2e-3, {0.008, 0, 0});
    world.advance(0.03);
    EXPECT_NEAR(world.velocity(0).x(), 0.0, 1e-9);
    EXPECT_NEAR(world.velocity(1).x(), -0.1, 1e-9);
}
