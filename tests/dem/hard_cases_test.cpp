// Cases that break contact codes: thin shells, several patches, deep insertion, the periodic seam, very unequal bodies, degenerate geometry.
#include <gtest/gtest.h>

#include <set>

#include "cavities_for_tests.h"
#include "dem/superellipsoid.h"
#include "polyhedra_for_tests.h"
#include "sdf/mass_properties.h"

using namespace coral;
using namespace coral::dem;
using namespace coral::dem::testing;

namespace {

int add(World& world, int shape, const Vec3& position, const Quat& turn = Quat::Identity(), const Vec3& velocity = Vec3::Zero(), double scale = 1,
        Motion motion = Motion::free)
{
    BodySpec b;
    b.shape = shape;
    b.position = position;
    b.orientation = turn;
    b.velocity = velocity;
    b.scale = scale;
    b.motion = motion;
    return world.add_body(b);
}

Quat random_turn(std::mt19937_64& random)
{
    std::normal_distribution<double> n;
    const double w = n(random), x = n(random), y = n(random), z = n(random);
    return Quat(w, x, y, z).normalized();
}

World options_world(const WorldOptions& o, double damping, double friction)
{
    World world(o);
    world.add_material({"default", 2780.0, 2e5, 1e5, friction, damping});
    return world;
}

WorldOptions scheme_options(SphereScheme scheme)
{
    WorldOptions o;
    o.gravity.setZero();
    o.sphere_scheme = scheme;
    return o;
}

/// One of each kind that pairs are made of, about 2 mm wide.
struct Kind {
    const char* name;
    std::shared_ptr<const Shape> shape;
    double scale;
};
const std::vector<Kind>& kinds()
{
    static const std::vector<Kind> all{{"sphere", Shape::sphere(), 2e-3},
            {"level set", grid_ellipsoid({1.3e-3, 1e-3, 0.8e-3}, 0.1e-3, 1500, 1.5e-3), 1},
            {"polyhedron", polyhedron_shape(stone(26, 4), 1500), 1},
            {"superellipsoid", superellipsoid_shape({Vec3(1.2e-3, 1e-3, 0.8e-3), 0.7, 0.8}, 1.5e-3, "superellipsoid", 1500, 0.1e-3), 1}};
    return all;
}

/// Distance along a line at which the overlap of two bodies of a world is reached.
double place_at(World& world, const Vec3& way, const Quat& turn, double overlap)
{
    double low = 0.3e-3, high = 3.5e-3;
    for (int it = 0; it < 26; ++it) {
        const double at = 0.5 * (low + high);
        world.set_pose(1, at * way, turn);
        const std::vector<Contact> c = world.contacts();
        (!c.empty() && c[0].overlap > overlap ? low : high) = at;
    }
    return 0.5 * (low + high);
}

}  // namespace

TEST(EveryPair, forces_turn_with_the_bodies)
{
    std::mt19937_64 random(3);
    const std::vector<Kind>& all = kinds();
    for (const SphereScheme scheme : {SphereScheme::nearest, SphereScheme::walls})
        for (std::size_t a = 0; a < all.size(); ++a)
            for (std::size_t b = a; b < all.size(); ++b)
                for (int k = 0; k < 3; ++k) {
                    const Quat qa = random_turn(random), qb = random_turn(random), turn = random_turn(random);
                    const Vec3 way = random_turn(random) * Vec3::UnitX();
                    double near = 0;
                    Vec3 force[2], torque[2];
                    for (const bool turned : {false, true}) {
                        World world = options_world(scheme_options(scheme), 0, 0);
                        const Quat q = turned ? turn : Quat::Identity();
                        add(world, world.add_shape(all[a].shape), Vec3::Zero(), q * qa, Vec3::Zero(), all[a].scale);
                        add(world, world.add_shape(all[b].shape), 3.5e-3 * (q * way), q * qb, Vec3::Zero(), all[b].scale);
                        if (!turned) near = place_at(world, way, qb, 2e-5);
                        world.set_pose(1, near * (q * way), q * qb);
                        ASSERT_EQ(world.contacts().size(), 1u) << all[a].name << " - " << all[b].name;
                        force[turned] = world.contact_forces()[1];
                        torque[turned] = world.contact_torques()[1];
                        EXPECT_LT((world.contact_forces()[0] + force[turned]).norm(), 1e-12 * force[turned].norm());
                        const Vec3 about = world.contact_torques()[0] + torque[turned] + (world.position(1) - world.position(0)).cross(force[turned]);
                        EXPECT_LT(about.norm(), 1e-10 * 1e-3 * force[turned].norm()) << "no torque comes from nowhere";
                    }
                    EXPECT_LT((force[1] - turn * force[0]).norm(), 1e-8 * force[0].norm()) << all[a].name << " - " << all[b].name;
                    EXPECT_LT((torque[1] - turn * torque[0]).norm(), 1e-8 * force[0].norm() * 1e-3) << all[a].name << " - " << all[b].name;
                }
}

