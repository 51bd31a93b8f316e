// Angle of repose of coral grains: a column stands in a cylinder, the cylinder goes, and the heap's slope is measured.
//     repose_table GRAINS.vdb GRAINS.sh.h5 [grains] [seeds] [friction]
// Huang et al., Engineering Geology 315 (2023) 107023: 30.1 degrees with level sets and 29.6 with harmonics of 2500 grains at friction 0.7, 30.3 in
// the experiment. Here grains have one diameter, the wall goes at once, and the base has the friction of the grains.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "core/output_file.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "pack/pack.h"
#include "pack/sample_world.h"

namespace {

using namespace coral;
using Eigen::Vector2d, Eigen::Vector3d;

constexpr double diameter = 15e-3;
constexpr int sectors = 8;
constexpr double longest = 4;  // of the collapse [s]

/// Column about as high as wide, poured and come to rest.
pack::Sample column(const std::string& shape, const std::filesystem::path& file, int grains, double friction, std::uint64_t seed)
{
    const double space = grains * std::numbers::pi / 6 * std::pow(diameter, 3) / 0.5, width = std::cbrt(4 * space / std::numbers::pi);
    const std::string text = "[cylinder]\ndiameter = " + to_text(width) + "\nheight = " + to_text(1.3 * width) +
                             "\n[[population]]\nrole = \"coarse\"\nshape = \"" + shape + "\"\nfile = \"" + std::filesystem::absolute(file).string() +
                             "\"\ndiameter = " + to_text(diameter) + "\ncount = " + std::to_string(grains) + "\n[material.default]\nfriction = " + to_text(friction) +
                             "\n[dropping]\nstiffness_factor = 0.1\n";
    const auto spec = std::filesystem::temp_directory_path() / ("repose_" + shape + ".toml");
    write_text_file(spec, text);
    pack::PackReport report;
    pack::Sample sample = pack::pack(pack::read_spec(spec), seed, report);
    std::filesystem::remove(spec);
    return sample;
}

struct Heap {
    double angle = 0, height = 0, radius = 0;  ///< [degrees], [m]
    double time = 0, speed = 0;                ///< of the collapse [s]; mean at its end [m/s]
};

/// Line of least squares through the surface: in every ring a grain wide, the mean over the sectors of the highest grain, from the ring
/// beside the axis to where the surface comes down to one grain and a half. No number where that is fewer than two rings (some 150 grains).
void measure(const dem::World& world, Heap& heap)
{
    Vector2d centre = Vector2d::Zero();
    for (const Vector3d& x : world.positions()) centre += x.head<2>() / world.body_count();
    std::vector<std::array<double, sectors>> top;
    for (int i = 0; i < world.body_count(); ++i) {
        const Vector3d& x = world.position(i);
        const Vector2d arm = x.head<2>() - centre;
        const std::size_t ring = std::size_t(arm.norm() / diameter);
        const double turn = (std::atan2(arm.y(), arm.x()) + std::numbers::pi) / (2 * std::numbers::pi);
        if (ring >= top.size()) top.resize(ring + 1, {});
        double& highest = top[ring][std::min(std::size_t(turn * sectors), std::size_t(sectors - 1))];
        highest = std::max(highest, x.z() + 0.5 * diameter);
        heap.height = std::max(heap.height, x.z() + 0.5 * diameter);
    }
    double n = 0, r1 = 0, z1 = 0, rr = 0, rz = 0;
    for (std::size_t ring = 1; ring < top.size(); ++ring) {
        double height = 0;
        for (const double z : top[ring]) height += z / sectors;
        if (height < 1.5 * diameter) break;
        const double r = (double(ring) + 0.5) * diameter;
        n += 1, r1 += r, z1 += height, rr += r * r, rz += r * height;
        heap.radius = r;
    }
    const double slope = (n * rz - r1 * z1) / (n * rr - r1 * r1);
    heap.angle = std::atan(-slope) * 180 / std::numbers::pi;
}

Heap collapse(pack::Sample sample, double friction)
{
    for (pack::Wall& wall : sample.walls) wall.friction = friction;
    dem::World world(pack::world_options(sample));
    pack::restore_springs(world, sample, pack::add_sample(world, sample, {"z-"}));
    const double start = world.time(), slow = 0.002 * std::sqrt(9.81 * diameter);
    Heap heap;
    do {
        world.advance(0.05);
        heap.speed = 0;
        for (const Vector3d& v : world.velocities()) heap.speed += v.norm() / world.body_count();
        heap.time = world.time() - start;
    } while ((heap.time < 0.3 || heap.speed > slow) && heap.time < longest);
    measure(world, heap);
    return heap;
}

}  // namespace

int main(int count, char** values)
{
    if (count < 3) {
        std::fputs("repose_table GRAINS.vdb GRAINS.sh.h5 [grains] [seeds] [friction]\n", stderr);
        return 1;
    }
    const int grains = count > 3 ? std::atoi(values[3]) : 300, seeds = count > 4 ? std::atoi(values[4]) : 3;
    const double friction = count > 5 ? std::atof(values[5]) : 0.7;
    set_thread_count(1);
    Progress::set_quiet(true);
    std::puts("| shape | seed | angle | height | radius | time | mean speed | wall time |\n|---|---|---|---|---|---|---|---|");
    for (const auto& [shape, file, published] : {std::tuple{"level-set", values[1], 30.1}, {"sh", values[2], 29.6}}) {
        double sum = 0, squares = 0;
        for (int seed = 1; seed <= seeds; ++seed) {
            double seconds = 0;
            const Heap heap = [&] {
                const Stopwatch clock(seconds);
                return collapse(column(shape, file, grains, friction, std::uint64_t(seed)), friction);
            }();
            sum += heap.angle, squares += heap.angle * heap.angle;
            std::printf("| %s | %d | %.1f deg | %.0f mm | %.0f mm | %.2f s | %.2g m/s | %.0f s |\n", shape, seed, heap.angle, 1e3 * heap.height, 1e3 * heap.radius,
                        heap.time, heap.speed, seconds);
            std::fflush(stdout);
        }
        const double mean = sum / seeds, spread = seeds > 1 ? std::sqrt(std::max(0.0, (squares - sum * mean) / (seeds - 1))) : 0;
        std::printf("%s: %.1f deg, standard deviation %.1f over %d seeds; published %.1f at friction 0.7\n", shape, mean, spread, seeds, published);
    }
}
