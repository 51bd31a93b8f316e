#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pack/criteria.h"
#include "pack/detail/phases.h"

namespace coral::pack::detail {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// Volumes, fines and gap ratio.
void measure_volumes(const Sample& sample, Statistics& s)
{
    const double box = enclosed_volume(sample);
    double solid = 0, apparent = 0, total = 0, fines = 0, smallest_coarse = 1e300, largest_fine = 0;
    for (const Particle& p : sample.particles) {
        solid += volume(sample, p);
        apparent += apparent_volume(sample, p);
        total += mass(sample, p);
        const double d = equivalent_diameter(sample, p);
        if (p.role == Role::fine) {
            fines += mass(sample, p);
            largest_fine = std::max(largest_fine, d);
        } else {
            smallest_coarse = std::min(smallest_coarse, d);
        }
    }
    s.porosity = 1 - solid / box;
    s.interparticle_porosity = 1 - apparent / box;
    s.void_ratio = s.porosity / (1 - s.porosity);
    s.interparticle_void_ratio = s.interparticle_porosity / (1 - s.interparticle_porosity);
    s.fines_content = fines / total;
    s.gap_ratio = largest_fine > 0 && smallest_coarse < 1e300 ? smallest_coarse / largest_fine : not_a_number;
}

/// Contacts per grain by role; overlaps.
void measure_contacts(const Sample& sample, Statistics& s)
{
    const std::size_t n = sample.particles.size();
    std::vector<int> touching(n, 0);
    std::array<std::array<double, 2>, 2> neighbours{};  // [of role][with role]
    double grains = 0;
    for (const Contact& c : sample.contacts) {
        const Particle& a = sample.particles[std::size_t(c.first)];
        ++touching[std::size_t(c.first)];
        double& deepest = c.second >= 0 ? s.max_overlap : s.max_wall_overlap;
        double d = equivalent_diameter(sample, a);
        if (c.second >= 0) {
            const Particle& b = sample.particles[std::size_t(c.second)];
            ++touching[std::size_t(c.second)];
            d = std::min(d, equivalent_diameter(sample, b));
            neighbours[std::size_t(a.role)][std::size_t(b.role)] += 1;
            neighbours[std::size_t(b.role)][std::size_t(a.role)] += 1;
            grains += 2;
        }
        deepest = std::max(deepest, c.overlap / d);
    }
    std::array<double, 2> count{};
    for (const Particle& p : sample.particles) count[std::size_t(p.role)] += 1;
    const auto mean = [&](Role of, Role with) {
        return count[std::size_t(of)] > 0 && count[std::size_t(with)] > 0 ? neighbours[std::size_t(of)][std::size_t(with)] / count[std::size_t(of)] : not_a_number;
    };
    s.coordination = n > 0 ? grains / double(n) : 0;
    s.coordination_coarse_coarse = mean(Role::coarse, Role::coarse);
    s.coordination_coarse_fine = mean(Role::coarse, Role::fine);
    s.coordination_fine_coarse = mean(Role::fine, Role::coarse);
    s.coordination_fine_fine = mean(Role::fine, Role::fine);
    s.rattler_fraction = n > 0 ? double(std::count_if(touching.begin(), touching.end(), [](int t) { return t < 2; })) / double(n) : 0;
}

/// Takes a position to the image between 0 and the period; returns the way.
Eigen::Vector3d into_the_box(const Sample& sample, Eigen::Vector3d& position)
{
    const Eigen::Vector3d before = position;
    for (int axis = 0; axis < 3; ++axis) {
        const double length = sample.period[axis];
        if (length <= 0) continue;
        position[axis] -= length * std::floor(position[axis] / length);
        if (position[axis] >= length) position[axis] = 0;  // rounded up from just below zero
    }
    return position - before;
}

}  // namespace

void measure(const dem::World& world, const Box& box, const MotionWindow::Means& rest, double dem_step, std::int64_t steps, Sample& sample)
{
    const Eigen::Vector3d lower = box.lower(world);
    sample.size = box.upper(world) - lower;
    std::vector<Eigen::Vector3d> shift;
    for (std::size_t i = 0; i < sample.particles.size(); ++i) {
        Particle& p = sample.particles[i];
        p.position = world.position(int(i)) - lower;
        shift.push_back(into_the_box(sample, p.position));
        p.orientation = world.orientation(int(i));
        p.velocity = world.velocity(int(i));
        p.angular_velocity = world.angular_velocity(int(i));
    }
    double sides = 0;
    for (std::size_t i = 0, w = 0; w < sample.walls.size(); ++w) {
        Wall& wall = sample.walls[w];
        if (wall.radius > 0) {
            wall.pressure = box.side_pressure(world);
        } else {
            while (box.plane[i] < 0) ++i;  // both are in the order x-, x+, ..., z+
            wall.point = world.wall_point(box.plane[i]) - lower;
            wall.pressure = box.pressure(world, int(i++));
        }
        sides += wall.radius > 0 ? 4 : 1;
    }
    sample.contacts = world.contacts();
    for (Contact& c : sample.contacts) c.point += shift[std::size_t(c.first)] - lower;
    sample.springs = world.contact_springs();

    Statistics& s = sample.statistics;
    s = {};
    measure_volumes(sample, s);
    measure_contacts(sample, s);
    s.kinetic_energy = world.statistics().kinetic_energy;
    s.kinetic_ratio = rest.kinetic_ratio;
    s.unbalanced_ratio = rest.unbalanced_ratio;
    for (const Wall& w : sample.walls) s.mean_pressure += (w.radius > 0 ? 4 : 1) * w.pressure / sides;
    s.dem_step = dem_step;
    s.dem_steps = double(steps);

    std::vector<double> diameters, masses;
    for (const Particle& p : sample.particles) {
        diameters.push_back(equivalent_diameter(sample, p));
        masses.push_back(mass(sample, p));
    }
    sample.psd = gradation(diameters, masses);
    sample.criteria = stability_criteria(sample.psd, s.fines_content, s.porosity, fines_stress_ratio(sample));
}

}  // namespace coral::pack::detail
