// Error of level sets made from binary voxels against bodies known exactly, as a Markdown table and a .csv file.
#include <Eigen/Eigenvalues>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <random>

#include "bench/exact_bodies.h"
#include "morph/apparent_shape.h"
#include "sdf/mass_properties.h"

namespace {

using namespace coral;
using bench::ExactBody;
using bench::VoxelBody;
using Eigen::Vector3d;

constexpr double c = 5e-5;     ///< finest voxel edge [m]
constexpr double reach = 3.0;  ///< nodes nearer than this to the surface count [voxels]

/// Sums over the placements of one body. Lengths in the finest voxel edge.
struct Errors {
    double square = 0, largest = 0, gradient_square = 0, volume = 0, shift = 0, from_voxels = 0, voxels = 0, inertia = 0, throat = 0, tool_throat = 0;
    double nodes = 0, gradient_nodes = 0;
    int placements = 0;

    double rms() const { return std::sqrt(square / nodes); }
    double gradient_rms() const { return std::sqrt(gradient_square / gradient_nodes); }
};

void take_largest(double& sum, double value) { sum = std::max(sum, std::abs(value)); }

void add_distances(const sdf::DistanceGrid& grid, const VoxelBody& body, Errors& e)
{
    const double h = grid.spacing;
    const auto slope = [&](const auto& value, int i, int j, int k) {
        return Vector3d(value(i + 1, j, k) - value(i - 1, j, k), value(i, j + 1, k) - value(i, j - 1, k), value(i, j, k + 1) - value(i, j, k - 1)).norm() / (2 * h);
    };
    const auto found = [&](int i, int j, int k) { return double(grid.distance[grid.index(i, j, k)]); };
    const auto truth = [&](int i, int j, int k) { return body.distance(grid.node(i, j, k)); };
    for (int k = 1; k + 1 < grid.size.z(); ++k)
        for (int j = 1; j + 1 < grid.size.y(); ++j)
            for (int i = 1; i + 1 < grid.size.x(); ++i) {
                // The grid's own value spares most exact distances; a node may be wrong by less than a voxel.
                if (std::abs(found(i, j, k)) > (reach + 1) * c) continue;
                const double d = truth(i, j, k);
                if (std::abs(d) > reach * c) continue;
                const double error = (found(i, j, k) - d) / c;
                e.square += error * error;
                take_largest(e.largest, error);
                ++e.nodes;
                // Across a medial axis or an edge the true distance has no gradient of 1 over this stencil either.
                if (std::abs(slope(truth, i, j, k) - 1) > 0.02) continue;
                e.gradient_square += std::pow(slope(found, i, j, k) - 1, 2);
                ++e.gradient_nodes;
            }
}

/// Diameter of the narrowest cut across the hole: twice the mean distance from the axis to the surface [m].
double throat_of(const sdf::DistanceGrid& grid, const VoxelBody& body)
{
    const auto& [low, high] = body.body.throat_range;
    double narrowest = 1e9;
    for (int slice = 1; slice < 8; ++slice) {
        const double z = low + (high - low) * slice / 8;
        double sum = 0;
        constexpr int rays = 48;
        for (int ray = 0; ray < rays; ++ray) {
            const double phi = 2 * std::numbers::pi * ray / rays;
            const auto at = [&](double rho) { return grid.sample(body.centre + body.frame * Vector3d(rho * std::cos(phi), rho * std::sin(phi), z)); };
            double inside = 0, outside = body.body.throat;  // twice the radius of the hole
            for (double rho = 0; rho < body.body.throat; rho += 0.1 * c)
                if (at(rho) < 0) {
                    outside = rho;
                    break;
                } else {
                    inside = rho;
                }
            for (int n = 0; n < 20; ++n) (at(0.5 * (inside + outside)) < 0 ? outside : inside) = 0.5 * (inside + outside);
            sum += inside;
        }
        narrowest = std::min(narrowest, 2 * sum / rays);
    }
    return narrowest;
}

void add_throat(const sdf::DistanceGrid& grid, const VoxelBody& body, Errors& e)
{
    if (body.body.throat <= 0) return;
    take_largest(e.throat, (throat_of(grid, body) - body.body.throat) / c);
    morph::Mask mask = morph::make_mask(body.size, body.voxel_size);
    mask.voxels = body.voxels;
    take_largest(e.tool_throat, (morph::close_with_ball(mask, 0.75 * body.body.throat).largest_throat - body.body.throat) / c);
}

void add_placement(const ExactBody& exact, const Vector3d& edges, std::mt19937_64& random, Errors& e)
{
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    Eigen::Quaterniond turn(normal(random), normal(random), normal(random), normal(random));
    const Vector3d shift(uniform(random), uniform(random), uniform(random));
    const VoxelBody body(exact, turn.normalized().toRotationMatrix(), shift, edges);
    sdf::LevelSetReport report;
    const sdf::DistanceGrid grid = sdf::level_set_from_mask(body.mask(), {.spacing = c}, &report);
    add_distances(grid, body, e);
    const sdf::MassProperties mass = sdf::mass_properties(grid);
    take_largest(e.volume, mass.volume / exact.volume - 1);
    take_largest(e.from_voxels, mass.volume / report.voxel_volume - 1);
    take_largest(e.voxels, report.voxel_volume / exact.volume - 1);
    take_largest(e.shift, report.shift / c);
    const Vector3d inertia = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(mass.inertia).eigenvalues();
    take_largest(e.inertia, (inertia.array() / exact.inertia.array() - 1).abs().maxCoeff());
    add_throat(grid, body, e);
    ++e.placements;
}

std::vector<ExactBody> bodies(double radius)
{
    return {bench::exact_ellipsoid(radius, radius, radius), bench::exact_ellipsoid(radius, 0.8 * radius, 0.6 * radius),
            bench::exact_torus(2 * radius / 3, radius / 3), bench::exact_shell(radius, 0.7 * radius, 0.25 * radius)};
}

/// One line of both tables.
struct Line {
    std::string body;
    double radius, aspect;
    Errors e;
    bool meets() const
    {
        const double allowed = aspect > 1 ? 2 : 1;
        return e.rms() <= 0.115 * allowed && e.from_voxels <= 5e-4 * allowed && e.inertia <= 3e-3 * allowed && e.throat <= 0.5 * allowed;
    }
};

void print(const Line& line, std::ofstream& csv)
{
    const Errors& e = line.e;
    std::printf("| %s | %g | 1:1:%g | %.3f | %.2f | %.3f | %.3f | %.4f | %.3f | %.3f | %.2f | ", line.body.c_str(), line.radius, line.aspect, e.rms(), e.largest,
                e.gradient_rms(), e.shift, 100 * e.from_voxels, 100 * e.voxels, 100 * e.volume, 100 * e.inertia);
    if (e.throat > 0) std::printf("%.2f | %.2f |", e.throat, e.tool_throat);
    else std::printf("- | - |");
    std::printf(" %s |\n", line.meets() ? "yes" : "**no**");
    std::fflush(stdout);
    if (csv)
        csv << line.body << ',' << line.radius << ',' << line.aspect << ',' << e.placements << ',' << e.rms() << ',' << e.largest << ',' << e.gradient_rms() << ','
            << e.shift << ',' << e.from_voxels << ',' << e.voxels << ',' << e.volume << ',' << e.inertia << ',' << e.throat << ',' << e.tool_throat << '\n';
}

}  // namespace

