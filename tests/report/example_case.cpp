#include "report/example_case.h"

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "core/hdf5.h"
#include "core/output_file.h"
#include "core/record.h"

namespace coral::test {
namespace {

using Eigen::Vector3d;

constexpr double grain_diameter = 15e-3;

const char* const case_text = R"(sample = "sample.h5"
[domain]
origin = [0, 0, 0]
size = ["60mm", "60mm", "64mm"]
cell = "0.5mm"
[boundary]
"z+" = { type = "inlet", velocity = [0, 0, -0.1] }
"z-" = { type = "outlet", pressure = 0 }
[fluid]
density = 1000
kinematic_viscosity = 1e-6
[gravity]
vector = [0, 0, -9.81]
[material.default]
density = 2780
normal_stiffness = 2e5
friction = 0.7
[[wall]]
type = "plate"
z = "2mm"
hole = "6mm"
pitch = "12mm"
[time]
duration = "2s"
dem_step = "auto"
)";

std::vector<Vector3d> start_positions(const ExampleCase& example)
{
    std::vector<Vector3d> positions;
    for (std::size_t g = 0; g < example.grains; ++g)
        positions.push_back({0.012 + 0.018 * static_cast<double>(g % 3), 0.02 + 0.02 * static_cast<double>(g / 3 % 2), 0.014 + 0.016 * static_cast<double>(g / 6)});
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> across(0.003, 0.057), up(0.004, 0.06);
    for (std::size_t f = 0; f < example.fines; ++f) {
        const double x = across(random), y = across(random);
        positions.push_back({x, y, up(random)});
    }
    return positions;
}

/// Hollow ball of outer radius 1/2 diameter and a shell of a quarter of it, open towards +x: a void that fines can enter.
float hollow_ball(const Vector3d& p)
{
    const double r = p.norm(), outer = 0.5 * grain_diameter;
    const double shell = std::max(r - outer, 0.5 * outer - r);
    const double hole = 0.3 * outer - std::hypot(p.y(), p.z());
    return static_cast<float>(p.x() > 0 ? std::max(shell, hole) : shell);
}

void write_sample(const std::filesystem::path& file, const ExampleCase& example)
{
    H5File h5 = H5File::create(file);
    std::vector<std::int32_t> shape(example.grains, 0);
    std::vector<double> scale(example.grains, 1.0);
    std::vector<std::string> role(example.grains, "coarse");
    for (std::size_t f = 0; f < example.fines; ++f) {
        shape.push_back(1);
        scale.push_back(1.5e-3 + 1.5e-3 * static_cast<double>(f) / static_cast<double>(example.fines));
        role.push_back("fine");
    }
    h5.write("/particles/shape", shape, {shape.size()});
    h5.write("/particles/scale", scale, {scale.size()});
    h5.write("/particles/role", role);
    const std::size_t n = 48;
    const double spacing = 1.15 * grain_diameter / static_cast<double>(n - 1);
    const Vector3d origin = Vector3d::Constant(-0.5 * spacing * static_cast<double>(n - 1));
    std::vector<float> distance;
    for (std::size_t k = 0; k < n; ++k)
        for (std::size_t j = 0; j < n; ++j)
            for (std::size_t i = 0; i < n; ++i)
                distance.push_back(hollow_ball(origin + spacing * Vector3d(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k))));
    h5.write("/shapes/0/distance", distance, {n, n, n});
    h5.set_attribute("/shapes/0/distance", "origin", std::span<const double>(origin.data(), 3));
    h5.set_attribute("/shapes/0/distance", "spacing", spacing);
    h5.set_attribute("/shapes/0", "kind", "level-set");
    h5.set_attribute("/shapes/0", "equivalent_diameter", grain_diameter);
    h5.make_group("/shapes/1");
    h5.set_attribute("/shapes/1", "kind", "sphere");
    h5.set_attribute("/shapes/1", "equivalent_diameter", 1.0);
    h5.write("/criteria/name", std::vector<std::string>{"kezdi", "kenney-lau", "mao"});
    h5.write("/criteria/value", std::vector<double>{5.0, 0.0, 0.54}, {3});
    h5.write("/criteria/threshold", std::vector<double>{4.0, 1.0, 1.0}, {3});
    h5.write("/criteria/verdict", std::vector<std::string>{"unstable", "unstable", "unstable"});
    h5.write("/psd/size", std::vector<double>{1.5e-3, 2e-3, 3e-3, 14e-3, 15e-3}, {5});
    h5.write("/psd/passing", std::vector<double>{0.0, 0.1, 0.3, 0.3, 1.0}, {5});
    h5.make_group("/statistics");
    h5.set_attribute("/statistics", "porosity", 0.42);
    h5.commit();
}

struct Writer {
    H5File& h5;
    std::vector<double> time;

    void series(const std::string& name, const std::string& unit, const std::function<double(double)>& value) const
    {
        std::vector<double> values;
        for (double t : time) values.push_back(value(t));
        h5.write("/series/" + name, values, {time.size()});
        h5.set_attribute("/series/" + name, "unit", unit);
    }
};

