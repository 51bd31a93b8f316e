// Convex polyhedra: exact distances, mass properties, nodes, and their contacts.
#include "dem/polyhedron.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "polyhedra_for_tests.h"

using namespace coral;
using namespace coral::dem;
using namespace coral::dem::testing;

namespace {

/// Closest point of a triangle, by its regions [Ericson 2005, section 5.1.5].
Vec3 closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c)
{
    const Vec3 ab = b - a, ac = c - a, n = ab.cross(ac);
    const Vec3 q = p - n * (n.dot(p - a) / n.squaredNorm());
    const auto side = [&](const Vec3& s, const Vec3& t) { return n.dot((t - s).cross(q - s)) >= 0.0; };
    if (side(a, b) && side(b, c) && side(c, a)) return q;
    Vec3 best = a;
    for (const auto& [s, t] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}}) {
        const Vec3 r = s + (t - s) * std::clamp((p - s).dot(t - s) / (t - s).squaredNorm(), 0.0, 1.0);
        if ((r - p).norm() < (best - p).norm()) best = r;
    }
    return best;
}

/// Distance by looking at every triangle of every face; the sign from the planes.
double brute_force_distance(const Polyhedron& body, const Vec3& p)
{
    double nearest = 1e300, highest = -1e300;
    for (std::size_t f = 0; f < body.faces().size(); ++f) {
        const std::vector<int>& face = body.faces()[f];
        const auto corner = [&](std::size_t k) { return body.vertices()[std::size_t(face[k])]; };
        const Vec3 normal = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
        highest = std::max(highest, normal.dot(p - corner(0)));
        for (std::size_t k = 2; k < face.size(); ++k) nearest = std::min(nearest, (p - closest_on_triangle(p, corner(0), corner(k - 1), corner(k))).norm());
    }
    return highest < 0.0 ? -nearest : nearest;
}

/// Volume, first and second moments by columns along z, each cut exactly by the half-spaces: a second method that knows the planes only.
void column_properties(const Polyhedron& body, int steps, double& volume, Vec3& first, Eigen::Matrix3d& inertia)
{
    const double r = body.bounding_radius(), h = 2 * r / steps;
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    volume = 0.0;
    first.setZero();
    for (int i = 0; i < steps * steps; ++i) {
        const double x = h * (i % steps + 0.5) - r, y = h * (i / steps + 0.5) - r;
        double low = -r, high = r;
        for (std::size_t f = 0; f < body.faces().size(); ++f) {
            const Vec3 n = body.normal(int(f));
            const double rest = body.offset(int(f)) - n.x() * x - n.y() * y;  // n.z z <= rest
            if (n.z() > 1e-12) high = std::min(high, rest / n.z());
            else if (n.z() < -1e-12) low = std::max(low, rest / n.z());
            else if (rest < 0.0) high = low;
        }
        if (high <= low) continue;
        const double m0 = high - low, m1 = (high * high - low * low) / 2, m2 = (std::pow(high, 3) - std::pow(low, 3)) / 3;
        volume += h * h * m0;
        first += h * h * Vec3(x * m0, y * m0, m1);
        Eigen::Matrix3d part;
        part << x * x * m0, x * y * m0, x * m1, x * y * m0, y * y * m0, y * m1, x * m1, y * m1, m2;
        second += h * h * part;
    }
    inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
}

}  // namespace

TEST(Polyhedron, distance_is_that_to_the_nearest_triangle)
{
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> u(-1.0, 1.0);
    for (const Polyhedron& body : {cube(2e-3), tetrahedron(2e-3), octahedron(2e-3), stone(12, 3), stone(26, 4), stone(60, 5)}) {
        const double r = body.bounding_radius();
        double worst = 0.0, slope = 0.0;
        for (int k = 0; k < 4000; ++k) {
            const Vec3 p = (k % 2 ? 1.1 : 2.5) * r * Vec3(u(random), u(random), u(random));
            Vec3 gradient, turned;
            const double d = body.distance_and_gradient(p, gradient);
            worst = std::max(worst, std::abs(d - brute_force_distance(body, p)) / r);
            // Along the gradient the distance grows by the way, away from ridges.
            const double step = 1e-6 * r;
            if (body.distance_and_gradient(p + step * gradient, turned); turned.dot(gradient) > 0.999)
                slope = std::max(slope, std::abs((body.distance(p + step * gradient) - d) / step - 1.0));
            Vec3 normal;
            const double bound = body.depth_and_normal(p, normal);
            EXPECT_LE(bound, d + 1e-15);
            if (d < 0) {
                EXPECT_EQ(bound, d);
            }
        }
        EXPECT_LT(worst, 1e-13) << body.faces().size() << " faces";
        EXPECT_LT(slope, 1e-6);
    }
}

TEST(Polyhedron, on_its_corners_and_edges_distance_is_zero_and_gradients_are_finite)
{
    const Polyhedron body = cube(2.0);
    for (const Vec3& v : body.vertices()) {
        Vec3 gradient;
        EXPECT_NEAR(body.distance_and_gradient(v, gradient), 0.0, 1e-15);
        EXPECT_NEAR(gradient.norm(), 1.0, 1e-12);
        EXPECT_NEAR(body.distance_and_gradient(2.0 * v, gradient), std::sqrt(3.0), 1e-14);
        EXPECT_LT((gradient - v.normalized()).norm(), 1e-14);
    }
    Vec3 gradient;
    EXPECT_NEAR(body.distance_and_gradient({3.0, 3.0, 0.2}, gradient), std::sqrt(8.0), 1e-14);
    EXPECT_DOUBLE_EQ(body.distance(Vec3::Zero()), -1.0);
}