/// geometry_table [PLACEMENTS [FILE.csv]]
int main(int argc, char** argv)
{
    const int placements = argc > 1 ? std::max(1, std::atoi(argv[1])) : 5;
    std::ofstream csv;
    if (argc > 2) csv.open(argv[2]);
    if (csv) csv << "body,radius,aspect,placements,rms,max,gradient_rms,shift,volume_from_voxels,voxels_from_truth,volume,inertia,throat,largest_throat\n";
    std::printf("Level set at the voxel spacing from binary voxels, %d random places and rotations each; the worst of them but for the two RMS.\n"
                "Lengths in the finest voxel edge; nodes nearer than 3 voxels to the surface.\n\n"
                "| body | radius | voxel | RMS | max | RMS of abs(grad d) - 1 | shift | volume from voxels %% | voxels from truth %% | volume %% | inertia %% "
                "| throat | `largest_throat` | meets |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
                placements);
    std::mt19937_64 random(1);
    for (const double aspect : {1.0, 2.0})
        for (std::size_t b = 0; b < bodies(1).size(); ++b)
            for (const double radius : {10.0, 20.0, 30.0, 50.0}) {
                const ExactBody body = bodies(radius * c)[b];
                Line line{body.name, radius, aspect, {}};
                for (int p = 0; p < placements; ++p) add_placement(body, c * Vector3d(1, 1, aspect), random, line.e);
                print(line, csv);
            }
}
