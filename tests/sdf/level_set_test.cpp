// Acceptance figures: analytic bodies, sampled at and below the voxel resolution, and a hollow sphere.
#include "sdf/level_set.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "sdf/mass_properties.h"
#include "shapes.h"

namespace coral::sdf::test {
namespace {

constexpr double c = 5e-5;  // CT voxel [m]

LevelSetOptions at_spacing(double spacing) { return {.spacing = spacing}; }

Eigen::Vector3i cube(int n) { return Eigen::Vector3i::Constant(n); }

TEST(LevelSet, of_a_sphere_is_accurate_to_a_tenth_of_a_voxel)
{
    for (const double radius : {9.0, 20.0}) {
        const int n = int(2 * radius) + 4;
        const Distance truth = sphere(Eigen::Vector3d(0.5 * n + 0.31, 0.5 * n - 0.17, 0.5 * n + 0.08) * c, radius * c);
        const Mask mask = voxelise(truth, cube(n), Eigen::Vector3d::Constant(c));
        LevelSetReport report;
        const DistanceGrid grid = level_set_from_mask(mask.view, at_spacing(c), &report);
        const DistanceError e = distance_error(grid, truth, 3 * c, c);
        EXPECT_LE(e.rms, 0.115) << radius;
        EXPECT_LE(e.largest, 0.5) << radius;
        EXPECT_LE(e.gradient_rms, 0.03) << radius;
        EXPECT_EQ(e.wrong_signs, 0);
        EXPECT_NEAR(report.volume / report.voxel_volume, 1.0, 1e-5);
        EXPECT_EQ(report.solid_components, 1);
    }
}

TEST(LevelSet, of_a_turned_torus_is_accurate_and_keeps_its_volume)
{
    const Distance truth = torus(Eigen::Vector3d(30.2, 29.7, 30.4) * c, some_rotation(0.7), 18 * c, 9 * c);
    const Mask mask = voxelise(truth, cube(60), Eigen::Vector3d::Constant(c));
    const DistanceGrid grid = level_set_from_mask(mask.view, at_spacing(c));
    const DistanceError e = distance_error(grid, truth, 3 * c, c);
    EXPECT_LE(e.rms, 0.115);
    EXPECT_LE(e.largest, 0.5);
    EXPECT_LE(e.gradient_rms, 0.03);
    EXPECT_NEAR(solid_volume(grid) / (2 * std::pow(std::numbers::pi, 2) * 18 * 81 * c * c * c), 1.0, 1e-3);
}

TEST(LevelSet, keeps_a_wall_of_two_voxels_and_its_hole)
{
    const Eigen::Vector3d centre = Eigen::Vector3d(25.3, 24.8, 25.1) * c;
    // A shell two voxels thick with a hole of radius 3 voxels through it along +x.
    const Distance truth = [=](const Eigen::Vector3d& x) {
        const Eigen::Vector3d p = x - centre;
        const double hole = 3 * c - std::hypot(p.y(), p.z());
        return std::max(shell(centre, 20 * c, 18 * c)(x), p.x() > 0 ? hole : -1.0);
    };
    const Mask mask = voxelise(truth, cube(51), Eigen::Vector3d::Constant(c));
    LevelSetReport report;
    const DistanceGrid grid = level_set_from_mask(mask.view, at_spacing(c), &report);
    EXPECT_NEAR(report.volume / report.voxel_volume, 1.0, 5e-3);
    EXPECT_EQ(report.solid_components, 1);
    EXPECT_GT(grid.sample(centre), 5 * c) << "cavity";
    EXPECT_GT(grid.sample(centre + Eigen::Vector3d(19 * c, 0, 0)), 2 * c) << "hole";
    EXPECT_LT(grid.sample(centre - Eigen::Vector3d(19 * c, 0, 0)), -0.7 * c) << "wall";
}

TEST(LevelSet, of_a_sphere_on_a_grid_four_voxels_wide_meets_distance_and_normals)
{
    const double h = 4 * c, radius = 9 * h;
    const Distance truth = sphere(Eigen::Vector3d(38.3, 38.6, 37.9) * c, radius);
    const Mask mask = voxelise(truth, cube(77), Eigen::Vector3d::Constant(c));
    const DistanceGrid grid = level_set_from_mask(mask.view, at_spacing(h));
    EXPECT_LE(distance_error(grid, truth, 3 * h, h).rms, 0.03);

    // Normals from central differences at the nodes: the trilinear gradient itself turns by up to h/2R within a cell.
    double squared_angle = 0;
    int count = 0;
    for (int k = 1; k + 1 < grid.size.z(); ++k)
        for (int j = 1; j + 1 < grid.size.y(); ++j)
            for (int i = 1; i + 1 < grid.size.x(); ++i) {
                const Eigen::Vector3d u = grid.node(i, j, k) - Eigen::Vector3d(38.3, 38.6, 37.9) * c;
                if (std::abs(u.norm() - radius) > h) continue;
                const Eigen::Vector3d g(grid.distance[grid.index(i + 1, j, k)] - grid.distance[grid.index(i - 1, j, k)],
                                        grid.distance[grid.index(i, j + 1, k)] - grid.distance[grid.index(i, j - 1, k)],
                                        grid.distance[grid.index(i, j, k + 1)] - grid.distance[grid.index(i, j, k - 1)]);
                squared_angle += std::pow(std::acos(std::min(1.0, g.normalized().dot(u.normalized()))), 2);
                ++count;
            }
    EXPECT_LE(std::sqrt(squared_angle / count) * 180 / std::numbers::pi, 1.6);
}

TEST(LevelSet, of_a_hollow_sphere_keeps_the_closed_cavity)
{
    const Eigen::Vector3d centre = Eigen::Vector3d(32.1, 31.8, 32.3) * c;
    const Distance truth = shell(centre, 30 * c, 15 * c);
    const Mask mask = voxelise(truth, cube(64), Eigen::Vector3d::Constant(c));
    for (const double h : {c, 2 * c, 4 * c}) {
        const DistanceGrid grid = level_set_from_mask(mask.view, at_spacing(h));
        EXPECT_NEAR(solid_volume(grid) / (sphere_volume(30 * c) - sphere_volume(15 * c)), 1.0, 1e-3) << h;
        for (const Eigen::Vector3d& u : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 1).normalized().eval()})
            EXPECT_GT(grid.sample(centre + 10 * c * u), 3 * c) << h;
        EXPECT_EQ(distance_error(grid, truth, 3 * h, c).wrong_signs, 0);
    }
}

