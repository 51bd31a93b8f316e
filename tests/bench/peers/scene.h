#pragma once
/// \file bench/peers/scene.h
/// Scenes as text that every code reads: lines "# name number..." first, then one body a line. SI units, 17 digits where they matter: at rest
/// the overlaps are nanometres, and positions of six digits would blow the bed apart.
#include <sys/resource.h>

#include <Eigen/Core>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "bench/table.h"
#include "core/error.h"
#include "core/text.h"
#include "dem/world.h"

namespace coral::bench {

/// The case all codes run, where the scene file does not say otherwise (Table 2 of the paper).
inline const dem::Material material{};
inline constexpr double time_step = 2e-6;  ///< [s]

struct Scene {
    std::map<std::string, std::vector<double>> header;
    std::vector<std::vector<double>> bodies;

    Eigen::Vector3d vector(const std::string& name) const
    {
        const std::vector<double>& v = header.at(name);
        return {v.at(0), v.at(1), v.at(2)};
    }
    double number(const std::string& name) const { return header.at(name).at(0); }
};

inline Scene read_scene(const std::string& file)
{
    Scene scene;
    std::ifstream in(file);
    if (!in) throw Error(file, "cannot be read", "make it first");
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::string name;
        std::vector<double>* numbers = nullptr;
        if (line.starts_with('#')) {
            words.ignore(1);
            words >> name;
            numbers = &scene.header[name];
        } else {
            numbers = &scene.bodies.emplace_back();
        }
        for (double x = 0; words >> x;) numbers->push_back(x);
    }
    return scene;
}

inline void write_scene(const std::string& file, const Scene& scene)
{
    std::ofstream out(file);
    const auto write = [&](const std::vector<double>& numbers) {
        for (std::size_t i = 0; i < numbers.size(); ++i) out << (i == 0 ? "" : " ") << to_text(numbers[i]);
        out << '\n';
    };
    for (const auto& [name, numbers] : scene.header) {
        out << "# " << name << ' ';
        write(numbers);
    }
    for (const std::vector<double>& body : scene.bodies) write(body);
    if (!out.flush()) throw Error(file, "cannot be written", "is the disk full?");
}

inline void write_law(Scene& scene)
{
    scene.header["density"] = {material.density};
    scene.header["normal_stiffness"] = {material.normal_stiffness};
    scene.header["tangential_stiffness"] = {material.tangential_stiffness};
    scene.header["friction"] = {material.friction};
    scene.header["damping"] = {material.damping};
    scene.header["time_step"] = {time_step};
    scene.header["gravity"] = {0, 0, -9.81};
}

/// World with the material, gravity and box of a scene.
inline dem::World empty_world(const Scene& scene, double skin)
{
    dem::WorldOptions options;
    options.gravity = scene.vector("gravity");
    options.skin = skin;
    dem::World world(options);
    world.add_material({"scene", scene.number("density"), scene.number("normal_stiffness"), scene.number("tangential_stiffness"),
                        scene.number("friction"), scene.number("damping")});
    world.add_box(scene.vector("lower"), scene.vector("upper"));
    return world;
}

/// CPU time of this process, all threads [s].
inline double cpu_seconds()
{
    rusage use{};
    getrusage(RUSAGE_SELF, &use);
    const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
    return seconds(use.ru_utime) + seconds(use.ru_stime);
}

/// Steps the world, unmeasured first, and prints one JSON object with the cost of the measured steps.
inline void measure(dem::World& world, double dt, int warm, int steps)
{
    world.advance(warm * dt, dt);
    const dem::Counters before = world.counters();
    const double cpu = cpu_seconds();
    const double wall = seconds([&] { world.advance(steps * dt, dt); });
    const double used = cpu_seconds() - cpu;
    const dem::Counters& after = world.counters();
    if (after.steps - before.steps != steps) throw Error("peers", "another number of steps", "look at World::advance");
    const dem::Statistics statistics = world.statistics();
    double overlap = 0;
    const std::vector<dem::Contact> contacts = world.contacts();
    for (const dem::Contact& contact : contacts) overlap += contact.overlap / static_cast<double>(contacts.size());
    const auto per_step = [&](auto counted) { return double(counted) / steps; };
    std::printf("{\"steps\": %d, \"cpu\": %.6f, \"wall\": %.6f, \"contacts\": %.1f, \"pair_tests\": %.1f, \"node_tests\": %.1f, \"rebuilds\": %lld, "
                "\"seconds_pairs\": %.4f, \"seconds_integration\": %.4f, \"seconds_lists\": %.4f, \"mean_overlap\": %.6g, \"kinetic_energy\": %.4g, "
                "\"max_speed\": %.4g, \"unbalanced_ratio\": %.4g}\n",
                steps, used, wall, per_step(after.contacts - before.contacts), per_step(after.pair_tests - before.pair_tests),
                per_step(after.node_tests - before.node_tests), static_cast<long long>(after.rebuilds - before.rebuilds),
                after.seconds_pairs - before.seconds_pairs, after.seconds_integration - before.seconds_integration,
                after.seconds_lists - before.seconds_lists, overlap, statistics.kinetic_energy, statistics.max_speed, statistics.unbalanced_ratio);
}

/// Runs until next to nothing moves: kinetic energy below that of a fall of all bodies by 1e-6 of their radius. Speeds are set to zero from time to
/// time, which takes out the slow swaying that contact damping hardly sees.
inline void settle(dem::World& world, double dt, double radius)
{
    const double gravity = world.gravity().norm();
    for (int round = 0; round < 300; ++round) {
        world.advance(2e-3, dt);
        double mass = 0;
        for (int i = 0; i < world.body_count(); ++i) mass += world.mass(i);
        const dem::Statistics s = world.statistics();
        if (round % 10 == 0) std::fprintf(stderr, "%.3f s: kinetic %.3g J, unbalanced %.3g, contacts %lld\n", world.time(), s.kinetic_energy,
                                          s.unbalanced_ratio, static_cast<long long>(s.contacts));
        const bool falling = s.kinetic_energy > 1e-3 * mass * gravity * radius;
        if (!falling && s.kinetic_energy < 1e-6 * mass * gravity * radius && s.unbalanced_ratio < 1e-2) return;
        if (falling || round % 5 != 4) continue;
        for (int i = 0; i < world.body_count(); ++i) world.set_velocity(i, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    }
    std::fputs("some bodies still move\n", stderr);
}

}  // namespace coral::bench
