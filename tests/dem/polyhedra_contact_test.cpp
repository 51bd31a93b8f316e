// Contacts of polyhedra and superellipsoids: force in closed form, invariance, energy, restart.
#include <gtest/gtest.h>

#include "core/parallel.h"
#include "dem/superellipsoid.h"
#include "polyhedra_for_tests.h"

using namespace coral;
using namespace coral::dem;
using namespace coral::dem::testing;

namespace {

int add(World& world, int shape, const Vec3& position, const Quat& orientation = Quat::Identity(), const Vec3& velocity = Vec3::Zero(),
        const Vec3& spin = Vec3::Zero(), double scale = 1.0)
{
    BodySpec b;
    b.shape = shape;
    b.position = position;
    b.orientation = orientation;
    b.velocity = velocity;
    b.angular_velocity = spin;
    b.scale = scale;
    return world.add_body(b);
}

Quat random_turn(std::mt19937_64& random)
{
    std::normal_distribution<double> n;
    const double w = n(random), x = n(random), y = n(random), z = n(random);
    return Quat(w, x, y, z).normalized();
}

Vec3 random_direction(std::mt19937_64& random) { return random_turn(random) * Vec3::UnitX(); }

struct Bounces {
    int count = 0;
    double drift = 0, worst = 0;  ///< of the energy: at the end per bounce, and at any time without contact
    double step = 0;
};

/// Bodies without friction and damping in a box, until they have bounced `wanted` times.
Bounces bounce(const std::vector<std::shared_ptr<const Shape>>& shapes, double edge, int wanted, unsigned seed, double step = 0)
{
    World world = quiet_world(0.0, 0.0);
    world.add_box(Vec3::Zero(), Vec3::Constant(edge));
    std::mt19937_64 random(seed);
    for (std::size_t k = 0; k < shapes.size(); ++k) {
        const double r = shapes[k]->equivalent_radius();
        const Vec3 place = Vec3::Constant(0.5 * edge) + (shapes.size() == 1 ? 0.0 : (k == 0 ? -0.22 : 0.22) * edge) * Vec3::Ones();
        add(world, world.add_shape(shapes[k]), place, random_turn(random), 0.2 * random_direction(random), 0.2 / r * random_direction(random),
            shapes[k]->kind() == ShapeKind::sphere ? 2e-3 : 1.0);
    }
    Bounces out;
    out.step = step > 0 ? step : world.auto_time_step();
    const double before = world.energy().stored();
    bool touched = false;
    for (std::int64_t s = 0; out.count < wanted && s < 4000000; ++s) {
        world.step(out.step);
        const bool now = world.statistics().contacts > 0;
        if (touched && !now) {
            ++out.count;
            out.drift = std::abs(world.energy().stored() / before - 1.0);
            out.worst = std::max(out.worst, out.drift);
        }
        touched = now;
    }
    out.drift /= std::max(out.count, 1);
    return out;
}

std::shared_ptr<const Shape> egg() { return superellipsoid_shape({Vec3(1.3e-3, 1e-3, 0.8e-3), 0.6, 0.8}, 1.1e-3); }

}  // namespace

TEST(PolyhedronContact, cube_flat_on_a_plane_has_the_force_of_the_law)
{
    // kn/(2 pi R) [A u (2 + u^2)/(1 + u^2)^1.5 + 4 L d u/sqrt(1 + u^2)], u = 100 d/D, with the volume-equivalent R and D of the cube; the
    // second part are the sides, immersed down to d.
    const double edge = 2e-3, r = std::cbrt(3.0 / (4.0 * std::numbers::pi)) * edge;
    for (const double depth : {2e-6, 1e-5, 5e-5})
        for (const auto& [nodes, tolerance] : {std::pair{2500, 0.025}, std::pair{10000, 0.015}}) {
            World world = quiet_world(0.0, 0.0);
            const Vec3 normal = Vec3(1, 2, 3).normalized();
            world.add_plane(Vec3::Zero(), normal);
            const Quat turn = Quat::FromTwoVectors(Vec3::UnitZ(), normal);
            add(world, world.add_shape(polyhedron_shape(cube(edge), nodes)), (0.5 * edge - depth) * normal, turn);
            const std::vector<Contact> c = world.contacts();
            ASSERT_EQ(c.size(), 1u);
            const double u = 100.0 * depth / (2 * r);
            const double expected = 2e5 / (2 * std::numbers::pi * r) *
                                    (edge * edge * u * (2 + u * u) / std::pow(1 + u * u, 1.5) + 4 * edge * depth * u / std::sqrt(1 + u * u));
            EXPECT_NEAR(c[0].normal_force.norm() / expected, 1.0, tolerance) << depth << " " << nodes;
            EXPECT_NEAR(c[0].normal.dot(normal), 1.0, 1e-12);
            EXPECT_NEAR(c[0].overlap, depth, 1e-15);
            EXPECT_LT(world.contact_torques()[0].norm(), 1e-9 * expected * edge) << "pressed in the middle";
        }
}