TEST(LevelSet, has_true_distances_out_to_its_band)
{
    const double h = 4 * c;
    const Distance truth = sphere(Eigen::Vector3d::Constant(40.2 * c), 38 * c);
    const Mask mask = voxelise(truth, cube(81), Eigen::Vector3d::Constant(c));
    const DistanceGrid grid = level_set_from_mask(mask.view, at_spacing(h));
    EXPECT_NEAR(grid.outside_limit, 9 * h, 1e-6 * h);
    EXPECT_NEAR(grid.inside_limit, 6 * h, 1e-6 * h);
    double largest = 0;
    for (int k = 0; k < grid.size.z(); ++k)
        for (int j = 0; j < grid.size.y(); ++j)
            for (int i = 0; i < grid.size.x(); ++i) {
                const double d = grid.distance[grid.index(i, j, k)], t = truth(grid.node(i, j, k));
                largest = std::max(largest, std::abs(d - std::clamp(t, -grid.inside_limit, grid.outside_limit)));
            }
    EXPECT_LE(largest, 0.5 * c);
    // The box reaches one band beyond the surface on every side.
    EXPECT_TRUE(grid.inside_box(Eigen::Vector3d::Constant(40.2 * c) + Eigen::Vector3d(38 * c + 9 * h, 0, 0)));
    EXPECT_TRUE(grid.inside_box(Eigen::Vector3d::Constant(40.2 * c) - Eigen::Vector3d(0, 0, 38 * c + 9 * h)));
}