void write_series(const Writer& out, const ExampleCase& example)
{
    const auto eroded = [&](double t) { return example_erosion(example, t); };
    const auto fines = static_cast<double>(example.fines);
    out.h5.write("/series/time", out.time, {out.time.size()});
    out.h5.set_attribute("/series/time", "unit", "s");
    out.series("eroded_mass_fraction", "1", eroded);
    if (!example.optional_series) return;
    out.series("eroded_count", "1", [&](double t) { return std::round(fines * eroded(t)); });
    std::vector<double> layers;
    for (double t : out.time) {
        const double gone = std::round(fines * eroded(t)), bottom = std::round(0.6 * gone), top = std::round(0.3 * gone);
        for (double n : {std::round(fines / 3) - bottom, std::round(fines / 3) - (gone - bottom - top), fines - 2 * std::round(fines / 3) - top}) layers.push_back(n);
    }
    out.h5.write("/series/fines_count", layers, {out.time.size(), 3});
    out.h5.set_attribute("/series/fines_count", "unit", "1");
    // At rest there is no gradient and the conductivity is no number: the first output as a real run writes it.
    const auto conductivity = [](double t) { return t == 0 ? NAN : 0.017 + 0.027 * (1 - std::exp(-t / 0.6)); };
    out.series("hydraulic_gradient", "1", [&](double t) { return t == 0 ? 0 : 0.1 / conductivity(t); });
    out.series("hydraulic_conductivity", "m/s", conductivity);
    out.series("velocity_interparticle", "m/s", [](double t) { return 0.21 + 0.01 * std::sin(9 * t); });
    out.series("velocity_intraparticle", "m/s", [](double t) { return 0.03 + 0.002 * std::sin(7 * t); });
    out.series("fluid_force_coarse", "N", [](double t) { return 2.4e-2 * (1 + 0.3 * std::exp(-t)); });
    out.series("fluid_force_fine", "N", [](double t) { return 6.1e-5 * (1 + 0.5 * std::exp(-t)); });
    out.series("contact_anisotropy", "1", [](double t) { return 0.2 + 0.2 * std::exp(-3 * t); });
    out.series("coordination", "1", [](double t) { return 4.1 + 1.2 * std::exp(-2 * t); });
    out.series("trapped_count", "1", [](double t) { return std::floor(5 * t); });
    out.series("kinetic_energy", "J", [](double t) { return t == 0 ? 0 : 1e-5 * std::exp(-t); });
    out.series("mass_balance_error", "1", [](double t) { return 1e-13 * std::sin(30 * t); });
    out.series("momentum_balance_error", "1", [](double t) { return 3e-11 * std::cos(30 * t); });
}

void write_tracks(const Writer& out, const ExampleCase& example)
{
    const std::vector<Vector3d> start = start_positions(example);
    const std::size_t bodies = start.size();
    std::vector<std::int64_t> id, fine_id, layer, eroded;
    std::vector<double> position, orientation, speed, path(example.fines, 0.0), net(example.fines, 0.0);
    for (std::size_t b = 0; b < bodies; ++b) id.push_back(static_cast<std::int64_t>(b));
    for (double t : out.time)
        for (std::size_t b = 0; b < bodies; ++b) {
            const bool fine = b >= example.grains;
            const auto rank = static_cast<double>(b - example.grains) / static_cast<double>(std::max<std::size_t>(1, example.fines));
            const double moved = !fine ? 0 : rank < example_erosion(example, t) ? 0.05 * t + start[b].z() : 0.006 * rank * (1 - std::exp(-t));
            for (double x : {start[b].x(), start[b].y(), start[b].z() - moved}) position.push_back(x);
            const double half = fine ? 0 : 0.1 * t;
            for (double q : {std::cos(half), 0.0, 0.0, std::sin(half)}) orientation.push_back(q);
            speed.push_back(fine ? 0.05 * std::exp(-t) * (1 + rank) : 0);
            if (fine) path[b - example.grains] = net[b - example.grains] = moved;
        }
    for (std::size_t f = 0; f < example.fines; ++f) {
        fine_id.push_back(static_cast<std::int64_t>(example.grains + f));
        layer.push_back(static_cast<std::int64_t>(std::min(2.0, std::floor(start[example.grains + f].z() / 0.0205))));
        eroded.push_back(path[f] > 0.03);
    }
    const std::size_t steps = out.time.size();
    out.h5.write("/trajectories/id", id, {bodies});
    out.h5.write("/trajectories/position", position, {steps, bodies, 3});
    out.h5.write("/trajectories/orientation", orientation, {steps, bodies, 4});
    out.h5.write("/trajectories/speed", speed, {steps, bodies});
    out.h5.write("/migration/id", fine_id, {example.fines});
    out.h5.write("/migration/path_length", path, {example.fines});
    out.h5.write("/migration/net_displacement", net, {example.fines});
    out.h5.write("/migration/layer", layer, {example.fines});
    out.h5.write("/migration/eroded", eroded, {example.fines});
}

}  // namespace

double example_erosion(const ExampleCase& example, double time) { return example.erosion * (1 - std::exp(-time / 0.5)); }

void write_example_case(const std::filesystem::path& folder, const ExampleCase& example)
{
    std::filesystem::create_directories(folder);
    write_text_file(folder / "case.toml", case_text);
    if (example.sample) write_sample(folder / "sample.h5", example);
    H5File h5 = H5File::create(folder / "results.h5");
    Writer out{h5, {}};
    for (std::size_t i = 0; i < example.steps; ++i) out.time.push_back(2.0 * static_cast<double>(i) / static_cast<double>(example.steps - 1));
    write_series(out, example);
    if (example.trajectories) write_tracks(out, example);
    const double steps = 125000, rate = 2.5e6;
    h5.write("/performance/steps", std::span<const double>(&steps, 1), {1});
    h5.write("/performance/cells_per_second", std::span<const double>(&rate, 1), {1});
    h5.set_attribute("/performance/cells_per_second", "unit", "1/s");
    const History history{{"pack-sample", "0.1.0", {{"seed", "3"}}, {"spec.toml"}}, {"suffuse", "0.1.0", {{"until", "2 s"}}, {"case"}}};
    h5.set_attribute("/", "history", to_json(history));
    h5.write("/case", std::vector<std::string>{case_text});
    h5.commit();
}

}  // namespace coral::test