TEST(PolyhedronContact, sphere_on_a_polyhedron_touches_face_edge_and_corner_at_their_distance)
{
    World world = quiet_world(0.0, 0.0);
    const int cube_shape = world.add_shape(polyhedron_shape(cube(2e-3))), ball = world.add_shape(Shape::sphere());
    BodySpec fixed;
    fixed.shape = cube_shape;
    fixed.motion = Motion::fixed;
    fixed.scale = 2.0;
    world.add_body(fixed);  // half edge 2 mm
    const double r = 1e-3, delta = 5e-6;
    for (const Vec3& corner : {Vec3(0.3e-3, 0.2e-3, 2e-3), Vec3(2e-3, 0.1e-3, 2e-3), Vec3(2e-3, 2e-3, 2e-3)}) {
        Vec3 n = corner;
        for (int k = 0; k < 3; ++k) n[k] = n[k] > 1.9e-3 ? 1.0 : 0.0;
        n.normalize();
        const int b = add(world, ball, corner + (r - delta) * n, Quat::Identity(), Vec3::Zero(), Vec3::Zero(), 2 * r);
        const std::vector<Contact> c = world.contacts();
        ASSERT_EQ(c.size(), 1u);
        EXPECT_NEAR(c[0].normal_force.norm() / (2e5 * delta), 1.0, 1e-9);
        EXPECT_LT((c[0].normal - n).norm(), 1e-12);
        world.remove_body(b);
    }
}

TEST(PolyhedronContact, forces_turn_with_the_bodies)
{
    std::mt19937_64 random(3);
    const auto a = polyhedron_shape(stone(26, 4)), b = polyhedron_shape(stone(16, 9));
    for (int k = 0; k < 10; ++k) {
        const Quat qa = random_turn(random), qb = random_turn(random), turn = random_turn(random);
        const Vec3 way = random_direction(random);
        double near = 0.0;
        Vec3 force[2], torque[2];
        for (const bool turned : {false, true}) {
            World world = quiet_world(0.0, 0.0);
            const Quat q = turned ? turn : Quat::Identity();
            const int s = world.add_shape(a), t = world.add_shape(b);
            add(world, s, Vec3::Zero(), q * qa);
            add(world, t, 2e-3 * (q * way), q * qb);
            if (!turned) {  // nearer until 20 um deep
                double low = 0.2e-3, high = 3e-3;
                for (int it = 0; it < 30; ++it) {
                    near = 0.5 * (low + high);
                    world.set_pose(1, near * way, qb);
                    const std::vector<Contact> c = world.contacts();
                    (!c.empty() && c[0].overlap > 2e-5 ? low : high) = near;
                }
            }
            world.set_pose(1, near * (q * way), q * qb);
            ASSERT_EQ(world.contacts().size(), 1u);
            force[turned] = world.contact_forces()[1];
            torque[turned] = world.contact_torques()[1];
            EXPECT_LT((world.contact_forces()[0] + force[turned]).norm(), 1e-12 * force[turned].norm());
        }
        EXPECT_LT((force[1] - turn * force[0]).norm(), 1e-8 * force[0].norm());
        EXPECT_LT((torque[1] - turn * torque[0]).norm(), 1e-8 * force[0].norm() * 1e-3);
    }
}