TEST(EveryPair, bounces_across_the_periodic_seam_as_inside)
{
    const std::vector<Kind>& all = kinds();
    for (std::size_t a = 0; a < all.size(); ++a)
        for (std::size_t b = a; b < all.size(); ++b) {
            Vec3 v[2], w[2];
            for (const bool seam : {false, true}) {
                WorldOptions o = scheme_options(SphereScheme::walls);
                o.period = {0.02, 0.02, 0.02};
                World world = options_world(o, 0.3, 0.5);
                // Inside, one meets the other at x = 10 mm; at the seam, at x = 0: the second is given a whole period away.
                const Vec3 first(seam ? 1.5e-3 : 11.5e-3, 0.3e-3, 0.2e-3), second(seam ? 18.6e-3 : 8.6e-3, 0, 0);
                add(world, world.add_shape(all[a].shape), first, Quat(0.8, 0.3, -0.4, 0.33).normalized(), {-0.2, 0, 0}, all[a].scale);
                add(world, world.add_shape(all[b].shape), second, Quat(0.2, 0.7, 0.4, -0.33).normalized(), {0.2, 0.02, 0}, all[b].scale);
                world.advance(6e-3, 1e-6);
                EXPECT_GT(world.counters().contacts, 0) << all[a].name << " - " << all[b].name;
                v[seam] = world.velocity(0);
                w[seam] = world.angular_velocity(0);
            }
            EXPECT_LT((v[1] - v[0]).norm(), 1e-9) << all[a].name << " - " << all[b].name;
            EXPECT_LT((w[1] - w[0]).norm(), 1e-6) << all[a].name << " - " << all[b].name;
        }
}

TEST(EveryPair, half_overlapping_insertion_is_relaxed_without_speed)
{
    const std::vector<Kind>& all = kinds();
    for (const SphereScheme scheme : {SphereScheme::nearest, SphereScheme::walls})
        for (std::size_t a = 0; a < all.size(); ++a)
            for (std::size_t b = a; b < all.size(); ++b) {
                World world = options_world(scheme_options(scheme), 0.3, 0.5);
                add(world, world.add_shape(all[a].shape), Vec3::Zero(), Quat::Identity(), Vec3::Zero(), all[a].scale);
                add(world, world.add_shape(all[b].shape), Vec3(0.9e-3, 0.1e-3, 0.05e-3), Quat(0.9, 0.1, 0.3, 0.2).normalized(), Vec3::Zero(), all[b].scale);
                const int used = world.relax(3e-4, 20000);
                EXPECT_LT(used, 20000) << all[a].name << " - " << all[b].name;
                EXPECT_LE(world.statistics().max_overlap, 3e-4) << all[a].name << " - " << all[b].name;
                world.advance(1e-3, 1e-6);
                EXPECT_LT(world.statistics().max_speed, 0.05) << all[a].name << " - " << all[b].name;
            }
}

