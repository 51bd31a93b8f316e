#include "pack/swap.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <type_traits>

#include "core/error.h"
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
std::vector<char> covered_fines(Sample& sample, const Sample& before, bool move)
{
    std::vector<char> covered(sample.particles.size(), 0);
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
            covered[i] = 1;
            for (int k = 0; move && k < 50; ++k) {
                Vec3 gradient;
                const double missing = radius / host.scale - shape.distance_and_gradient(local, gradient);
                if (missing < 1e-3 * radius / host.scale || gradient.norm() == 0) break;
                local += std::min(missing, radius / host.scale) * gradient.normalized();
            }
            if (move) fine.position = host.position + host.orientation * (host.scale * local);
        }
    }
    return covered;
}

/// Takes fines out of the new sample, of the old one and of the list of their numbers.
void take_out(const std::vector<char>& out, detail::Replaced& swapped, Sample& rest, std::vector<int>& number)
{
    remove(rest, out);
    const std::vector<int> index = remove(swapped.sample, out);
    std::erase_if(swapped.drawn, [&](std::size_t i) { return index[i] < 0; });
    for (std::size_t& i : swapped.drawn) i = std::size_t(index[i]);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < index.size(); ++i)
        if (index[i] >= 0) number[kept++] = number[i];
    number.resize(kept);
}

double total_mass(const Sample& sample)
{
    double sum = 0;
    for (const Particle& p : sample.particles) sum += mass(sample, p);
    return sum;
}

std::vector<char> relax(detail::Replaced& swapped, const Sample& rest, const std::vector<char>& moved_out, const SwapOptions& options, SwapReport& report)
{
    report.mass_before = total_mass(rest);
    report.mass_after = total_mass(swapped.sample);
    return detail::relax_swapped(swapped, rest, moved_out, options, report);
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
    std::vector<char> out = covered_fines(swapped.sample, sample, !options.drop_trapped);
    for (std::size_t i = 0; i < out.size(); ++i)
        if (out[i]) report.trapped.push_back(int(i));
    if (!options.drop_trapped) {
        relax(swapped, sample, out, options, report);
        const std::vector<char> covered = covered_fines(swapped.sample, sample, false);
        if (const auto at = std::find(covered.begin(), covered.end(), 1); at != covered.end())
            throw Error("swap", "grain " + std::to_string(at - covered.begin()) + " was pushed into a coarse grain by the relaxation", "add --drop-trapped, or take shapes nearer to the old ones");
        return std::move(swapped.sample);
    }
    // Fines at the mouth of a void may be pushed into the new shape while the sample relaxes, and others find no place between new shapes: they go
    // too, and it relaxes again without them.
    Sample rest = sample;
    std::vector<int> number(sample.particles.size());  // in the sample, of the grains that stay
    std::iota(number.begin(), number.end(), 0);
    for (;;) {
        take_out(out, swapped, rest, number);
        detail::Replaced relaxed = swapped;
        SwapReport of_this = report;
        const std::vector<char> wedged = relax(relaxed, rest, std::vector<char>(rest.particles.size(), 0), options, of_this);
        out = covered_fines(relaxed.sample, rest, false);
        bool again = false;
        for (std::size_t i = 0; i < out.size(); ++i) {
            if (out[i]) report.trapped.push_back(number[i]);
            else if (wedged[i]) report.wedged.push_back(number[i]);
            out[i] = out[i] || wedged[i];
            again |= out[i];
        }
        if (again) continue;
        report = std::move(of_this);
        std::sort(report.trapped.begin(), report.trapped.end());
        std::sort(report.wedged.begin(), report.wedged.end());
        return std::move(relaxed.sample);
    }
}

}  // namespace coral::pack
