#include "pack/criteria.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

namespace coral::pack {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

double between_sizes(const PsdPoint& a, const PsdPoint& b, double size)
{
    const double span = std::log(b.size / a.size);
    return span > 0 ? a.passing + (b.passing - a.passing) * std::log(size / a.size) / span : b.passing;
}

Criterion judged(const char* name, double value, double threshold, bool stable_above, const char* definition)
{
    Criterion c{name, value, threshold, "not applicable", definition};
    if (!std::isnan(value)) c.verdict = (stable_above ? value >= threshold : value <= threshold) ? "stable" : "unstable";
    return c;
}

}  // namespace

Psd gradation(std::span<const double> diameters, std::span<const double> masses)
{
    assert(diameters.size() == masses.size());
    std::vector<std::size_t> order(diameters.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return diameters[a] < diameters[b]; });
    const double total = std::accumulate(masses.begin(), masses.end(), 0.0);
    Psd psd;
    double sum = 0;
    for (const std::size_t i : order) {
        const double size = diameters[i];
        // equal diameters that went through a scale and back differ in the last bits
        if (psd.empty() || size > psd.back().size * (1 + 1e-9)) {
            psd.push_back({size, sum / total});
            psd.push_back({size, sum / total});
        }
        sum += masses[i];
        psd.back().passing = sum / total;
    }
    if (!psd.empty()) psd.back().passing = 1;
    return psd;
}

double passing_at(const Psd& psd, double size)
{
    if (size < psd.front().size) return 0;
    const auto above = std::upper_bound(psd.begin(), psd.end(), size, [](double s, const PsdPoint& p) { return s < p.size; });
    return above == psd.end() ? 1 : between_sizes(above[-1], *above, size);
}

double size_at(const Psd& psd, double passing)
{
    const auto at = std::lower_bound(psd.begin(), psd.end(), passing, [](const PsdPoint& p, double v) { return p.passing < v; });
    if (at == psd.end()) return psd.back().size;
    if (at == psd.begin() || at->passing == at[-1].passing) return at->size;
    const double share = (passing - at[-1].passing) / (at->passing - at[-1].passing);
    return at[-1].size * std::pow(at->size / at[-1].size, share);
}

Psd between(const Psd& psd, double lowest, double highest)
{
    Psd part;
    const double range = highest - lowest;
    // the part above `lowest` starts where the curve leaves that passing, not where it reaches it: the far side of a gap
    const auto leaves = std::upper_bound(psd.begin(), psd.end(), lowest, [](double v, const PsdPoint& p) { return v < p.passing; });
    if (leaves == psd.end() || range <= 0) return part;
    const bool inside = leaves != psd.begin() && leaves[-1].passing < lowest;
    part.push_back({inside ? size_at(psd, lowest) : (leaves == psd.begin() ? leaves->size : leaves[-1].size), 0});
    for (auto p = leaves; p != psd.end() && p->passing < highest; ++p) part.push_back({p->size, (p->passing - lowest) / range});
    part.push_back({size_at(psd, highest), 1});
    return part;
}

double uniformity(const Psd& psd) { return size_at(psd, 0.60) / size_at(psd, 0.10); }

double kezdi_ratio(const Psd& psd, double fines_content)
{
    return size_at(between(psd, fines_content, 1), 0.15) / size_at(between(psd, 0, fines_content), 0.85);
}

double kenney_lau_ratio(const Psd& psd, double highest_f)
{
    double least = std::numeric_limits<double>::infinity();
    const auto visit = [&](double d) {
        const double f = passing_at(psd, d);
        if (f > 0 && f <= highest_f * (1 + 1e-12)) least = std::min(least, (passing_at(psd, 4 * d) - f) / f);
    };
    for (const PsdPoint& p : psd) {
        visit(p.size);
        visit(p.size / 4);
        visit(p.size / 4 * (1 - 1e-12));  // just before 4 d reaches a step
        visit(p.size * (1 - 1e-12));
    }
    visit(size_at(psd, highest_f));
    return std::isinf(least) ? not_a_number : least;
}