TEST(EveryPair, tangent_coincident_and_flat_gradients_give_finite_forces)
{
    const std::vector<Kind>& all = kinds();
    for (const SphereScheme scheme : {SphereScheme::nearest, SphereScheme::walls})
        for (std::size_t a = 0; a < all.size(); ++a)
            for (std::size_t b = a; b < all.size(); ++b) {
                World world = options_world(scheme_options(scheme), 0.3, 0.5);
                add(world, world.add_shape(all[a].shape), Vec3::Zero(), Quat::Identity(), Vec3::Zero(), all[a].scale);
                add(world, world.add_shape(all[b].shape), Vec3::Zero(), Quat::Identity(), Vec3::Zero(), all[b].scale);
                world.contacts();
                EXPECT_TRUE(world.contact_forces()[0].allFinite() && world.contact_torques()[1].allFinite()) << all[a].name << " - " << all[b].name;
            }
    // A node of the lattice in the centre of a round void: the gradient vanishes there, and all walls are as far.
    for (const SphereScheme scheme : {SphereScheme::nearest, SphereScheme::walls}) {
        const double h = 2e-4;
        World world = cavity_world(carved([&](const Vec3& p) { return 0.9e-3 - (p - Vec3::Constant(-0.37 * h)).norm(); }, 1.6e-3, h), scheme);
        add_sphere(world, 1, 2e-3, Vec3::Constant(-0.37 * h));
        EXPECT_TRUE(world.contact_forces()[1].allFinite());
        EXPECT_LT(world.contact_forces()[1].norm(), 2e5 * 0.2e-3) << "never more than the spring";
        world.step(1e-6);
        EXPECT_TRUE(world.velocity(1).allFinite());
    }
}

TEST(ThinShell, keeps_mass_sign_and_whoever_is_inside)
{
    // R 6 mm, wall 0.5 mm, spacing 0.2 mm.
    const double outer = 6e-3, inner = 5.5e-3;
    const auto shell = hollow_ball(outer, inner, 2e-4, 3000, 2e-3);
    const sdf::MassProperties mass = sdf::mass_properties(shell->distance_grid());
    EXPECT_NEAR(mass.volume / shell->volume(), 1.0, 1e-3);
    EXPECT_NEAR(mass.inertia.trace() / shell->inertia().trace(), 1.0, 2e-3);
    EXPECT_GT(shell->distance(Vec3::Zero()), 5e-3);
    std::mt19937_64 random(4);
    for (int k = 0; k < 200; ++k) {
        const double middle = shell->distance(5.75e-3 * (random_turn(random) * Vec3::UnitX()));
        EXPECT_GT(middle, -0.2505e-3);
        EXPECT_LT(middle, -0.13e-3) << "the ridge in the middle of the wall is cut by up to 0.6 spacings";
    }
    for (const SphereScheme scheme : {SphereScheme::nearest, SphereScheme::walls}) {
        World world = options_world(scheme_options(scheme), 0.0, 0.0);
        add(world, world.add_shape(shell), Vec3::Zero(), Quat::Identity(), Vec3::Zero(), 1, Motion::fixed);
        const int ball = world.add_shape(Shape::sphere());
        const int in = add_sphere(world, ball, 2e-3, Vec3(1e-3, 0, 0), {0.3, 0.8, 0.52});
        const int out = add_sphere(world, ball, 2e-3, Vec3(0.1e-3, -0.2e-3, 7.3e-3), {0, 0, -1.0});
        for (int k = 0; k < 40; ++k) {
            world.advance(5e-4, 2e-6);
            EXPECT_LT(world.position(in).norm(), inner - 0.9e-3);
            EXPECT_GT(world.position(out).norm(), outer + 0.9e-3);
        }
        EXPECT_GT(world.velocity(out).z(), 0.9) << "1 m/s came back";
    }
}