TEST(LevelSet, of_voxels_twice_as_tall_stays_within_a_fifth_of_a_voxel)
{
    const Eigen::Vector3d voxel(c, c, 2 * c);
    const Distance truth = sphere(Eigen::Vector3d(24.3, 24.6, 24.2) * c, 20 * c);
    const Mask mask = voxelise(truth, {49, 49, 25}, voxel);
    LevelSetReport report;
    const DistanceGrid grid = level_set_from_mask(mask.view, at_spacing(c), &report);
    const DistanceError e = distance_error(grid, truth, 3 * c, c);
    EXPECT_LE(e.rms, 0.2);
    EXPECT_LE(e.largest, 0.95);
    EXPECT_NEAR(report.voxel_volume / sphere_volume(20 * c), 1.0, 0.01);
}

TEST(LevelSet, does_not_depend_on_threads_or_on_empty_voxels_around)
{
    const Distance truth = torus(Eigen::Vector3d(20.2, 19.7, 20.4) * c, some_rotation(0.3), 11 * c, 6 * c);
    const Mask mask = voxelise(truth, cube(41), Eigen::Vector3d::Constant(c));
    const DistanceGrid grid = level_set_from_mask(mask.view, at_spacing(2 * c));
    set_thread_count(1);
    const DistanceGrid one = level_set_from_mask(mask.view, at_spacing(2 * c));
    set_thread_count(0);
    EXPECT_EQ(grid.distance, one.distance);

    Mask wide = voxelise([&](const Eigen::Vector3d& x) { return truth(x - Eigen::Vector3d(7, 3, 5) * c); }, {55, 50, 52}, Eigen::Vector3d::Constant(c));
    wide.view.first_centre = -Eigen::Vector3d(7, 3, 5) * c;
    const DistanceGrid padded = level_set_from_mask(wide.view, at_spacing(2 * c));
    ASSERT_EQ(padded.size, grid.size);
    for (std::size_t n = 0; n < grid.distance.size(); ++n) ASSERT_NEAR(padded.distance[n], grid.distance[n], 1e-4 * c);
}

/// Share of placements in which a slab 12 h thick keeps a channel open: a hole, or a slit, of the given width along a slanted axis.
double share_open(double width, bool slit, double h)
{
    constexpr int placements = 8;
    int open = 0;
    for (int n = 0; n < placements; ++n) {
        const Eigen::Matrix3d frame = Eigen::AngleAxisd(0.1 + 0.06 * n, Eigen::Vector3d(1, 0.3 * n, 0).normalized()).toRotationMatrix();
        const Eigen::Vector3d middle = Eigen::Vector3d(7, 7, 7) * h + Eigen::Vector3d(0.37, 0.71, 0.53) * (0.9 * n) * c;
        const auto across = [&](const Eigen::Vector3d& p) { return slit ? std::abs(p.x()) : std::hypot(p.x(), p.y()); };
        const Distance truth = [&](const Eigen::Vector3d& x) {
            const double hole = 0.5 * width - across(frame.transpose() * (x - middle));
            return std::max({(x - middle).cwiseAbs().maxCoeff() - 6 * h, hole});
        };
        const Mask mask = voxelise(truth, cube(int(15 * h / c)), Eigen::Vector3d::Constant(c));
        const DistanceGrid grid = level_set_from_mask(mask.view, {.spacing = h, .keep_volume = true});
        bool through = true;  // in every cut across the axis some point of the channel must be open
        for (double z = -4 * h; through && z <= 4 * h; z += 0.25 * h) {
            double widest = -1;
            for (int a = -4; a <= 4; ++a)
                for (int b = -4; b <= 4; ++b)
                    widest = std::max(widest, grid.sample(middle + frame * Eigen::Vector3d(0.125 * a * width, (slit ? 0.5 * h : 0.125 * width) * b, z)));
            through = widest > 0;
        }
        open += through;
    }
    return double(open) / placements;
}