TEST(PolyhedronContact, force_does_not_grow_with_the_number_of_nodes)
{
    // Stones of 26 faces pressed into each other until the deepest node of 20000 is 20 um deep, 1 % of the diameter, in 60 poses.
    const Polyhedron body = stone(26, 4);
    const auto fine = polyhedron_shape(body, 20000);
    const std::vector<int> counts{160, 320, 640, 1250, 2500};
    std::vector<double> mean(counts.size(), 0.0), square(counts.size(), 0.0);
    std::mt19937_64 random(2);
    const int poses = 60;
    for (int pose = 0; pose < poses; ++pose) {
        const Vec3 u = random_direction(random);
        const Quat q = random_turn(random);
        double low = 0.0, high = 3e-3;
        for (int it = 0; it < 20; ++it) {
            const double at = 0.5 * (low + high);
            double depth = 0.0;
            for (const Vec3& n : fine->nodes()) depth = std::max(depth, -body.distance(q.conjugate() * (n - at * u)));
            (depth > 2e-5 ? low : high) = at;
        }
        const auto force = [&](const std::shared_ptr<const Shape>& shape) {
            World world = quiet_world(0.0, 0.0);
            const int id = world.add_shape(shape);
            add(world, id, Vec3::Zero());
            add(world, id, 0.5 * (low + high) * u, q);
            world.contacts();
            return world.contact_forces()[0].norm();
        };
        const double reference = force(fine);
        for (std::size_t k = 0; k < counts.size(); ++k) {
            const double ratio = force(polyhedron_shape(body, counts[k])) / reference;
            mean[k] += ratio / poses;
            square[k] += ratio * ratio / poses;
        }
    }
    for (std::size_t k = 0; k < counts.size(); ++k)
        std::printf("%5d nodes: force %.3f +- %.3f of that of 20000\n", counts[k], mean[k], std::sqrt(std::max(square[k] - mean[k] * mean[k], 0.0)));
    EXPECT_NEAR(mean[4], 1.0, 0.05);
    EXPECT_NEAR(mean[3], 1.0, 0.2);
    EXPECT_NEAR(mean[2], 1.0, 0.3);
    EXPECT_LT(mean[0], 1.2) << "few nodes miss the contact; they must not stand for more than there is";
}

TEST(Bounce, every_pair_of_shapes_keeps_its_energy_at_the_automatic_step)
{
    const auto s12 = polyhedron_shape(stone(12, 3)), s40 = polyhedron_shape(stone(40, 5)), block = polyhedron_shape(box({2e-3, 1.6e-3, 1.2e-3})),
               chip = polyhedron_shape(tetrahedron(2.5e-3)), ball = Shape::sphere(), oval = egg();
    using List = std::vector<std::shared_ptr<const Shape>>;
    const std::tuple<const char*, List, double> cases[] = {{"stone of 12 faces - plane", {s12}, 4e-3},     {"stone of 40 faces - plane", {s40}, 4e-3},
                                                           {"block - plane", {block}, 4.5e-3},             {"tetrahedron - plane", {chip}, 5e-3},
                                                           {"stone - stone", {s12, s40}, 6.5e-3},          {"block - block", {block, block}, 7e-3},
                                                           {"sphere - stone", {ball, s12}, 6.5e-3},        {"sphere - block", {ball, block}, 7e-3},
                                                           {"superellipsoid - plane", {oval}, 4.5e-3},     {"superellipsoid - block", {oval, block}, 7e-3}};
    for (const auto& [name, shapes, edge] : cases) {
        const Bounces b = bounce(shapes, edge, 30, 17);
        std::printf("%-28s step %.2e s, %3d bounces, drift %.1e per bounce, worst %.1e\n", name, b.step, b.count, b.drift, b.worst);
        EXPECT_EQ(b.count, 30) << name;
        EXPECT_LT(b.drift, 1e-5) << name;
        EXPECT_LT(b.worst, 1e-3) << name;
    }
}