TEST(Patches, forces_of_separate_patches_add_up)
{
    // A dumbbell lies on a ring in two places. Copies of it with the nodes of one end weightless feel one place each.
    const double r = 2e-3, half = 3e-3;
    const auto dumbbell = [&](bool left, bool right) {
        GridShapeData d;
        d.name = "dumbbell";
        d.distance = tabulate([&](const Vec3& p) { return to_segment(p.cwiseAbs(), Vec3(half, 0, 0), Vec3(half + 1e-9, 0, 0)) - r; }, Vec3(half + r + 1e-3, r + 1e-3, r + 1e-3), 2e-4);
        for (const double side : {-1.0, 1.0})
            for (const Vec3& u : directions(3000)) {
                d.nodes.push_back(Vec3(side * half, 0, 0) + r * u);
                d.node_areas.push_back((side < 0 ? left : right) ? 4 * std::numbers::pi * r * r / 3000 : 0.0);
            }
        d.volume = 2 * 4.0 / 3.0 * std::numbers::pi * r * r * r;
        d.inertia = d.volume * Vec3(0.4 * r * r, half * half, half * half).asDiagonal().toDenseMatrix();
        return Shape::grid(d);
    };
    GridShapeData ring;
    ring.name = "ring";
    ring.distance = tabulate([&](const Vec3& p) { return std::hypot(p.head<2>().norm() - 5e-3, p.z()) - 2.5e-3; }, Vec3(8.5e-3, 8.5e-3, 3.5e-3), 2e-4);
    ring.nodes = {Vec3(7.5e-3, 0, 0), Vec3(-7.5e-3, 0, 0)};
    ring.node_areas = {1e-6, 1e-6};
    ring.volume = 2 * std::numbers::pi * std::numbers::pi * 5e-3 * 2.5e-3 * 2.5e-3;
    ring.inertia = 1e-12 * Eigen::Matrix3d::Identity();
    Vec3 force[3], torque[3];
    int points[3];
    const bool ends[3][2] = {{true, true}, {true, false}, {false, true}};
    for (int k = 0; k < 3; ++k) {
        World world = quiet_world(0, 0);
        add(world, world.add_shape(Shape::grid(ring)), Vec3::Zero());
        add(world, world.add_shape(dumbbell(ends[k][0], ends[k][1])), Vec3(0.01e-3, 0.2e-3, 3.97e-3), Quat(Eigen::AngleAxisd(0.005, Vec3::UnitY())));
        ASSERT_EQ(world.contacts().size(), 1u);
        force[k] = world.contact_forces()[1];
        torque[k] = world.contact_torques()[1];
        points[k] = world.contacts()[0].points;
    }
    EXPECT_GT(force[1].norm(), 1.0);
    EXPECT_GT(force[2].norm(), 1.0);
    EXPECT_LT((force[0] - force[1] - force[2]).norm(), 1e-9 * force[0].norm());
    EXPECT_LT((torque[0] - torque[1] - torque[2]).norm(), 1e-9 * torque[1].norm());
    EXPECT_GT(points[0], 10);
}

