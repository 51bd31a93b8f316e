#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>

#include "core/error.h"
#include "core/progress.h"
#include "core/text.h"
#include "pack/detail/phases.h"
#include "pack/detail/random.h"
#include "pack/sample_world.h"

namespace coral::pack::detail {
namespace {

using Batch = std::vector<int>;  ///< particles dropped together

void shuffle(std::vector<int>& items, Random& random)
{
    for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[std::size_t(uniform(random) * double(i))]);
}

double bounding_radius(const std::vector<std::shared_ptr<const dem::Shape>>& shapes, const Particle& p)
{
    return shapes[std::size_t(p.shape)]->bounding_radius() * p.scale;
}

/// Number of layers that keeps each coarse batch to about one layer of grains; without coarse grains, a few diameters of fines.
int layer_count(const Sample& sample, const std::vector<int>& coarse, const std::vector<double>& radius, double base)
{
    double area = 0;
    const auto cover = [&](int i) { return 4 * radius[std::size_t(i)] * radius[std::size_t(i)]; };
    if (!coarse.empty()) {
        for (const int i : coarse) area += cover(i);
        return std::clamp(int(std::ceil(area / (0.8 * base))), 1, int(coarse.size()));
    }
    for (std::size_t i = 0; i < sample.particles.size(); ++i) area += cover(int(i));
    return std::max(1, int(std::ceil(area / (4 * base))));
}

/// Coarse and fine batches in turn; each role is shuffled so that every batch has its share of all populations.
std::vector<Batch> make_batches(const Sample& sample, const std::vector<double>& radius, const Spec& spec, Random& random)
{
    std::vector<int> coarse, fine;
    for (std::size_t i = 0; i < sample.particles.size(); ++i)
        (sample.particles[i].role == Role::coarse ? coarse : fine).push_back(int(i));
    shuffle(coarse, random);
    shuffle(fine, random);
    const int layers = spec.dropping.layers > 0 ? spec.dropping.layers : layer_count(sample, coarse, radius, base_area(spec));
    std::vector<Batch> batches;
    for (int layer = 0; layer < layers; ++layer)
        for (const auto* role : {&coarse, &fine}) {
            const auto share = [&](int part) { return role->begin() + std::ptrdiff_t(role->size()) * part / layers; };
            if (share(layer) != share(layer + 1)) batches.emplace_back(share(layer), share(layer + 1));
        }
    return batches;
}

/// Evenly distributed where a ball of radius r fits between the side walls, from two even numbers.
Eigen::Vector2d somewhere(const Spec& spec, double r, double x, double y)
{
    if (spec.cylinder) {
        const double radius = 0.5 * spec.size.x(), across = (radius - r) * std::sqrt(x), angle = 2 * std::numbers::pi * y;
        return {radius + across * std::cos(angle), radius + across * std::sin(angle)};
    }
    const Eigen::Vector2d share(x, y);
    Eigen::Vector2d place;
    for (int axis = 0; axis < 2; ++axis)
        place[axis] = spec.period[axis] > 0 ? share[axis] * spec.size[axis] : r + share[axis] * std::max(spec.size[axis] - 2 * r, 0.0);
    return place;
}

/// A grain must not touch another, or itself, on two sides at once.
void check_periods(const Spec& spec, const std::vector<double>& radius)
{
    const double largest = *std::max_element(radius.begin(), radius.end());
    for (int axis = 0; axis < 2; ++axis)
        if (spec.period[axis] > 0 && spec.period[axis] < 4 * largest)
            throw UsageError(spec.box_location, std::string("key 'box.size': grains of bounding diameter ") + to_text(2 * largest) + " m need a periodic side of twice that, and " +
                                                    "xyz"[axis] + " has " + to_text(spec.period[axis]) + " m", "enlarge the box along it, or give it walls");
}

/// Places a batch at random above `floor` without overlap of bounding spheres, in a slab as thin as the grains allow.
void place(const Batch& batch, Sample& sample, const std::vector<double>& radius, const Spec& spec, double floor, Random& random)
{
    double volume = 0;
    for (const int i : batch) volume += 8 * std::pow(radius[std::size_t(i)], 3);
    double thickness = volume / (0.4 * base_area(spec));
    for (std::size_t n = 0; n < batch.size(); ++n) {
        Particle& p = sample.particles[std::size_t(batch[n])];
        const double r = radius[std::size_t(batch[n])];
        if (2 * r > spec.size.head<2>().minCoeff())
            throw UsageError(spec.box_location, "key '" + spec.box_key + "': a grain of bounding diameter " + to_text(2 * r) + " m does not fit between the walls", "enlarge the base of the box");
        p.orientation = random_rotation(random);
        for (int attempt = 1;; ++attempt) {
            const double x = uniform(random), y = uniform(random), z = uniform(random);
            p.position << somewhere(spec, r, x, y), floor + r + z * std::max(thickness - 2 * r, 0.0);
            const bool free = std::all_of(batch.begin(), batch.begin() + std::ptrdiff_t(n), [&](int other) {
                const double reach = r + radius[std::size_t(other)];
                return nearest_image(sample, sample.particles[std::size_t(other)].position - p.position).squaredNorm() > reach * reach;
            });
            if (free) break;
            if (attempt % 200 == 0) thickness *= 1.05;
        }
    }
}

/// World of the pouring: softened contacts, the smooth walls of the sample. `walls` gets their ids.
dem::World soft_world(const Sample& sample, const Spec& spec, const std::vector<std::shared_ptr<const dem::Shape>>& shapes, std::vector<int>& walls)
{
    dem::WorldOptions options;
    options.gravity = spec.gravity;
    options.period = spec.period;
    options.sphere_scheme = spec.sphere_scheme;
    options.step_fraction = 0.5;
    dem::World world(options);
    for (const auto& shape : shapes) world.add_shape(shape);
    for (Material m : sample.materials) {
        m.normal_stiffness *= spec.dropping.stiffness_factor;
        m.tangential_stiffness *= spec.dropping.stiffness_factor;
        m.friction = std::min(m.friction, spec.dropping.friction);
        m.damping = spec.dropping.damping;
        world.add_material(m);
    }
    Material smooth = world.material(0);
    smooth.name = "wall";
    smooth.friction = 0;
    const int material = world.add_material(smooth);
    for (const Wall& wall : sample.walls) walls.push_back(add_wall(world, wall, material));
    return world;
}

double highest_point(const dem::World& world)
{
    double top = 0;
    for (int i = 0; i < world.body_count(); ++i) top = std::max(top, world.position(i).z() + world.bounding_radius(i));
    return top;
}

/// Steps until the stop rule holds or the time is up. Returns whether it held.
bool settle(dem::World& world, const Dropping& rule, double speed_limit, Keeper& keeper, LapClock& clock, const std::function<void()>& check,
            const std::function<void(double, const MotionWindow::Means&)>& tell)
{
    constexpr int batch_of_steps = 100, decay_every = 10;
    const double dt = world.auto_time_step(), start = keeper.state.start;
    MotionWindow window(world);
    while (world.time() - start < rule.time_limit) {
        clock.lap();
        keeper.visit(world);
        window.start(world);
        for (int i = 0; i < batch_of_steps; ++i) {
            world.step(dt);
            if (i % decay_every == 0) decay_velocities(world, rule.drag, decay_every * dt);
        }
        const MotionWindow::Means means = window.means(world);
        check();
        tell(world.time() - start, means);
        if (means.contacts > 0 && means.unbalanced_ratio < rule.unbalanced_ratio && means.speed < speed_limit) return true;
    }
    return false;
}

/// Bodies of a batch where their particles are.
void add_bodies(dem::World& world, const Sample& sample, const Batch& batch)
{
    for (const int i : batch) {
        const Particle& p = sample.particles[std::size_t(i)];
        dem::BodySpec body;
        body.shape = p.shape;
        body.material = p.material;
        body.scale = p.scale;
        body.role = to_string(p.role);
        body.position = p.position;
        body.orientation = p.orientation;
        world.add_body(body);
    }
}

/// The batches that the checkpoint has placed. The state of their bodies follows.
void resume(dem::World& world, const Sample& sample, const std::vector<Batch>& batches, Random& random, Keeper& keeper)
{
    if (std::size_t(keeper.state.batch) >= batches.size()) keeper.damaged();
    for (int b = 0; b <= keeper.state.batch; ++b) add_bodies(world, sample, batches[std::size_t(b)]);
    keeper.restore(world);
    std::istringstream(keeper.state.random) >> random;
}

std::string as_text(const Random& random)
{
    std::ostringstream text;
    text << random;
    return std::move(text).str();
}

}  // namespace

