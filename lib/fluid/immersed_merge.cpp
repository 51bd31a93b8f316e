// Which faces bodies have to themselves, and which they share.
#include <algorithm>

#include "core/parallel.h"
#include "fluid/detail/immersed_body.h"

namespace coral::fluid {

using detail::CutFace;
using detail::OwnFaces;
using detail::SolidRun;
using detail::SolidSet;

namespace {

/// Adds sign times the fractions of a set. Fractions are single precision and at least 1e-6, so multiples of 2^-43: their
/// sums and differences are exact, and do not depend on the order in which bodies came and went.
void add_fractions(Field& sum, const SolidSet& set, double sign)
{
    for (const SolidRun& run : set.runs)
        for (int l = 0; l < run.length; ++l) sum[run.at + std::uint32_t(l)] += sign;
    for (const CutFace& cut : set.cuts) sum[cut.at] += sign * double(cut.fraction);
}

void clip_fractions(Field& clipped, const Field& sum, const SolidSet& set)
{
    for (const SolidRun& run : set.runs)
        for (std::uint32_t at = run.at; at < run.at + std::uint32_t(run.length); ++at)
            clipped[at] = std::min(sum[at], 1.0);
    for (const CutFace& cut : set.cuts) clipped[cut.at] = std::min(sum[cut.at], 1.0);
}

/// Whether the boxes of two sets may have a face in common, in any periodic image.
bool may_meet(const GridSpec& grid, const SolidSet& a, const SolidSet& b)
{
    for (int d = 0; d < 3; ++d) {
        const int n = grid.cells[d], up = b.low[d] - a.low[d];
        const int after = grid.periodic(d) ? ((up % n) + n) % n : up, before = grid.periodic(d) ? n - after : -up;
        if (after < 0 || after >= a.high[d] - a.low[d])
            if (before < 0 || before >= b.high[d] - b.low[d]) return false;
    }
    return true;
}

}  // namespace

/// Parts the faces of a body: where the sum of all fractions is its own, it is alone.
void ImmersedBodies::find_own(Body& body, int component)
{
    const Field& sum = solid_sum_[std::size_t(component)];
    OwnFaces& own = body.own[std::size_t(component)];
    std::vector<Claim>& contested = body.contested[std::size_t(component)];
    own.clear();
    contested.clear();
    for (const CutFace& cut : body.solid[std::size_t(component)].cuts) {
        if (sum[cut.at] != double(cut.fraction)) {
            contested.push_back({cut.at, 0, cut.i, cut.j, cut.k, cut.fraction, 0.0});
            continue;
        }
        const std::int16_t place[3] = {cut.i, cut.j, cut.k};
        own.at.push_back(cut.at);
        own.place[0].push_back(place[(component + 1) % 3]);
        own.place[1].push_back(place[(component + 2) % 3]);
        own.fraction.push_back(cut.fraction);
    }
    own.weight.assign(own.at.size(), 0.0F);
    for (const SolidRun& run : body.solid[std::size_t(component)].runs) {
        bool open = false;  // whether the last own run goes on
        for (int l = 0; l < run.length; ++l) {
            const std::uint32_t at = run.at + std::uint32_t(l);
            const auto i = std::int16_t(run.i + l);
            if (sum[at] != 1.0) {
                contested.push_back({at, 0, i, run.j, run.k, 1.0F, 0.0});
                open = false;
            } else if (open) {
                ++own.runs.back().length;
            } else {
                own.runs.push_back({at, i, run.j, run.k, 1});
                open = true;
            }
        }
    }
}

/// Brings the claims of some bodies up to date, and with them the faces of a component on which several meet.
void ImmersedBodies::find_shared(int component, std::span<const std::size_t> bodies)
{
    std::vector<Claim>& claims = claims_[std::size_t(component)];
    std::vector<char> anew(bodies_.size(), 0);
    for (const std::size_t b : bodies) anew[b] = 1;
    std::erase_if(claims, [&](const Claim& claim) { return anew[claim.body] != 0; });
    const auto kept = std::ptrdiff_t(claims.size());
    for (const std::size_t b : bodies)
        for (Claim claim : bodies_[b]->contested[std::size_t(component)]) {
            claim.body = std::uint32_t(b);
            claims.push_back(claim);
        }
    const auto before = [](const Claim& a, const Claim& b) { return std::pair(a.at, a.body) < std::pair(b.at, b.body); };
    std::sort(claims.begin() + kept, claims.end(), before);
    std::inplace_merge(claims.begin(), claims.begin() + kept, claims.end(), before);
    std::vector<Shared>& shared = shared_[std::size_t(component)];
    shared.clear();
    for (std::size_t first = 0, last = 0; first < claims.size(); first = last) {
        double total = 0.0;
        for (last = first; last < claims.size() && claims[last].at == claims[first].at; ++last)
            total += double(claims[last].fraction);
        for (std::size_t c = first; c < last; ++c) claims[c].part = double(claims[c].fraction) / total;
        shared.push_back({claims[first].at, std::uint32_t(first), std::uint32_t(last), std::min(1.0, total), 0.0});
    }
}

/// Puts what bodies cover now in the place of what they covered before. Only bodies that may have met one of them before,
/// or may do so now, are looked at.
void ImmersedBodies::merge(std::vector<Change>& changes)
{
    std::array<std::vector<std::size_t>, 3> touched;
    parallel_blocks(4, 1, [&](std::size_t component, std::size_t) {
        Field& sum = solid_sum_[component];
        for (Change& change : changes) {  // the old set goes to where the new one was
            SolidSet& now = bodies_[change.body]->solid[component];
            add_fractions(sum, now, -1.0);
            std::swap(now, change.solid[component]);
            add_fractions(sum, now, 1.0);
        }
        if (component == detail::cells_component) {
            for (const Change& change : changes) {
                clip_fractions(cell_solid_, sum, change.solid[component]);
                clip_fractions(cell_solid_, sum, bodies_[change.body]->solid[component]);
            }
            return;
        }
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            const SolidSet& set = bodies_[b]->solid[component];
            const bool meets = std::any_of(changes.begin(), changes.end(), [&](const Change& change) {
                return change.body == b || may_meet(grid_, set, change.solid[component]) ||
                       may_meet(grid_, set, bodies_[change.body]->solid[component]);
            });
            if (meets) touched[component].push_back(b);
        }
        for (const std::size_t b : touched[component]) find_own(*bodies_[b], int(component));
        find_shared(int(component), touched[component]);
    });
    std::vector<char> anew(bodies_.size(), 0);
    for (const auto& bodies : touched)
        for (const std::size_t b : bodies) anew[b] = 1;
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        if (anew[b] != 0) weigh(*bodies_[b]);
    ++version_;
}

}  // namespace coral::fluid