TEST(Bounce, block_dropped_flat_springs_back_with_its_energy)
{
    World world = quiet_world(0.0, 0.0);
    world.add_box(Vec3::Zero(), Vec3::Constant(3e-3));
    add(world, world.add_shape(polyhedron_shape(box({2e-3, 1.6e-3, 1.2e-3}))), Vec3::Constant(1.5e-3), Quat::Identity(), {0, 0, -0.2});
    const double before = world.energy().kinetic;
    double worst = 0.0;
    for (int k = 0; k < 20; ++k) {
        world.advance(0.01);
        while (world.statistics().contacts > 0) world.step(world.auto_time_step());
        worst = std::max(worst, std::abs(world.energy().kinetic / before - 1.0));
    }
    std::printf("flat block: worst %.1e\n", worst);
    EXPECT_LT(worst, 1e-3) << "about 20 rebounds; the first ones with all nodes at once";
}

TEST(PolyhedronContact, free_spin_keeps_energy_and_momentum)
{
    World world = quiet_world(0.0, 0.0);
    add(world, world.add_shape(polyhedron_shape(stone(12, 3), 200)), Vec3::Zero(), Quat::Identity(), Vec3::Zero(), {0.3, 100, -0.2});
    const double energy = world.energy().kinetic;
    const Vec3 l = angular_momentum(world);
    for (int k = 0; k < 50000; ++k) world.step(3e-6);
    EXPECT_NEAR(world.energy().kinetic / energy, 1.0, 1e-6);
    EXPECT_LT((angular_momentum(world) - l).norm() / l.norm(), 1e-10);
}

namespace {

/// Stones, pebbles and balls that settle in a box, with friction and damping.
World mixed_bed()
{
    World world = quiet_world(0.3, 0.7, {0, 0, -1000.0});
    world.add_box(Vec3::Zero(), Vec3(8e-3, 8e-3, 30e-3));
    const int shapes[] = {world.add_shape(polyhedron_shape(stone(12, 3), 600)), world.add_shape(polyhedron_shape(stone(30, 5), 600)), world.add_shape(egg()),
                          world.add_shape(Shape::sphere())};
    std::mt19937_64 random(11);
    for (int k = 0; k < 45; ++k)
        add(world, shapes[k % 4], Vec3(1.4e-3 + 2.6e-3 * (k % 3), 1.4e-3 + 2.6e-3 * (k / 3 % 3), 1.4e-3 + 2.6e-3 * (k / 9)), random_turn(random),
            0.1 * random_direction(random) - Vec3(0, 0, 1.0), Vec3::Zero(), k % 4 == 3 ? 2e-3 : 1.0);
    return world;
}

void expect_same(const World& a, const World& b)
{
    for (int i = 0; i < a.body_count(); ++i) {
        ASSERT_EQ(a.position(i), b.position(i)) << i;
        ASSERT_EQ(a.velocity(i), b.velocity(i)) << i;
        ASSERT_EQ(a.angular_velocity(i), b.angular_velocity(i)) << i;
        ASSERT_EQ(a.orientation(i).coeffs(), b.orientation(i).coeffs()) << i;
    }
    EXPECT_EQ(a.energy().closure, b.energy().closure);
}

}  // namespace

TEST(MixedBed, threads_change_no_bit_and_a_restart_goes_on_bit_for_bit)
{
    set_thread_count(1);
    World one = mixed_bed();
    one.advance(4.5e-3, 1e-6);
    EXPECT_GT(one.statistics().contacts, 20);
    const std::vector<std::uint8_t> state = one.save();
    one.advance(5e-4, 1e-6);
    World resumed = mixed_bed();
    resumed.restore(state);
    resumed.advance(5e-4, 1e-6);
    expect_same(one, resumed);
    set_thread_count(2);
    World two = mixed_bed();
    two.advance(4.5e-3, 1e-6);
    two.advance(5e-4, 1e-6);
    expect_same(one, two);
    set_thread_count(0);
    const Energy e = one.energy();
    std::printf("mixed bed: closure %.1e of the work done\n", e.closure / (e.initial + e.gravity_work));
    EXPECT_LT(std::abs(e.closure), 1e-6 * (e.initial + e.gravity_work));
    EXPECT_LT(one.statistics().max_speed, 2.0);
}
