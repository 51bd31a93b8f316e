#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"
#include "dem/detail/impl.h"

namespace coral::dem {

namespace {

/// Bodies of one size class in cells at least as wide as the largest reach between two of them.
struct Level {
    double largest = 0.0, edge = 0.0;
    Vec3 lower = Vec3::Zero();
    std::array<Index, 3> cells{1, 1, 1};
    bool wrap[3] = {false, false, false};
    std::vector<Index> start, members;  ///< members of cell c are members[start[c]..start[c+1]), ascending

    std::array<Index, 3> cell_of(const Vec3& p) const
    {
        std::array<Index, 3> c;
        for (int k = 0; k < 3; ++k) {
            const double u = std::floor((p[k] - lower[k]) / edge_of[k]);
            c[std::size_t(k)] = Index(std::clamp(u, -2.0, double(cells[std::size_t(k)]) + 1.0));
        }
        return c;
    }
    Vec3 edge_of = Vec3::Ones();
};

/// Position taken into the periodic box [0, length).
Vec3 wrapped(const detail::Periodic& periodic, Vec3 p)
{
    if (periodic.any)
        for (int k = 0; k < 3; ++k)
            if (periodic.length[k] > 0.0) p[k] -= periodic.length[k] * std::floor(p[k] * periodic.inverse[k]);
    return p;
}

void fill(Level& level, const std::vector<Vec3>& p, const std::vector<Index>& bodies, const detail::Periodic& periodic, double skin)
{
    const double width = 2.0 * level.largest + skin;
    Vec3 low = p[std::size_t(bodies[0])], high = low;
    for (const Index i : bodies) {
        low = low.cwiseMin(p[std::size_t(i)]);
        high = high.cwiseMax(p[std::size_t(i)]);
    }
    // No more than about four cells a body, however thin the bodies are spread.
    const double most = std::cbrt(4.0 * double(bodies.size())) + 1.0;
    for (int k = 0; k < 3; ++k) {
        const std::size_t a = std::size_t(k);
        if (periodic.length[k] > 0.0) {
            low[k] = 0.0;
            const double n = std::floor(periodic.length[k] / width);
            level.wrap[k] = true;
            level.cells[a] = n < 3.0 ? 1 : Index(std::min(n, 4.0 * most));
            level.edge_of[k] = periodic.length[k] / level.cells[a];
        } else {
            const double n = std::floor((high[k] - low[k]) / width) + 1.0;
            level.cells[a] = Index(std::min(n, 4.0 * most));
            level.edge_of[k] = std::max(width, (high[k] - low[k]) / level.cells[a] * (1.0 + 1e-12));
        }
    }
    level.lower = low;
    const auto cell = [&](Index i) {
        std::array<Index, 3> c = level.cell_of(p[std::size_t(i)]);
        for (std::size_t k = 0; k < 3; ++k) c[k] = std::clamp(c[k], Index{0}, level.cells[k] - 1);
        return std::size_t(c[0]) + std::size_t(level.cells[0]) * (std::size_t(c[1]) + std::size_t(level.cells[1]) * std::size_t(c[2]));
    };
    level.start.assign(std::size_t(level.cells[0]) * std::size_t(level.cells[1]) * std::size_t(level.cells[2]) + 1, 0);
    for (const Index i : bodies) ++level.start[cell(i) + 1];
    for (std::size_t c = 1; c < level.start.size(); ++c) level.start[c] += level.start[c - 1];
    std::vector<Index> next(level.start.begin(), level.start.end() - 1);
    level.members.resize(bodies.size());
    for (const Index i : bodies) level.members[std::size_t(next[cell(i)]++)] = i;
}

/// Cells around c along one axis, each once.
int neighbours(const Level& level, int axis, Index c, std::array<Index, 3>& found)
{
    const Index n = level.cells[std::size_t(axis)];
    int count = 0;
    if (level.wrap[axis]) {
        if (n == 1) {
            found[0] = 0;
            return 1;
        }
        for (Index d = -1; d <= 1; ++d) found[std::size_t(count++)] = (c + d + n) % n;
        return count;
    }
    for (Index d = -1; d <= 1; ++d)
        if (c + d >= 0 && c + d < n) found[std::size_t(count++)] = c + d;
    return count;
}

/// Pairs of body i with bodies of its size class and larger ones; within a class from the lower id.
void find_pairs(const World::Impl& world, const std::vector<Level>& levels, std::size_t own, std::size_t i, const Vec3& p, double skin,
                std::vector<BroadPair>& pairs)
{
    for (std::size_t l = own; l < levels.size(); ++l) {
        const Level& level = levels[l];
        if (level.members.empty()) continue;
        const std::array<Index, 3> c = level.cell_of(p);
        std::array<Index, 3> near[3];
        int near_count[3];
        for (int k = 0; k < 3; ++k) near_count[k] = neighbours(level, k, c[std::size_t(k)], near[k]);
        for (int iz = 0; iz < near_count[2]; ++iz)
            for (int iy = 0; iy < near_count[1]; ++iy)
                for (int ix = 0; ix < near_count[0]; ++ix) {
                    const std::size_t cell = std::size_t(near[0][std::size_t(ix)]) +
                                             std::size_t(level.cells[0]) * (std::size_t(near[1][std::size_t(iy)]) +
                                                                            std::size_t(level.cells[1]) * std::size_t(near[2][std::size_t(iz)]));
                    for (Index m = level.start[cell]; m < level.start[cell + 1]; ++m) {
                        const Index j = level.members[std::size_t(m)];
                        if (l == own && j <= Index(i)) continue;
                        const double reach = world.radius[i] + world.radius[std::size_t(j)] + skin;
                        if (world.periodic(world.x[i] - world.x[std::size_t(j)]).squaredNorm() >= reach * reach) continue;
                        if (world.motion[i] != Motion::free && world.motion[std::size_t(j)] != Motion::free) continue;
                        pairs.push_back({std::min(Index(i), j), std::max(Index(i), j)});
                    }
                }
    }
}

}  // namespace

std::vector<BroadPair> broad_phase(const World::Impl& world, double skin)
{
    const std::size_t n = world.x.size();
    std::vector<Vec3> p(n);
    double smallest = 0.0, largest = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        if (!world.in[i]) continue;
        p[i] = wrapped(world.periodic, world.x[i]);
        smallest = smallest == 0.0 ? world.radius[i] : std::min(smallest, world.radius[i]);
        largest = std::max(largest, world.radius[i]);
    }
    if (smallest == 0.0) return {};
    const int level_count = std::min(1 + int(std::log2(largest / smallest)), 16);
    std::vector<std::vector<Index>> bodies(static_cast<std::size_t>(level_count));
    std::vector<int> level_of(n, 0);
    for (std::size_t i = 0; i < n; ++i) {
        if (!world.in[i]) continue;
        level_of[i] = std::min(int(std::log2(world.radius[i] / smallest)), level_count - 1);
        bodies[std::size_t(level_of[i])].push_back(Index(i));
    }
    std::vector<Level> levels(std::size_t(level_count), Level{});
    for (std::size_t l = 0; l < levels.size(); ++l) {
        for (const Index i : bodies[l]) levels[l].largest = std::max(levels[l].largest, world.radius[std::size_t(i)]);
        if (!bodies[l].empty()) fill(levels[l], p, bodies[l], world.periodic, skin);
    }

    // Every pair is found from its smaller class. Blocks are the same for any number of threads, and so is the order of what they find.
    constexpr std::size_t grain = 256;
    std::vector<std::vector<BroadPair>> found((n + grain - 1) / grain);
    parallel_blocks(n, grain, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
            if (world.in[i]) find_pairs(world, levels, std::size_t(level_of[i]), i, p[i], skin, found[first / grain]);
    });
    std::vector<Index> count(n + 1, 0);
    for (const std::vector<BroadPair>& part : found)
        for (const BroadPair& pair : part) ++count[std::size_t(pair.a) + 1];
    for (std::size_t i = 1; i <= n; ++i) count[i] += count[i - 1];
    std::vector<BroadPair> ordered(static_cast<std::size_t>(count[n]));
    std::vector<Index> next(count.begin(), count.end() - 1);
    for (const std::vector<BroadPair>& part : found)
        for (const BroadPair& pair : part) ordered[std::size_t(next[std::size_t(pair.a)]++)] = pair;
    for (std::size_t i = 0; i < n; ++i)
        std::sort(ordered.begin() + count[i], ordered.begin() + count[i + 1], [](const BroadPair& s, const BroadPair& t) { return s.b < t.b; });
    return ordered;
}

}  // namespace coral::dem