TEST(Patches, hooked_grains_pull_each_other_and_hold)
{
    // Two C-shaped grains (three quarters of a torus) hooked into each other, pulled with 1 N, then pushed sideways.
    const double big = 4e-3, small = 1e-3;
    const auto hook = [&] {
        GridShapeData d;
        d.name = "hook";
        // Open towards -x: the arc from -135 to 135 degrees, with round ends.
        const auto arc = [=](const Vec3& p) {
            const double angle = std::atan2(p.y(), p.x()), limit = 0.75 * std::numbers::pi;
            const double a = std::clamp(angle, -limit, limit);
            return (p - big * Vec3(std::cos(a), std::sin(a), 0)).norm() - small;
        };
        d.distance = tabulate(arc, Vec3(5.8e-3, 5.8e-3, 1.8e-3), 0.2e-3);
        const int around = 180, across = 30;
        for (int i = 0; i < around; ++i)
            for (int j = 0; j < across; ++j) {
                const double a = (2 * (i + 0.5) / around - 1) * 0.75 * std::numbers::pi, t = 2 * std::numbers::pi * (j + 0.5 * (i % 2)) / across;
                const double at = big + small * std::cos(t);
                d.nodes.emplace_back(at * std::cos(a), at * std::sin(a), small * std::sin(t));
                d.node_areas.push_back(at * small * 1.5 * std::numbers::pi * 2 * std::numbers::pi / (around * across));
            }
        d.volume = 1.5 * std::numbers::pi * std::numbers::pi * big * small * small;
        const double axial = d.volume * (big * big + 0.75 * small * small), other = d.volume * (0.5 * big * big + 0.625 * small * small);
        d.inertia = Vec3(other, other, axial).asDiagonal();
        return Shape::grid(d);
    };
    World world = quiet_world(0.5, 0.5);
    const int shape = world.add_shape(hook());
    add(world, shape, Vec3::Zero(), Quat::Identity(), Vec3::Zero(), 1, Motion::fixed);
    // Turned about z to open the other way and about x, so that each passes through the other's ring.
    const Quat turn = Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX())) * Quat(Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitZ()));
    const int b = add(world, shape, Vec3(2 * big - 2.05 * small, 0, 0), turn);
    world.set_external_force(b, {1.0, 0, 0}, Vec3::Zero());
    world.advance(0.02, 4e-6);
    EXPECT_NEAR(world.position(b).x(), 2 * big - 2 * small + 20e-6, 15e-6) << "centres at 6 mm and the overlap";
    EXPECT_NEAR(world.contacts().at(0).normal_force.norm(), 1.0, 0.03);
    world.set_external_force(b, {1.0, 0.4, 0.3}, Vec3::Zero());
    world.advance(0.02, 4e-6);
    EXPECT_LT((world.position(b) - Vec3(2 * big - 2 * small, 0, 0)).norm(), 3e-3) << "it may swing but not come off";
    EXPECT_LT(std::abs(world.energy().closure), 0.05 * world.energy().external_work);
}

TEST(Unequal, light_sphere_leaves_a_level_set_a_thousand_times_heavier_at_twice_its_speed)
{
    for (const SphereScheme scheme : {SphereScheme::nearest, SphereScheme::walls}) {
        World world = options_world(scheme_options(scheme), 0, 0);
        const double v = 0.1;
        add(world, world.add_shape(grid_ball(7.5e-3, 2e-4, 2000, 1.5e-3)), Vec3::Zero(), Quat::Identity(), {v, 0, 0});
        add_sphere(world, world.add_shape(Shape::sphere()), 1.5e-3, {8.3e-3, 0, 0});
        world.advance(6e-3, 2e-6);
        EXPECT_NEAR(world.velocity(1).norm() / v, 1.998, 0.04);
        EXPECT_NEAR(world.velocity(0).x() / v, 0.998, 1e-3);
        EXPECT_NEAR(world.energy().closure / world.energy().initial, 0.0, 1e-6);
    }
}

