// Same bits for any number of threads, after a restart, and with lists made at other times.
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "shapes_for_tests.h"

using namespace coral;
using namespace coral::dem;
using namespace coral::dem::testing;

namespace {

/// Three grids falling on a bed of spheres in a box.
World mixed_world(double skin = 0.0)
{
    WorldOptions o;
    o.skin = skin;
    o.gravity = {0, 0, -300.0};  // to settle in few steps
    World world(o);
    world.add_material({"default", 2780.0, 2e5, 1e5, 0.7, 0.3});
    const int sphere = world.add_shape(Shape::sphere());
    const int grain = world.add_shape(grid_ellipsoid({7e-3, 5e-3, 4e-3}, 0.3e-3, 1500, 2e-3));
    world.add_box(Vec3::Zero(), Vec3(21e-3, 21e-3, 60e-3));
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> u(0.0, 1.0);
    for (int k = 0; k < 3; ++k) {
        BodySpec b;
        b.shape = grain;
        b.position = {7.5e-3 + 6e-3 * (k % 2), 7.5e-3 + 6e-3 * (k / 2), 32e-3 + 10e-3 * k};
        b.orientation = Quat(u(random), u(random), u(random), u(random)).normalized();
        b.velocity = {0, 0, -1.5};
        world.add_body(b);
    }
    for (int k = 0; k < 1200; ++k)
        add_sphere(world, sphere, 1.5e-3 + 0.5e-3 * u(random), Vec3(2.05e-3 * (0.6 + k % 10), 2.05e-3 * (0.6 + k / 10 % 10), 1.05e-3 + 2.01e-3 * (k / 100)), {0.2 * u(random), 0.1 * u(random), -0.3});
    return world;
}

void expect_same(const World& a, const World& b)
{
    ASSERT_EQ(a.body_count(), b.body_count());
    for (int i = 0; i < a.body_count(); ++i) {
        ASSERT_EQ(a.position(i), b.position(i)) << i;
        ASSERT_EQ(a.velocity(i), b.velocity(i)) << i;
        ASSERT_EQ(a.angular_velocity(i), b.angular_velocity(i)) << i;
        ASSERT_EQ(a.orientation(i).coeffs(), b.orientation(i).coeffs()) << i;
    }
    EXPECT_EQ(a.energy().friction, b.energy().friction);
    EXPECT_EQ(a.energy().closure, b.energy().closure);
}

}  // namespace

TEST(Restart, threads_and_lists_change_no_bit_and_a_restart_goes_on_bit_for_bit)
{
    const double dt = 2e-6;
    set_thread_count(1);
    World one = mixed_world();
    one.advance(0.003, dt);
    EXPECT_GT(one.statistics().contacts, 200);
    EXPECT_GT(one.contacts().back().second, -8);
    const std::vector<std::uint8_t> state = one.save();
    one.advance(0.001, dt);

    set_thread_count(2);
    World two = mixed_world();
    two.advance(0.003, dt);
    EXPECT_EQ(two.save().size(), state.size());
    two.advance(0.001, dt);
    expect_same(one, two);

    World wide = mixed_world(0.9e-3);
    wide.advance(0.003, dt);
    wide.advance(0.001, dt);
    EXPECT_LT(wide.counters().rebuilds, one.counters().rebuilds);
    for (int i = 0; i < one.body_count(); ++i) ASSERT_EQ(one.position(i), wide.position(i)) << i;

    set_thread_count(1);
    World resumed = mixed_world();
    resumed.restore(state);
    EXPECT_EQ(resumed.contacts().size(), two.contacts().size() > 0 ? resumed.contacts().size() : 0);
    resumed.advance(0.001, dt);
    expect_same(one, resumed);

    std::vector<std::uint8_t> damaged = state;
    damaged[damaged.size() / 2] ^= 1;
    EXPECT_THROW(resumed.restore(damaged), Error);
    std::vector<std::uint8_t> older = state;
    older[7] = '1';  // of the version
    try {
        resumed.restore(older);
        ADD_FAILURE() << "an older state was taken";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("another version"), std::string::npos) << error.what();
    }
    EXPECT_THROW(resumed.restore(std::span(state).first(100)), Error);
    World other = quiet_world(0.3, 0.7);
    EXPECT_THROW(other.restore(state), Error);
    set_thread_count(0);
}

TEST(Restart, springs_carry_a_packing_into_another_world)
{
    World a = mixed_world();
    set_thread_count(1);
    a.advance(0.004, 2e-6);
    const std::vector<ContactSpring> springs = a.contact_springs();
    ASSERT_GT(springs.size(), 100u);
    World b = mixed_world();
    for (int i = 0; i < a.body_count(); ++i) {
        b.set_pose(i, a.position(i), a.orientation(i));
        b.set_velocity(i, a.velocity(i), a.angular_velocity(i));
    }
    b.set_contact_springs(springs);
    const Energy ea = a.energy(), eb = b.energy();
    EXPECT_GT(ea.elastic_tangential, 0.0);
    EXPECT_NEAR(eb.elastic_tangential / ea.elastic_tangential, 1.0, 0.1) << "sliding contacts are capped anew, by the velocities of now";
    EXPECT_NEAR(eb.elastic_normal / ea.elastic_normal, 1.0, 1e-9);
    const std::vector<ContactSpring> again = b.contact_springs();
    EXPECT_EQ(again.size(), springs.size());
}

TEST(Ledger, closes_in_a_packing_that_falls_and_settles)
{
    set_thread_count(1);
    World world = mixed_world();
    world.advance(0.005, 1e-6);
    const Energy e = world.energy();
    RecordProperty("closure", std::to_string(e.closure / e.gravity_work));
    EXPECT_LT(std::abs(e.closure), 1e-6 * (e.initial + e.gravity_work));
    EXPECT_GT(e.friction, 0.0);
    EXPECT_GT(e.damping, 0.0);
}
