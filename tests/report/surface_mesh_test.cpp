#include "report/surface_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

namespace coral::report {
namespace {

using Eigen::Vector3d;

Lattice make_lattice(int nodes, double half, const std::function<double(const Vector3d&)>& distance)
{
    Lattice lattice;
    lattice.size = Eigen::Vector3i::Constant(nodes);
    lattice.spacing = 2 * half / (nodes - 1);
    lattice.origin = Vector3d::Constant(-half);
    for (int k = 0; k < nodes; ++k)
        for (int j = 0; j < nodes; ++j)
            for (int i = 0; i < nodes; ++i)
                lattice.distance.push_back(static_cast<float>(distance(lattice.origin + lattice.spacing * Vector3d(i, j, k))));
    return lattice;
}

/// Signed volume by the divergence theorem: positive when the triangles turn outwards.
double volume(const Mesh& mesh)
{
    double six = 0;
    for (const auto& t : mesh.triangles) six += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
    return six / 6;
}

/// Every edge is used once in each direction.
bool closed(const Mesh& mesh)
{
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
    for (const auto& t : mesh.triangles)
        for (int e = 0; e < 3; ++e) {
            const auto a = t[static_cast<std::size_t>(e)], b = t[static_cast<std::size_t>((e + 1) % 3)];
            ++balance[{a, b}];
            --balance[{b, a}];
        }
    return std::ranges::all_of(balance, [](const auto& entry) { return entry.second == 0; });
}

TEST(SurfaceMesh, of_a_ball_is_closed_and_has_its_volume)
{
    const Lattice ball = make_lattice(41, 1.2, [](const Vector3d& p) { return p.norm() - 1; });
    const Mesh mesh = surface_mesh(ball);
    EXPECT_TRUE(closed(mesh));
    EXPECT_NEAR(volume(mesh), 4.0 / 3 * std::numbers::pi, 0.02 * 4.0 / 3 * std::numbers::pi);
    for (const Vector3d& v : mesh.vertices) EXPECT_NEAR(v.norm(), 1, 0.25 * ball.spacing);
}

TEST(SurfaceMesh, keeps_a_sealed_void)
{
    const Lattice shell = make_lattice(61, 1.2, [](const Vector3d& p) { return std::max(p.norm() - 1, 0.5 - p.norm()); });
    const Mesh mesh = surface_mesh(shell);
    const double exact = 4.0 / 3 * std::numbers::pi * (1 - 0.125);
    EXPECT_TRUE(closed(mesh));
    EXPECT_NEAR(volume(mesh), exact, 0.02 * exact);
}

TEST(SurfaceMesh, closes_a_solid_that_the_lattice_cuts)
{
    const Mesh mesh = surface_mesh(make_lattice(9, 1.0, [](const Vector3d& p) { return p.z() - 0.1; }));
    EXPECT_TRUE(closed(mesh));
    EXPECT_GT(volume(mesh), 0);
}

TEST(Coarsened, keeps_place_and_size_with_fewer_nodes)
{
    const Vector3d centre(0.3, -0.2, 0.1);
    const Lattice fine = make_lattice(81, 1.6, [&](const Vector3d& p) { return (p - centre).norm() - 1; });
    const Lattice coarse = coarsened(fine, 0.1);
    EXPECT_LT(coarse.distance.size(), fine.distance.size() / 8);
    const Mesh mesh = surface_mesh(coarse);
    EXPECT_TRUE(closed(mesh));
    for (const Vector3d& v : mesh.vertices) EXPECT_NEAR((v - centre).norm(), 1, 0.03);
}

}  // namespace
}  // namespace coral::report
