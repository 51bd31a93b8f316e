// Room of spheres in throats and grooves of lattices: what each scheme of contact and each spacing leaves of it, what it keeps of energy, what it costs.
#include <ctime>
#include <numbers>
#include <random>

#include "core/parallel.h"
#include "dem/cavities_for_tests.h"
#include "dem/detail/facets.h"

namespace {

using namespace coral;
using namespace coral::dem;
using namespace coral::dem::testing;

/// Largest radius of a sphere at a point that touches nothing [m].
double room(World& world, const Vec3& at, double most)
{
    double low = 0.5 * most, high = 1.5 * most;
    for (int n = 0; n < 14; ++n) {
        const double r = 0.5 * (low + high);
        const int b = add_sphere(world, 1, 2 * r, at);
        (world.statistics().contacts > 0 ? high : low) = r;
        world.remove_body(b);
    }
    return 0.5 * (low + high);
}

struct Spread {
    double sum = 0, low = 1e9, high = -1e9;
    int count = 0;
    void add(double v)
    {
        sum += v;
        low = std::min(low, v);
        high = std::max(high, v);
        ++count;
    }
};

constexpr SphereScheme schemes[] = {SphereScheme::nearest, SphereScheme::automatic, SphereScheme::walls};
const char* name(SphereScheme s) { return s == SphereScheme::walls ? "walls" : s == SphereScheme::nearest ? "nearest" : "automatic"; }

void throats()
{
    std::printf("\nCylindrical throat: room at a point less the true one [um], mean (least ... greatest) over 12 places and tilts of the axis\n");
    std::printf("%8s %8s %10s %30s %30s %30s\n", "radius", "spacing", "scheme", "on the axis", "h/4 off the axis", "half way to the wall");
    for (const double rho : {0.5e-3, 1e-3, 1.5e-3})
        for (const double h : {2e-4, 1e-4, 5e-5})
            for (const SphereScheme scheme : schemes) {
                std::mt19937_64 random(3);
                std::uniform_real_distribution<double> u(-0.5, 0.5);
                Spread axis, near, middle;
                for (int place = 0; place < 12; ++place) {
                    const Vec3 shift = 2e-4 * Vec3(u(random), u(random), u(random));
                    const Vec3 d = place < 4 ? Vec3::UnitZ() : Vec3(u(random), u(random), u(random)).normalized();
                    const Vec3 e = d.cross(place < 2 ? Vec3::UnitX() : Vec3(u(random), u(random), u(random))).normalized();
                    const auto shape = carved([&](const Vec3& p) { return rho - (p - shift).cross(d).norm(); }, 1.6 * rho + 0.6e-3, h);
                    World world = cavity_world(shape, scheme);
                    axis.add(1e6 * (room(world, shift, rho) - rho));
                    near.add(1e6 * (room(world, shift + 0.25 * h * e, rho) - (rho - 0.25 * h)));
                    middle.add(1e6 * (room(world, shift + 0.5 * rho * e, 0.5 * rho) - 0.5 * rho));
                }
                std::printf("%8.2f %8.0f %10s", 1e3 * rho, 1e6 * h, name(scheme));
                for (const Spread* s : {&axis, &near, &middle}) std::printf("   %8.1f (%7.1f ... %7.1f)", s->sum / s->count, s->low, s->high);
                std::printf("\n");
                std::fflush(stdout);
            }
}

void grooves()
{
    const double r = 1e-3, g = 9810;
    std::printf("\nGroove of 60 degrees, sphere of 2 mm under 1000 g: height of rest above the true one, overlap at rest against the true 0.571 um\n");
    std::printf("%8s %10s %22s %16s %14s %16s %18s\n", "spacing", "scheme", "axis", "height [um]", "overlap [um]", "speed [m/s]", "friction slots");
    for (const double h : {2e-4, 1e-4, 5e-5})
        for (const SphereScheme scheme : schemes)
            for (int axis = 0; axis < 3; ++axis) {
                // The lattice of tabulate() has nodes at -half - 0.37 h + k h; half = 4 mm is a multiple of all three spacings.
                const Vec3 shift = axis == 0 ? Vec3(-0.37 * h, 0, -1.5e-3) : Vec3(0.08 * h, 0, -1.5e-3);
                const Quat turn = axis == 2 ? Quat(Eigen::AngleAxisd(0.2, Vec3(1, 0.4, 2).normalized())) : Quat::Identity();
                World world = cavity_world(carved(groove(shift, turn), 4e-3, h), scheme, turn * Vec3(0, 0, -g), 0.3, 0.0);
                const Vec3 up = turn * Vec3::UnitZ();
                const int b = add_sphere(world, 1, 2 * r, shift + (2 * r + 100e-6) * up);
                world.advance(10e-3);
                double height = 0, overlap = 0, speed = 0;
                const int count = 2000;
                for (int n = 0; n < count; ++n) {
                    world.step(world.auto_time_step());
                    height += up.dot(world.position(b) - shift) / count;
                    speed += world.velocity(b).norm() / count;
                }
                for (const Contact& c : world.contacts()) overlap = c.overlap;
                const double k = 2e5, rest = world.mass(b) * g / (2 * k * 0.5);
                const char* axes[] = {"on a lattice plane", "between planes", "tilted"};
                std::printf("%8.0f %10s %22s %16.2f %14.3f %16.2e %18zu\n", 1e6 * h, name(scheme), axes[axis], 1e6 * (height - 2 * r + 2 * rest), 1e6 * overlap,
                            speed, world.contact_springs().size());
                std::fflush(stdout);
            }
}

struct Cavity {
    const char* name;
    Distance distance;
    double half, radius;  ///< of the block; of the sphere
    Vec3 start = Vec3::Zero(), gravity = Vec3::Zero();
    double speed = 0.1;
};

std::vector<Cavity> cavities()
{
    return {{"round void, 2 R", [](const Vec3& p) { return 2e-3 - p.norm(); }, 2.6e-3, 1e-3},
            {"round void, 1.05 R", [](const Vec3& p) { return 1.05e-3 - p.norm(); }, 1.8e-3, 1e-3},
            {"bore, 1.05 R", [](const Vec3& p) { return 1.05e-3 - to_segment(p, Vec3(-1e-3, 0.5e-3, 0.2e-3), Vec3(1.2e-3, -0.3e-3, 0.1e-3)); }, 3e-3, 1e-3, Vec3(0.1e-3, 0.1e-3, 0.15e-3)},
            {"three bores, 1.15 R", three_bores, 3.8e-3, 1e-3, Vec3(0.2e-3, -0.1e-3, 0.15e-3)},
            {"cube, 3 R", [](const Vec3& p) { return 1.5e-3 - p.cwiseAbs().maxCoeff(); }, 2.2e-3, 1e-3},
            {"groove of 60 degrees", groove(Vec3(0, 0, -1.5e-3), Quat::Identity()), 4e-3, 1e-3, Vec3(0.1e-3, 0, 1e-3), Vec3(0, 0, -9.81), 0.02}};
}

void bounces()
{
    std::printf("\nUndamped bouncing for 0.1 s, 200 um: relative error of the energy out of contact, 8 starts (3 at the short step): mean of the last, greatest at any time; cost\n");
    std::printf("%22s %10s %10s %12s %12s %12s %12s\n", "cavity", "scheme", "step [s]", "mean", "greatest", "us/step", "explodes");
    for (const Cavity& c : cavities())
        for (const SphereScheme scheme : schemes)
            for (const double dt : {2e-6, 5e-7}) {
                const auto shape = carved(c.distance, c.half, 2e-4);
                const int starts = dt > 1e-6 ? 8 : 3;
                std::mt19937_64 random(5);
                std::normal_distribution<double> normal;
                double mean = 0, worst = 0, time = 0;
                int steps = 0, escaped = 0;
                for (int start = 0; start < starts; ++start) {
                    World world = cavity_world(shape, scheme, c.gravity);
                    const Vec3 to(normal(random), normal(random), normal(random));
                    const Vec3 at = c.start;
                    Vec3 v = c.speed * to.normalized();
                    if (c.gravity.norm() > 0) v.y() = 0;
                    const int b = add_sphere(world, 1, 2 * c.radius, at, v);
                    const double base = world.mass(b) * -world.gravity().dot(at - Vec3(0, 0, 0.5e-3));
                    const double before = world.energy().kinetic + base;
                    double last = 0;
                    const int count = int(0.1 / dt);
                    const std::clock_t begin = std::clock();
                    {
                        for (int n = 0; n < count; ++n) {
                            if (world.velocity(b).norm() > 2) break;  // it gains energy without end
                            world.step(dt);
                            if (n % 50) continue;
                            if (world.statistics().contacts > 0) continue;
                            const double now = world.energy().kinetic + world.mass(b) * -world.gravity().dot(world.position(b) - Vec3(0, 0, 0.5e-3));
                            last = std::abs(now / before - 1);
                            worst = std::max(worst, last);
                        }
                    }
                    time += double(std::clock() - begin) / CLOCKS_PER_SEC;
                    steps += count;
                    mean += last / starts;
                    escaped += world.velocity(b).norm() > 2;
                }
                std::printf("%22s %10s %10.1e %12.2e %12.2e %12.2f %12d\n", c.name, name(scheme), dt, mean, worst, 1e6 * time / steps, escaped);
                std::fflush(stdout);
            }
}

/// 150 spheres of 2 mm on a grain of 15 mm: time of a pair in one step.
void costs()
{
    std::printf("\nSphere of 2 mm on a ball of 15 mm: processor time of a pair in a step (with the integration of the sphere); the triangulated surface\n");
    std::printf("%8s %10s %14s %14s %14s %14s %12s\n", "spacing", "scheme", "gap 0.1 mm", "overlap 2 um", "overlap 10 um", "overlap 50 um", "surface [MB]");
    for (const double h : {2e-4, 1e-4, 5e-5}) {
        const auto grain = grid_ball(7.5e-3, h, 1000, 1.3e-3);
        for (const SphereScheme scheme : schemes) {
            std::printf("%8.0f %10s", 1e6 * h, name(scheme));
            for (const double overlap : {-1e-4, 2e-6, 1e-5, 5e-5}) {
                World world = cavity_world(grain, scheme);
                for (const Vec3& u : directions(150)) add_sphere(world, 1, 2e-3, (8.5e-3 - overlap) * u);
                world.step(1e-12);
                const std::clock_t start = std::clock();
                for (int n = 0; n < 2000; ++n) world.step(1e-12);
                std::printf(" %11.0f ns", 1e9 * double(std::clock() - start) / CLOCKS_PER_SEC / 2000 / 150);
            }
            std::printf(" %12.1f\n", scheme == SphereScheme::walls ? 1e-6 * double(dem::detail::Facets(grain->distance_grid()).memory()) : 0.0);
            std::fflush(stdout);
        }
    }
}

}  // namespace

int main()
{
    set_thread_count(1);
    throats();
    grooves();
    costs();
    bounces();
}