TEST(Polyhedron, mass_properties_are_those_of_cube_tetrahedron_and_octahedron)
{
    const double a = 2e-3;
    // Cube a^3, I = a^5/6. Regular tetrahedron of edge a: V = a^3/(6 sqrt 2), I = V a^2/20. Octahedron: V = sqrt(2)/3 a^3, I = V a^2/10.
    const double tetra = std::pow(a, 3) / (6 * std::sqrt(2.0)), octa = std::sqrt(2.0) / 3 * std::pow(a, 3);
    const std::tuple<Polyhedron, double, double, std::size_t> cases[] = {{cube(a), std::pow(a, 3), std::pow(a, 5) / 6, 6},
                                                                        {tetrahedron(a), tetra, tetra * a * a / 20, 4},
                                                                        {octahedron(a), octa, octa * a * a / 10, 8}};
    for (const auto& [body, volume, moment, faces] : cases) {
        EXPECT_EQ(body.faces().size(), faces);
        EXPECT_EQ(body.edges().size(), faces + body.vertices().size() - 2) << "Euler";
        EXPECT_NEAR(body.volume() / volume, 1.0, 1e-13);
        EXPECT_LT((body.inertia() / moment - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    }
    for (const int faces : {12, 40}) {
        const Polyhedron body = stone(faces, 7);
        double volume;
        Vec3 first;
        Eigen::Matrix3d inertia;
        column_properties(body, 500, volume, first, inertia);
        EXPECT_NEAR(body.volume() / volume, 1.0, 2e-5);
        EXPECT_LT(first.norm() / (volume * body.bounding_radius()), 2e-5) << "the centre of mass is the origin";
        EXPECT_LT((body.inertia() - inertia).norm() / inertia.norm(), 5e-5);
    }
}

TEST(Polyhedron, does_not_depend_on_order_place_or_points_inside)
{
    std::vector<Vec3> points;
    for (int k = 0; k < 8; ++k) points.emplace_back(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    const Polyhedron first(points);
    points.insert(points.end(), {Vec3::Zero(), {1, 0, 0}, {0.3, 0.2, -1}, {1, 1, 0.1}, points[3]});  // inside, in faces, in an edge, twice
    std::mt19937_64 random(5);
    for (int k = 0; k < 5; ++k) {
        std::shuffle(points.begin(), points.end(), random);
        std::vector<Vec3> moved = points;
        for (Vec3& p : moved) p += Vec3(4, -2, 8);
        const Polyhedron again(points), away(moved);
        ASSERT_EQ(again.faces().size(), 6u);
        EXPECT_EQ(away.faces().size(), 6u);
        EXPECT_LT((away.moved() - Vec3(4, -2, 8)).norm(), 1e-14);
        EXPECT_NEAR(away.volume(), 8.0, 1e-13);
        EXPECT_EQ(again.distance({0.3, -2.0, 1.7}), first.distance({0.3, -2.0, 1.7}));
    }
}

TEST(Polyhedron, faces_of_a_turned_box_in_single_precision_stay_six)
{
    // A fine mesh of a box as an STL file holds it: many points in each face and edge, rounded off their planes.
    const Quat turn = Quat(0.8, 0.3, -0.2, 0.5).normalized();
    std::vector<Vec3> points;
    for (int i = 0; i <= 6; ++i)
        for (int j = 0; j <= 6; ++j)
            for (int k = 0; k <= 6; ++k) points.push_back((turn * Vec3(3.0 * i, 2.0 * j, 1.0 * k)).cast<float>().cast<double>());
    const Polyhedron body(points);
    EXPECT_EQ(body.faces().size(), 6u);
    EXPECT_NEAR(body.volume() / (18.0 * 12.0 * 6.0), 1.0, 1e-5);
    EXPECT_NEAR(body.distance(Vec3::Zero()), -3.0, 1e-4);
}

TEST(Polyhedron, refuses_points_without_a_volume)
{
    const auto error_of = [](std::vector<Vec3> points) {
        try {
            Polyhedron body(points, "chip.stl");
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string();
    };
    EXPECT_NE(error_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}).find("chip.stl: has 3 vertices"), std::string::npos);
    EXPECT_NE(error_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 0.3, 0}}).find("lie in one plane"), std::string::npos);
    EXPECT_NE(error_of({{0, 0, 0.1}, {1, 0, 0.2}, {0, 1, 0.3}, {1, 1, 0.4}, {0.5, 0.5, 0.25}}).find("lie in one plane"), std::string::npos) << "to rounding";
    EXPECT_NE(error_of(std::vector<Vec3>(8, Vec3(1, 2, 3))).find("no size"), std::string::npos);
    EXPECT_NE(error_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, NAN}}).find("no number"), std::string::npos);
}

TEST(PolyhedronNodes, areas_sum_to_the_surface_and_corners_have_nodes)
{
    for (const Polyhedron& body : {cube(1.0), tetrahedron(1.0), stone(12, 3), stone(60, 5)})
        for (const int count : {100, 800, 6000}) {
            const SurfaceNodes nodes = polyhedron_nodes(body, count);
            double sum = 0.0;
            for (const double a : nodes.areas) sum += a;
            EXPECT_NEAR(sum / body.surface(), 1.0, 1e-12);
            if (count > 500) {
                EXPECT_NEAR(double(nodes.positions.size()) / count, 1.0, 0.15) << body.faces().size();
            }
            for (const Vec3& p : nodes.positions) EXPECT_NEAR(body.distance(p), 0.0, 1e-13);
            for (const Vec3& v : body.vertices())
                EXPECT_TRUE(std::ranges::any_of(nodes.positions, [&](const Vec3& p) { return (p - v).norm() < 1e-12; }));
        }
}
