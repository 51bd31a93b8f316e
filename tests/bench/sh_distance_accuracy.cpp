// Distance to a harmonic surface: Newton's method on the sphere against the tabulated grid that contact uses, error beside cost.
#include <chrono>
#include <numbers>
#include <random>

#include "bench/table.h"
#include "sh/surface_distance.h"
#include "sh/tabulate.h"

namespace {

using namespace coral;

/// Lumpy grain of degree 10 and 15 mm, as rough as coral sand: coefficients fall as 1/l^1.5.
sh::Surface grain(double roughness, unsigned seed)
{
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    sh::Surface surface;
    surface.degree = 10;
    surface.coefficients.assign(std::size_t(sh::coefficient_count(10)), 0.0);
    surface.coefficients[0] = std::sqrt(4 * std::numbers::pi);
    for (int l = 2; l <= 10; ++l)
        for (int m = -l; m <= l; ++m) surface.coefficients[std::size_t(sh::coefficient_index(l, m))] = roughness * normal(random) / std::pow(l, 1.5);
    return sh::centred(sh::scaled_to_volume(surface, std::numbers::pi / 6 * std::pow(15e-3, 3)));
}

/// Points from one fines' diameter inside to as far outside the surface: where contact asks.
std::vector<Eigen::Vector3d> queries(const sh::SurfaceDistance& field, double reach, int count)
{
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-reach, reach);
    std::vector<Eigen::Vector3d> points;
    while (int(points.size()) < count) {
        const Eigen::Vector3d u = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
        Eigen::Vector3d outward;
        const Eigen::Vector3d p = field.evaluator().point(u, outward);
        points.push_back(p + uniform(random) * outward);
    }
    return points;
}

template <class Work>
double nanoseconds(std::size_t count, const Work& work)
{
    const auto start = std::chrono::steady_clock::now();
    work();
    return 1e9 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / double(count);
}

void compare(double roughness, unsigned seed)
{
    const sh::Surface surface = grain(roughness, seed);
    const double diameter = 15e-3;
    double build = 0;
    std::unique_ptr<sh::SurfaceDistance> field;
    build = nanoseconds(1, [&] { field = std::make_unique<sh::SurfaceDistance>(surface); });
    // Truth: eight times the start points.
    const sh::SurfaceDistance dense(surface, 8 * 12 * 121);
    const auto points = queries(dense, 1.5e-3, 20000);
    std::vector<sh::SurfaceDistance::Foot> truth, feet(points.size());
    for (const auto& x : points) truth.push_back(dense.foot(x));
    const double newton = nanoseconds(points.size(), [&] { for (std::size_t n = 0; n < points.size(); ++n) feet[n] = field->foot(points[n]); });
    double worst = 0, wrong = 0, squared = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
        const double error = std::abs(feet[n].distance - truth[n].distance);
        worst = std::max(worst, error);
        squared += error * error / double(points.size());
        wrong += error > 1e-9 * diameter;
    }
    const double followed = nanoseconds(points.size(), [&] { for (std::size_t n = 0; n < points.size(); ++n) feet[n] = field->foot_near(points[n] + Eigen::Vector3d(2e-5, 0, 0), truth[n].direction); });
    bench::line({roughness, 0, 1e6 * std::sqrt(squared), 1e6 * worst, wrong / double(points.size()), 0, 0, newton, 1e-6 * build, 12 * 121 * 84e-6});
    bench::line({roughness, -1, 0, 0, 0, 0, 0, followed, 1e-6 * build, 12 * 121 * 84e-6});
    for (const double parts : {75.0, 150.0}) {
        const double spacing = diameter / parts;
        sdf::DistanceGrid grid;
        const double made = nanoseconds(1, [&] { grid = sh::tabulate(surface, spacing, 2e-3); });
        double square = 0, largest = 0, angle = 0, largest_angle = 0;
        std::vector<double> values(points.size());
        std::vector<Eigen::Vector3d> gradients(points.size());
        const double cost = nanoseconds(points.size(), [&] { for (std::size_t n = 0; n < points.size(); ++n) values[n] = grid.sample_with_gradient(points[n], gradients[n]); });
        for (std::size_t n = 0; n < points.size(); ++n) {
            const double error = values[n] - truth[n].distance;
            square += error * error / double(points.size());
            largest = std::max(largest, std::abs(error));
            const double turned = std::acos(std::clamp(gradients[n].normalized().dot(truth[n].normal), -1.0, 1.0)) * 180 / std::numbers::pi;
            angle += turned * turned / double(points.size());
            largest_angle = std::max(largest_angle, turned);
        }
        bench::line({roughness, parts, 1e6 * std::sqrt(square), 1e6 * largest, 0, std::sqrt(angle), largest_angle, cost, 1e-6 * made, 4e-6 * double(grid.node_count())});
    }
}

}  // namespace

int main()
{
    bench::heading("Distance to a harmonic surface of degree 10 and 15 mm, within 1.5 mm of it: start points (0), guess of the last query (-1) and grids of D/75, D/150",
                   {"roughness", "D/spacing", "rms [um]", "max [um]", "not nearest", "normal rms [deg]", "normal max [deg]", "query [ns]", "build [ms]", "memory [MB]"});
    compare(0.06, 1);
    compare(0.12, 2);
    compare(0.2, 3);
}
