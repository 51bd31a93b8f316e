#include "pack/swap.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <type_traits>

#include "core/stopwatch.h"
#include "pack/detail/swap.h"
#include "pack/sample_world.h"

namespace coral::pack {
namespace {

using Vec3 = Eigen::Vector3d;

/// Takes grains out, with their contacts and springs. Returns the new number of each grain, -1 for those that went.
std::vector<int> remove(Sample& sample, const std::vector<char>& out)
{
    std::vector<int> index;
    std::vector<Particle> stay;
    for (std::size_t i = 0; i < sample.particles.size(); ++i) {
        index.push_back(out[i] ? -1 : int(stay.size()));
        if (!out[i]) stay.push_back(sample.particles[i]);
    }
    sample.particles = std::move(stay);
    const auto renumber = [&](auto& pairs) {
        std::remove_reference_t<decltype(pairs)> kept;
        for (auto pair : pairs) {
            pair.first = index[std::size_t(pair.first)];
            if (pair.second >= 0 && (pair.second = index[std::size_t(pair.second)]) < 0) continue;
            if (pair.first >= 0) kept.push_back(pair);
        }
        pairs = std::move(kept);
    };
    renumber(sample.springs);
    renumber(sample.contacts);
    return index;
}

/// Fines whose centre a coarse grain with a new shape covers; where they find a place, they are moved to its surface.
std::vector<char> trapped_fines(Sample& sample, const Sample& before, bool move)
{
    std::vector<char> trapped(sample.particles.size(), 0);
    std::vector<std::size_t> hosts;
    std::map<std::pair<int, int>, bool> same;  // of templates, new and old: lattices are large, grains many
    std::map<int, std::shared_ptr<const dem::Shape>> shapes;
    for (std::size_t c = 0; c < sample.particles.size(); ++c) {
        const int now = sample.particles[c].shape, then = before.particles[c].shape;
        if (sample.particles[c].role != Role::coarse) continue;
        const auto [at, added] = same.try_emplace({now, then}, false);
        if (added) at->second = detail::same_template(sample.shapes[std::size_t(now)], before.shapes[std::size_t(then)]);
        if (at->second) continue;
        hosts.push_back(c);
        if (!shapes.contains(now)) shapes[now] = make_shape(sample.shapes[std::size_t(now)]);
    }
    for (std::size_t i = 0; i < sample.particles.size(); ++i) {
        Particle& fine = sample.particles[i];
        if (fine.role != Role::fine) continue;
        const double radius = 0.5 * equivalent_diameter(sample, fine);
        for (const std::size_t c : hosts) {
            const Particle& host = sample.particles[c];
            const dem::Shape& shape = *shapes[host.shape];
            Vec3 local = host.orientation.conjugate() * nearest_image(sample, fine.position - host.position) / host.scale;
            if (local.norm() > shape.bounding_radius() || shape.distance(local) >= 0) continue;
            trapped[i] = 1;
            for (int k = 0; move && k < 50; ++k) {
                Vec3 gradient;
                const double missing = radius / host.scale - shape.distance_and_gradient(local, gradient);
                if (missing < 1e-3 * radius / host.scale || gradient.norm() == 0) break;
                local += std::min(missing, radius / host.scale) * gradient.normalized();
            }
            if (move) fine.position = host.position + host.orientation * (host.scale * local);
        }
    }
    return trapped;
}

double total_mass(const Sample& sample)
{
    double sum = 0;
    for (const Particle& p : sample.particles) sum += mass(sample, p);
    return sum;
}

}  // namespace

Sample replace_shapes(const Sample& sample, const SwapOptions& options, std::uint64_t seed, SwapReport& report)
{
    return detail::replace(sample, options, seed, report).sample;
}

Sample swap_shapes(const Sample& sample, const SwapOptions& options, std::uint64_t seed, SwapReport& report)
{
    report = {};
    detail::Replaced swapped = [&] {
        const Stopwatch clock(report.shapes_seconds);
        return detail::replace(sample, options, seed, report);
    }();
    const Stopwatch clock(report.relaxation_seconds);
    std::vector<char> trapped = trapped_fines(swapped.sample, sample, !options.drop_trapped);
    for (std::size_t i = 0; i < trapped.size(); ++i)
        if (trapped[i]) report.trapped.push_back(int(i));
    Sample rest = sample;
    if (options.drop_trapped && !report.trapped.empty()) {
        remove(rest, trapped);
        const std::vector<int> index = remove(swapped.sample, trapped);
        std::vector<std::size_t> drawn;
        for (const std::size_t i : swapped.drawn)
            if (index[i] >= 0) drawn.push_back(std::size_t(index[i]));
        swapped.drawn = std::move(drawn);
        trapped.assign(swapped.sample.particles.size(), 0);
    }
    report.mass_before = total_mass(rest);
    report.mass_after = total_mass(swapped.sample);
    detail::relax_swapped(swapped, rest, trapped, options, report);
    return std::move(swapped.sample);
}

}  // namespace coral::pack
