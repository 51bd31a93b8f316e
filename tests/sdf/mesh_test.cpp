#include "sdf/mesh.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <random>

#include "shapes.h"

namespace coral::sdf::test {
namespace {

/// Whether every directed edge is met by its opposite as often.
bool is_closed(const TriangleMesh& mesh)
{
    std::map<std::pair<int, int>, int> balance;
    for (const auto& t : mesh.triangles)
        for (int n = 0; n < 3; ++n) {
            const int a = t[n], b = t[(n + 1) % 3];
            balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
        }
    for (const auto& [edge, count] : balance)
        if (count != 0) return false;
    return !mesh.triangles.empty();
}

TEST(Mesh, of_a_sphere_is_closed_and_converges_with_the_square_of_the_spacing)
{
    double previous = 1;
    for (const double h : {0.2, 0.1, 0.05}) {
        const int half = int(std::ceil(1.2 / h));
        const TriangleMesh mesh = extract_mesh(tabulated(sphere({0.013, 0.021, -0.037}, 1.0), Eigen::Vector3d::Constant(-half * h), Eigen::Vector3i::Constant(2 * half + 1), h));
        EXPECT_TRUE(is_closed(mesh));
        EXPECT_EQ(int(mesh.vertices.size()) - int(mesh.triangles.size()) / 2, 2) << "Euler number of a sphere";
        const double area_error = std::abs(surface_area(mesh) / (4 * std::numbers::pi) - 1), volume_error = std::abs(enclosed_volume(mesh) / sphere_volume(1) - 1);
        EXPECT_LE(area_error, 0.35 * h * h);
        EXPECT_LE(volume_error, 0.65 * h * h);
        EXPECT_GT(enclosed_volume(mesh), 0.0) << "triangles turn outwards";
        EXPECT_LE(volume_error, 0.3 * previous);
        previous = volume_error;
    }
}

TEST(Mesh, of_a_hollow_sphere_takes_the_void_off)
{
    const TriangleMesh mesh = extract_mesh(tabulated(shell(Eigen::Vector3d::Constant(0.02), 1.0, 0.5), Eigen::Vector3d::Constant(-1.25), Eigen::Vector3i::Constant(51), 0.05));
    EXPECT_TRUE(is_closed(mesh));
    EXPECT_NEAR(enclosed_volume(mesh) / (sphere_volume(1) - sphere_volume(0.5)), 1.0, 2e-3);
    EXPECT_NEAR(surface_area(mesh) / (4 * std::numbers::pi * 1.25), 1.0, 2e-3);
}

TEST(Mesh, of_random_signs_is_closed_whatever_the_ambiguity)
{
    std::mt19937_64 random(11);
    std::uniform_real_distribution<float> uniform(-1, 1);
    DistanceGrid grid{{12, 12, 12}, Eigen::Vector3d::Zero(), 1.0, std::vector<float>(12 * 12 * 12, 1.0f)};
    for (int k = 1; k < 11; ++k)
        for (int j = 1; j < 11; ++j)
            for (int i = 1; i < 11; ++i) grid.distance[grid.index(i, j, k)] = uniform(random);
    const TriangleMesh mesh = extract_mesh(grid);
    EXPECT_TRUE(is_closed(mesh));
    for (const auto& v : mesh.vertices) ASSERT_NEAR(grid.sample(v), 0.0, 1e-6);
    EXPECT_GT(enclosed_volume(mesh), 0.0);
}

TEST(Mesh, files_hold_every_triangle)
{
    const TriangleMesh mesh = extract_mesh(tabulated(sphere(Eigen::Vector3d::Zero(), 1.0), Eigen::Vector3d::Constant(-1.5), Eigen::Vector3i::Constant(16), 0.2));
    const std::filesystem::path folder = std::filesystem::temp_directory_path() / ("coral_mesh_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    write_stl(mesh, folder / "ball.stl", 1e-3);
    write_ply(mesh, folder / "ball.ply", 1e-3);
    EXPECT_EQ(std::filesystem::file_size(folder / "ball.stl"), 84 + 50 * mesh.triangles.size());
    EXPECT_GT(std::filesystem::file_size(folder / "ball.ply"), 24 * mesh.vertices.size() + 13 * mesh.triangles.size());
    std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace coral::sdf::test