TEST(LevelSet, keeps_round_throats_of_one_and_a_half_spacings_and_slits_of_one)
{
    const double h = 4 * c;
    EXPECT_EQ(share_open(1.5 * h, false, h), 1.0);
    EXPECT_EQ(share_open(2.0 * h, false, h), 1.0);
    EXPECT_EQ(share_open(1.0 * h, true, h), 1.0);
    // What the documents say is lost must not come and go: a hole of half a spacing closes.
    EXPECT_LE(share_open(0.5 * h, false, h), 0.1);
}

TEST(LevelSet, refuses_what_has_no_answer)
{
    const Mask empty = voxelise([](const Eigen::Vector3d&) { return 1.0; }, cube(8), Eigen::Vector3d::Constant(c));
    EXPECT_THROW(level_set_from_mask(empty.view, at_spacing(c)), Error);
    const Mask ball = voxelise(sphere(Eigen::Vector3d::Constant(8 * c), 6 * c), cube(16), Eigen::Vector3d::Constant(c));
    EXPECT_THROW(level_set_from_mask(ball.view, at_spacing(0.4 * c)), Error);
    EXPECT_THROW(level_set_from_mask(ball.view, {.spacing = c, .smoothing = 1.5}), Error);
}

TEST(GrainFromMasks, puts_the_solids_centre_of_mass_at_the_origin_for_both_grids)
{
    const double h = 2 * c, outer = 20 * c, cavity = 8 * c;
    const Eigen::Vector3d centre = Eigen::Vector3d(24.2, 24.4, 23.9) * c, cavity_centre = centre + Eigen::Vector3d(6 * c, 0, 0);
    const Distance filled = sphere(centre, outer);
    const Distance solid = [=](const Eigen::Vector3d& x) { return std::max(filled(x), cavity - (x - cavity_centre).norm()); };
    const Mask with_void = voxelise(solid, cube(49), Eigen::Vector3d::Constant(c));
    const Mask apparent = voxelise(filled, cube(49), Eigen::Vector3d::Constant(c));
    const GrainLevelSet grain = grain_from_masks(with_void.view, apparent.view, at_spacing(h));

    const double v = sphere_volume(outer), hole = sphere_volume(cavity);
    EXPECT_NEAR(grain.apparent_volume / v, 1.0, 3e-3);
    EXPECT_NEAR(grain.volume / (v - hole), 1.0, 3e-3);
    EXPECT_NEAR(grain.equivalent_diameter / (2 * outer), 1.0, 1e-3);
    EXPECT_NEAR(grain.intraparticle_porosity, hole / v, 2e-3);
    const double shift = -hole * 6 * c / (v - hole);  // of the solid's centroid against the sphere's centre, along x
    EXPECT_NEAR((grain.centre - centre - Eigen::Vector3d(shift, 0, 0)).norm(), 0.0, 0.03 * c);
    EXPECT_NEAR(mass_properties(grain.solid).centroid.norm(), 0.0, 1e-6 * c);
    // The twin lies in the same frame: its sphere's centre is -shift from the origin.
    EXPECT_NEAR((mass_properties(grain.apparent).centroid - Eigen::Vector3d(-shift, 0, 0)).norm(), 0.0, 0.05 * c);
    const Eigen::Vector3d lattice = (grain.apparent.origin - grain.solid.origin) / h;
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(lattice[axis], std::round(lattice[axis]), 1e-6);
    // I_xx of a sphere with a spherical hole on the x axis, about any point of that axis.
    EXPECT_NEAR(grain.inertia(0, 0) / (0.4 * v * outer * outer - 0.4 * hole * cavity * cavity), 1.0, 5e-3);
}

}  // namespace
}  // namespace coral::sdf::test
