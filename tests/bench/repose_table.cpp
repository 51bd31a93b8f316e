// Angle of repose of coral grains, in two ways: a column stands in a cylinder that vanishes, or grains stand behind a wall that is drawn back slowly.
//     repose_table GRAINS.vdb GRAINS.sh.h5 [grains] [seeds] [friction]
// Huang et al., Engineering Geology 315 (2023) 107023: 30.1 degrees with level sets and 29.6 with harmonics of 2500 grains at friction 0.7, 30.3 in
// the experiment. A column set free at once runs out further than it would stand (Lube et al., J. Fluid Mech. 508, 2004, 175); behind a wall that
// moves by a tenth of sqrt(g d) the slope fails grain by grain. Here grains have one diameter, and the base has the friction of the grains.
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
constexpr double longest = 15;  // of the collapse [s]

enum class Way { set_free, drawn_back };

/// The heap is a cone about an axis, or a wedge that stands at x = 0 and repeats itself along y.
constexpr double wedge_width = 5 * diameter;

/// Grains poured and come to rest: a column as high as wide, or a layer half again as high as long behind the wall x+.
pack::Sample pour(Way way, const std::string& shape, const std::filesystem::path& file, int grains, double friction, std::uint64_t seed)
{
    const double space = grains * std::numbers::pi / 6 * std::pow(diameter, 3) / 0.5;
    std::string text;
    if (way == Way::set_free) {
        const double width = std::cbrt(4 * space / std::numbers::pi);
        text = "[cylinder]\ndiameter = " + to_text(width) + "\nheight = " + to_text(1.3 * width);
    } else {
        const double length = std::sqrt(space / wedge_width / 1.5);
        text = "[box]\nperiodic = [\"y\"]\nsize = [" + to_text(length) + ", " + to_text(wedge_width) + ", " + to_text(2 * length) + "]";
    }
    text += "\n[[population]]\nrole = \"coarse\"\nshape = \"" + shape + "\"\nfile = \"" + std::filesystem::absolute(file).string() + "\"\ndiameter = " + to_text(diameter) +
            "\ncount = " + std::to_string(grains) + "\n[material.default]\nfriction = " + to_text(friction) + "\n[dropping]\nstiffness_factor = 0.1\n";
    const auto spec = std::filesystem::temp_directory_path() / ("repose_" + shape + ".toml");
    write_text_file(spec, text);
    pack::PackReport report;
    pack::Sample sample = pack::pack(pack::read_spec(spec), seed, report);
    std::filesystem::remove(spec);
    return sample;
}

struct Heap {
    double angle = 0, height = 0, length = 0;  ///< [degrees], [m]; length of the slope that was fitted
    double time = 0, speed = 0;                ///< of the collapse [s]; mean at its end [m/s]
};

/// Line of least squares through the surface: in every bin a grain long, the mean over the strips of the highest grain, from the bin
/// beside the axis or wall to where the surface comes down to one grain and a half. No number where that is fewer than two bins.
void measure(const dem::World& world, Way way, Heap& heap)
{
    constexpr int strips = 8;
    Vector2d centre = Vector2d::Zero();
    for (const Vector3d& x : world.positions()) centre += x.head<2>() / world.body_count();
    std::vector<std::array<double, strips>> top;
    for (const Vector3d& x : world.positions()) {
        const Vector2d arm = x.head<2>() - centre;
        const double along = way == Way::set_free ? arm.norm() : std::max(x.x(), 0.0);
        const double across = way == Way::set_free ? (std::atan2(arm.y(), arm.x()) + std::numbers::pi) / (2 * std::numbers::pi) : x.y() / wedge_width - std::floor(x.y() / wedge_width);
        const std::size_t bin = std::size_t(along / diameter);
        if (bin >= top.size()) top.resize(bin + 1, {});
        double& highest = top[bin][std::size_t(std::clamp(int(across * strips), 0, strips - 1))];
        highest = std::max(highest, x.z() + 0.5 * diameter);
        heap.height = std::max(heap.height, x.z() + 0.5 * diameter);
    }
    double n = 0, r1 = 0, z1 = 0, rr = 0, rz = 0;
    for (std::size_t bin = 1; bin < top.size(); ++bin) {
        double height = 0;
        for (const double z : top[bin]) height += z / strips;
        if (height < 1.5 * diameter) break;
        const double r = (double(bin) + 0.5) * diameter;
        n += 1, r1 += r, z1 += height, rr += r * r, rz += r * height;
        heap.length = r;
    }
    const double slope = (n * rz - r1 * z1) / (n * rr - r1 * r1);
    heap.angle = std::atan(-slope) * 180 / std::numbers::pi;
}

/// Until the grains are at rest and, where a wall is drawn back, none is near it.
Heap collapse(pack::Sample sample, Way way, double friction)
{
    for (pack::Wall& wall : sample.walls) wall.friction = friction;
    dem::World world(pack::world_options(sample));
    const std::vector<std::string> walls = way == Way::set_free ? std::vector<std::string>{"z-"} : std::vector<std::string>{"x-", "x+", "z-"};
    const pack::SampleIds ids = pack::add_sample(world, sample, walls);
    pack::restore_springs(world, sample, ids);
    const double start = world.time(), gravity_speed = std::sqrt(9.81 * diameter);
    int drawn = -1;
    for (std::size_t i = 0; i < sample.walls.size(); ++i)
        if (sample.walls[i].name == "x+") drawn = ids.walls[i];
    if (drawn >= 0) world.set_wall_velocity(drawn, 0.1 * gravity_speed * Vector3d::UnitX());
    Heap heap;
    bool leaning = false;
    do {
        world.advance(0.05);
        double furthest = 0;
        heap.speed = 0;
        for (int i = 0; i < world.body_count(); ++i) {
            heap.speed += world.velocities()[std::size_t(i)].norm() / world.body_count();
            furthest = std::max(furthest, world.position(i).x());
        }
        leaning = drawn >= 0 && world.wall_point(drawn).x() < furthest + 2 * diameter;
        heap.time = world.time() - start;
    } while ((heap.time < 0.3 || leaning || heap.speed > 0.002 * gravity_speed) && heap.time < longest);
    measure(world, way, heap);
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
    std::puts("| way | shape | seed | angle | height | slope to | time | mean speed | wall time |\n|---|---|---|---|---|---|---|---|---|");
    for (const auto& [way, name] : {std::pair{Way::set_free, "set free at once"}, {Way::drawn_back, "wall drawn back"}})
        for (const auto& [shape, file, published] : {std::tuple{"level-set", values[1], 30.1}, {"sh", values[2], 29.6}}) {
            double sum = 0, squares = 0;
            for (int seed = 1; seed <= seeds; ++seed) {
                double seconds = 0;
                const Heap heap = [&] {
                    const Stopwatch clock(seconds);
                    return collapse(pour(way, shape, file, grains, friction, std::uint64_t(seed)), way, friction);
                }();
                sum += heap.angle, squares += heap.angle * heap.angle;
                std::printf("| %s | %s | %d | %.1f deg | %.0f mm | %.0f mm | %.2f s | %.2g m/s | %.0f s |\n", name, shape, seed, heap.angle, 1e3 * heap.height, 1e3 * heap.length,
                            heap.time, heap.speed, seconds);
                std::fflush(stdout);
            }
            const double mean = sum / seeds, spread = seeds > 1 ? std::sqrt(std::max(0.0, (squares - sum * mean) / (seeds - 1))) : 0;
            std::printf("%s, %s: %.1f deg, standard deviation %.1f over %d seeds; published %.1f at friction 0.7\n", name, shape, mean, spread, seeds, published);
        }
}