TEST(Unequal, every_contact_is_found_at_a_size_ratio_of_a_hundred)
{
    std::mt19937_64 random(9);
    std::uniform_real_distribution<double> u(0.0, 1.0);
    WorldOptions o = scheme_options(SphereScheme::nearest);
    o.period = {0.03, 0.03, 0.03};
    World world = options_world(o, 0, 0);
    const int ball = world.add_shape(Shape::sphere()), grain = world.add_shape(grid_ball(5e-3, 2.5e-4, 500, 1e-3));
    add_sphere(world, ball, 10e-3, {0.001, 0.015, 0.015});  // over the seam
    add(world, grain, Vec3(0.016, 0.015, 0.015));
    std::vector<double> radius{5e-3, 5e-3};
    for (int k = 0; k < 6000; ++k) {
        const double d = 1e-4 * (1 + 9 * std::pow(u(random), 8));
        const bool at_first = k % 2 == 0;
        const Vec3 centre = world.position(at_first ? 0 : 1);
        add_sphere(world, ball, d, centre + (5e-3 + 0.5 * d + 2e-4 * (u(random) - 0.4)) * (random_turn(random) * Vec3::UnitX()));
        radius.push_back(0.5 * d);
    }
    std::set<std::pair<int, int>> expected, found;
    const auto nearest = [](double d) { return d - 0.03 * std::nearbyint(d / 0.03); };
    for (int i = 0; i < world.body_count(); ++i)
        for (int j = i + 1; j < world.body_count(); ++j) {
            Vec3 d = world.position(i) - world.position(j);
            for (int k = 0; k < 3; ++k) d[k] = nearest(d[k]);
            const bool on_grid = i == 1 || j == 1;
            const double gap = on_grid ? world.shape(1).distance(i == 1 ? Vec3(-d) : d) - radius[std::size_t(i == 1 ? j : i)]
                                       : d.norm() - radius[std::size_t(i)] - radius[std::size_t(j)];
            if (gap < 0) expected.insert({i, j});
        }
    for (const Contact& c : world.contacts()) found.insert({std::min(c.first, c.second), std::max(c.first, c.second)});
    EXPECT_GT(expected.size(), 3000u);
    EXPECT_EQ(found, expected);
    EXPECT_LT(world.counters().pair_tests, std::int64_t(40) * world.body_count()) << "the large ones do not make everybody everybody's neighbour";
}

TEST(Bounce, level_sets_keep_their_energy_against_every_partner_at_the_automatic_step)
{
    const auto grain = grid_ellipsoid({1.3e-3, 1e-3, 0.8e-3}, 0.1e-3, 2500, 1.2e-3), egg = superellipsoid_shape({Vec3(1.2e-3, 1e-3, 0.8e-3), 0.7, 0.8}, 1.2e-3, "egg", 2500, 0.1e-3),
               pebble = polyhedron_shape(stone(26, 4));
    struct Case {
        const char* name;
        std::vector<Kind> bodies;
        SphereScheme scheme = SphereScheme::nearest;
    };
    const Kind level_set{"level set", grain, 1}, ball{"sphere", Shape::sphere(), 2e-3};
    const Case cases[] = {{"level set - plane", {level_set}},
                          {"level set - level set", {level_set, level_set}},
                          {"level set - superellipsoid", {level_set, {"", egg, 1}}},
                          {"level set - polyhedron", {level_set, {"", pebble, 1}}},
                          {"level set - sphere", {level_set, ball}},
                          {"level set - sphere, walls", {level_set, ball}, SphereScheme::walls}};
    for (const Case& c : cases) {
        World world = options_world(scheme_options(c.scheme), 0, 0);
        const double edge = c.bodies.size() == 1 ? 4e-3 : 6e-3;
        world.add_box(Vec3::Zero(), Vec3::Constant(edge));
        std::mt19937_64 random(17);
        for (std::size_t k = 0; k < c.bodies.size(); ++k) {
            const Vec3 place = Vec3::Constant(0.5 * edge) + (c.bodies.size() == 1 ? 0.0 : (k == 0 ? -0.22 : 0.22) * edge) * Vec3::Ones();
            const int b = add(world, world.add_shape(c.bodies[k].shape), place, random_turn(random), 0.2 * (random_turn(random) * Vec3::UnitX()), c.bodies[k].scale);
            world.set_velocity(b, world.velocity(b), 200 * (random_turn(random) * Vec3::UnitX()));
        }
        const double before = world.energy().stored(), dt = world.auto_time_step();
        int bounces = 0;
        double worst = 0;
        bool touched = false;
        for (std::int64_t s = 0; bounces < 20 && s < 400000; ++s) {
            world.step(dt);
            const bool now = (world.statistics().contacts > 0);
            if (touched && !now) {
                ++bounces;
                worst = std::max(worst, std::abs(world.energy().stored() / before - 1.0));
            }
            touched = now;
        }
        std::printf("%-28s step %.2e s, %d bounces, energy within %.1e\n", c.name, dt, bounces, worst);
        EXPECT_EQ(bounces, 20) << c.name;
        EXPECT_LT(worst, 1e-3) << c.name;
    }
}