void decay_velocities(dem::World& world, double rate, double time)
{
    if (rate <= 0) return;
    const double factor = std::exp(-rate * time);
    for (int i = 0; i < world.body_count(); ++i) world.set_velocity(i, factor * world.velocity(i), factor * world.angular_velocity(i));
}

void pour(Grains& grains, const Spec& spec, std::uint64_t seed, Keeper& keeper)
{
    PackReport& report = keeper.state.report;
    LapClock clock(report.pouring_seconds);
    Sample& sample = grains.sample;
    Random random(seed ^ 0x706f7572ULL);  // another stream than that of the drawing
    std::vector<std::shared_ptr<const dem::Shape>> shapes;
    for (const ShapeTemplate& s : sample.shapes) shapes.push_back(make_shape(s));
    std::vector<double> radius;
    double smallest = 1e300;
    for (const Particle& p : sample.particles) {
        radius.push_back(bounding_radius(shapes, p));
        smallest = std::min(smallest, equivalent_diameter(sample, p));
    }
    const std::vector<Batch> batches = make_batches(sample, radius, spec, random);
    check_periods(spec, radius);
    sample.walls = walls_around(spec, std::numeric_limits<double>::infinity());  // no lid
    std::vector<int> walls;
    dem::World world = soft_world(sample, spec, shapes, walls);
    const Box box(sample, walls);
    bool placed = keeper.resumes(Phase::pouring);
    if (placed) resume(world, sample, batches, random, keeper);
    const double limit = spec.dropping.speed_ratio * std::sqrt(spec.gravity.norm() * smallest);
    std::vector<int> grain_of_body;
    for (const Batch& batch : batches) grain_of_body.insert(grain_of_body.end(), batch.begin(), batch.end());
    const auto check = [&] {
        for (int i = 0; i < world.body_count(); ++i)
            box.check_inside(world, i, grain_of_body[std::size_t(i)], "pouring", "raise [dropping] stiffness_factor or layers, or lower drop_height");
    };
    Progress progress("pouring", double(batches.size()), keeper.state.batch);
    for (std::size_t b = std::size_t(keeper.state.batch); b < batches.size(); ++b) {
        if (!placed) {
            place(batches[b], sample, radius, spec, highest_point(world) + spec.dropping.drop_height, random);
            add_bodies(world, sample, batches[b]);
            keeper.state.batch = int(b);
            keeper.state.start = world.time();
            keeper.state.random = as_text(random);
        }
        placed = false;
        const bool settled = settle(world, spec.dropping, limit, keeper, clock, check, [&](double time, const MotionWindow::Means& means) {
            progress.update(double(b) + std::min(time / spec.dropping.time_limit, 0.99), "layer " + std::to_string(b + 1) + " of " + std::to_string(batches.size()) + ", " + describe(means));
        });
        report.unsettled_layers += !settled;
    }
    progress.finish();
    for (std::size_t i = 0; i < grain_of_body.size(); ++i) {
        Particle& p = sample.particles[std::size_t(grain_of_body[i])];
        p.position = world.position(int(i));
        p.orientation = world.orientation(int(i));
    }
    sample.size = {spec.size.x(), spec.size.y(), highest_point(world)};
    report.layers = int(batches.size());
    report.steps += world.counters().steps;
    report.simulated_time += world.time();
}

}  // namespace coral::pack::detail
