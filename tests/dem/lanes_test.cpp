// Spheres that are worked side by side in the lanes of a register move as each would alone.
#include <gtest/gtest.h>

#include "shapes_for_tests.h"

using namespace coral;
using namespace coral::dem;
using namespace coral::dem::testing;

namespace {

constexpr double step = 2e-6;

/// So many spheres in free flight under gravity, an even distance apart along x, with the same velocity and spin.
World flying(int count)
{
    World world = quiet_world(0.3, 0.7, {0, 0, -9.81});
    const int shape = world.add_shape(Shape::sphere());
    for (int k = 0; k < count; ++k) {
        const int b = add_sphere(world, shape, 2e-3, {k / 64.0, 0, 0});
        world.set_velocity(b, {0, 0.2, 0.3}, {30, -20, 50});
    }
    return world;
}

/// So many pairs of unequal spheres that are about to meet off their centres, an even distance apart along y: all alike, without a motion along y.
World meeting(int pairs)
{
    World world = quiet_world(0.3, 0.4);
    const int shape = world.add_shape(Shape::sphere());
    for (int k = 0; k < pairs; ++k) {
        const double y = k / 64.0;
        const int a = add_sphere(world, shape, 2e-3, {0, y, 0}), b = add_sphere(world, shape, 1.5e-3, {1.76e-3, y, 0.4e-3});
        world.set_velocity(a, {0.2, 0, 0.05}, {0, 40, 0});
        world.set_velocity(b, {-0.3, 0, 0.01}, {0, -25, 0});
    }
    return world;
}

/// So many spheres that graze a block each, spinning, an even distance apart along y.
World grazing(int pairs, SphereScheme scheme)
{
    WorldOptions options;
    options.sphere_scheme = scheme;
    World world(options);
    world.add_material({"default", 2780.0, 2e5, 1e5, 0.4, 0.3});
    const int shape = world.add_shape(Shape::sphere()), block = world.add_shape(grid_block({2e-3, 2e-3, 2e-3}, 0.5e-3));
    for (int k = 0; k < pairs; ++k) {
        const double y = k / 64.0;
        add_sphere(world, block, 1.0, {0, y, 0});
        const int fine = add_sphere(world, shape, 1.5e-3, {0.3e-3, y, 2.77e-3});
        world.set_velocity(fine, {0.4, 0, -0.2}, {0, -60, 0});
    }
    return world;
}

}  // namespace

TEST(SideBySide, free_spheres_move_as_one_alone)
{
    World lone = flying(1), many = flying(37);
    many.set_motion(5, Motion::fixed);  // its neighbours are then no full group
    for (World* world : {&lone, &many})
        for (int k = 0; k < 1000; ++k) world->step(step);
    const double turned = Vec3(30, -20, 50).norm() * 1000 * step;
    EXPECT_NEAR(2.0 * std::acos(lone.orientation(0).w()), turned, 1e-6);
    for (int b = 0; b < many.body_count(); ++b) {
        if (b == 5) continue;
        EXPECT_EQ(many.position(b).y(), lone.position(0).y()) << b;
        EXPECT_EQ(many.position(b).z(), lone.position(0).z()) << b;
        EXPECT_EQ(many.velocity(b), lone.velocity(0)) << b;
        EXPECT_EQ(many.angular_velocity(b), lone.angular_velocity(0)) << b;
        EXPECT_EQ(many.orientation(b).coeffs(), lone.orientation(0).coeffs()) << b;
    }
    const Energy e = many.energy();
    EXPECT_NEAR(e.closure, 0.0, 1e-12 * e.kinetic);
}

TEST(SideBySide, contacts_press_and_rub_as_one_alone)
{
    for (const int pairs : {2, 4, 7, 8, 9, 19}) {
        World lone = meeting(1), many = meeting(pairs);
        bool touched = false;
        for (int k = 0; k < 600; ++k) {
            lone.step(step);
            many.step(step);
            touched = touched || !lone.contacts().empty();
        }
        EXPECT_TRUE(touched);
        EXPECT_GT((lone.velocity(0) - Vec3(0.2, 0, 0.05)).norm(), 0.05) << "they have parted again";
        EXPECT_GT(std::abs(lone.angular_velocity(0).y() - 40), 1.0) << "and rubbed";
        for (int b = 0; b < many.body_count(); ++b) {
            EXPECT_EQ(many.velocity(b), lone.velocity(b % 2)) << b << " of " << pairs << " pairs";
            EXPECT_EQ(many.angular_velocity(b), lone.angular_velocity(b % 2)) << b << " of " << pairs << " pairs";
        }
    }
}

TEST(SideBySide, fines_press_on_grains_as_one_alone)
{
    for (const SphereScheme scheme : {SphereScheme::nearest, SphereScheme::walls})
        for (const int pairs : {2, 5, 8, 11}) {
            World lone = grazing(1, scheme), many = grazing(pairs, scheme);
            bool touched = false;
            for (int k = 0; k < 400; ++k) {
                lone.step(step);
                many.step(step);
                touched = touched || !lone.contacts().empty();
            }
            EXPECT_TRUE(touched);
            EXPECT_GT(lone.velocity(1).z(), 0.05) << "it has sprung off";
            EXPECT_GT(std::abs(lone.angular_velocity(1).y() + 60), 1.0) << "and rubbed";
            EXPECT_GT(lone.angular_velocity(0).norm(), 0.1) << "and turned the grain";
            const Energy e = lone.energy();
            EXPECT_NEAR(e.closure, 0.0, 1e-9 * e.initial);
            for (int b = 0; b < many.body_count(); ++b) {
                // The sum over triangles leaves a breath of motion along y, that rounds by place.
                EXPECT_LT((many.velocity(b) - lone.velocity(b % 2)).norm(), 1e-18) << b << " of " << pairs << " pairs";
                EXPECT_LT((many.angular_velocity(b) - lone.angular_velocity(b % 2)).norm(), 1e-16) << b << " of " << pairs << " pairs";
            }
        }
}