double mao_number(double fines_content, double porosity) { return 4 * fines_content * (1 - porosity); }

double burenkova_distance(const Psd& psd)
{
    const double d90 = size_at(psd, 0.90), width = std::log10(d90 / size_at(psd, 0.15));
    constexpr double lower = 0.76, upper = 1.86;
    return width > 0 ? std::abs((d90 / size_at(psd, 0.60) - 1) / width - 0.5 * (lower + upper)) / (0.5 * (upper - lower)) : not_a_number;
}

double fines_stress_ratio(const Sample& sample)
{
    std::array<double, 2> stress{}, space{};  // of each role: sum of p V [J] and of V [m3]
    for (const Particle& p : sample.particles) space[std::size_t(p.role)] += apparent_volume(sample, p);
    const auto press = [&](std::int32_t body, const Eigen::Vector3d& force, const Eigen::Vector3d& point) {
        const Particle& p = sample.particles[std::size_t(body)];
        stress[std::size_t(p.role)] -= force.dot(nearest_image(sample, point - p.position)) / 3;
    };
    for (const Contact& c : sample.contacts) {
        const Eigen::Vector3d force = c.normal_force + c.tangential_force;
        press(c.first, force, c.point);
        if (c.second >= 0) press(c.second, -force, c.point);
    }
    const auto fine = std::size_t(Role::fine), coarse = std::size_t(Role::coarse);
    if (!(space[fine] > 0 && space[coarse] > 0 && stress[fine] + stress[coarse] > 0)) return not_a_number;
    return (stress[fine] / space[fine]) * ((space[fine] + space[coarse]) / (stress[fine] + stress[coarse]));
}

double relative_density(double void_ratio, double e_min, double e_max) { return (e_max - void_ratio) / (e_max - e_min); }

std::vector<Criterion> stability_criteria(const Psd& psd, double fines_content, double porosity, double stress_ratio)
{
    const bool two_fractions = fines_content > 0 && fines_content < 1;
    double highest_f = uniformity(two_fractions ? between(psd, fines_content, 1) : psd) <= 3 ? 0.3 : 0.2;
    if (std::abs(fines_content - highest_f) < 0.02) highest_f = std::max(highest_f, fines_content);
    const double kenney_lau = kenney_lau_ratio(psd, highest_f);
    return {
        judged("kezdi", two_fractions ? kezdi_ratio(psd, fines_content) : not_a_number, 4, false,
               "D15 of the coarse over d85 of the fine fraction, stable if <= 4 [Kezdi 1979]"),
        judged("kenney-lau", kenney_lau, 1, true,
               "min H/F, H = passing(4d) - F, F = passing(d) <= 0.3 (0.2 for a wide coarse fraction), stable if >= 1 [Kenney and Lau 1986]"),
        judged("kenney-lau-1985", kenney_lau, 1.3, true, "the same ratio, stable if >= 1.3 [Kenney and Lau 1985]"),
        judged("mao", two_fractions ? mao_number(fines_content, porosity) : not_a_number, 1, true,
               "4 Fc (1 - n), n with intraparticle voids, stable if >= 1 [Mao 2005]"),
        judged("istomina", uniformity(psd), 10, false, "D60/D10, stable if <= 10, unstable for certain above 20 [Istomina 1957]"),
        judged("burenkova", burenkova_distance(psd), 1, false,
               "|k - 1.31|/0.55, k = (d90/d60 - 1)/lg(d90/d15), stable if < 1, that is 0.76 < k < 1.86 [Burenkova 1993]"),
        judged("skempton-brogan", stress_ratio, 0.5, true,
               "alpha, mean stress of the fines over that of all grains, stable if >= 0.5 (a limit of ours) [Skempton and Brogan 1994, Shire et al. 2014]"),
    };
}

}  // namespace coral::pack
