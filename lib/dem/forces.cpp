// One computation of all forces: the contact loops, and the sums of what they leave, in order.
#include <chrono>

#include "core/parallel.h"
#include "dem/detail/impl.h"

namespace coral::dem {

namespace {

/// Sums of the bodies first..last; walls belong to the first range.
class RangeSums {
public:
    RangeSums(World::Impl& world, std::size_t first, std::size_t last) : w_(world), first_(first), last_(last)
    {
        for (std::size_t i = first; i < last; ++i) {
            w_.force[i].setZero();
            w_.torque[i].setZero();
        }
        if (walls_too())
            for (WallData& wall : w_.walls) wall.force.setZero();
    }

    /// A row: contacts of one sphere with others of higher numbers. Its own sum stays at hand meanwhile.
    const PointContact* add_row(const PointContact* c, const PointContact* end)
    {
        const std::size_t a = std::size_t(c->a);
        const bool own = ours(c->a);
        Vec3 push = w_.force[a], turn = w_.torque[a];
        for (; c < end && std::size_t(c->a) == a; ++c) {
            const bool other = ours(c->b);
            if (!own && !other) continue;
            const std::size_t b = std::size_t(c->b);
            const PointMemory& memory = w_.spheres.memory[std::size_t(c->entry)];
            const Vec3 &n = memory.normal, &total = memory.total;
            const Vec3 moment(n.y() * total.z() - n.z() * total.y(), n.z() * total.x() - n.x() * total.z(), n.x() * total.y() - n.y() * total.x());
            const double shift = 0.5 * memory.overlap;
            push += total;
            turn -= (w_.radius[a] - shift) * moment;
            if (!other) continue;
            w_.force[b] -= total;
            w_.torque[b] -= (w_.radius[b] - shift) * moment;
        }
        if (own) {
            w_.force[a] = push;
            w_.torque[a] = turn;
        }
        return c;
    }

    void add_at_wall(const PointContact& c)
    {
        const std::size_t a = std::size_t(c.a);
        const PointMemory& memory = w_.sphere_walls.memory[std::size_t(c.entry)];
        if (walls_too()) w_.walls[std::size_t(-1 - c.b)].force -= memory.total;
        if (!ours(c.a)) return;
        w_.force[a] += memory.total;
        w_.torque[a] -= (w_.radius[a] - memory.overlap) * memory.normal.cross(memory.total);
    }

    void add(const GeneralForce& c)
    {
        const Vec3 total = c.normal_force + c.tangential_force;
        if (ours(c.a)) {
            w_.force[std::size_t(c.a)] += total;
            w_.torque[std::size_t(c.a)] += c.torque_a;
        }
        if (c.b < 0) {
            if (walls_too()) w_.walls[std::size_t(-1 - c.b)].force -= total;
        } else if (ours(c.b)) {
            w_.force[std::size_t(c.b)] -= total;
            w_.torque[std::size_t(c.b)] += c.torque_b;
        }
    }

private:
    World::Impl& w_;
    std::size_t first_, last_;
    bool walls_too() const { return first_ == 0; }
    bool ours(Index i) const { return std::size_t(i) - first_ < last_ - first_; }
};

}  // namespace

void World::Impl::sum_forces(std::size_t first, std::size_t last)
{
    RangeSums range(*this, first, last);
    for (std::size_t block = 0; block < out_count[0].size(); ++block) {
        const PointContact* c = spheres.out_of(block);
        const PointContact* const end = c + out_count[0][block];
        if (c < end && std::size_t(c->a) >= last) break;  // from here on all numbers are higher
        while (c < end) c = range.add_row(c, end);
    }
    for (std::size_t block = 0; block < out_count[1].size(); ++block)
        for (std::int32_t k = 0; k < out_count[1][block]; ++k) range.add_at_wall(sphere_walls.out[block * entry_grain + std::size_t(k)]);
    for (std::size_t block = 0; block < out_count[2].size(); ++block)
        for (std::int32_t k = 0; k < out_count[2][block]; ++k) range.add(sphere_grids.out[block * grid_grain + std::size_t(k)]);
    for (std::size_t block = 0; block < out_count[3].size(); ++block)
        for (std::int32_t k = 0; k < out_count[3][block]; ++k) range.add(nodes.out[block * node_grain + std::size_t(k)]);
}

// Threads take ranges of bodies and read all contacts, so that every sum runs in the order of the contacts.
void World::Impl::sum_forces()
{
    const std::size_t parts = x.size() > body_grain ? std::size_t(thread_count()) : 1, share = (x.size() + parts - 1) / parts;
    parallel_blocks(x.size(), std::max(share, std::size_t{1}), [&](std::size_t first, std::size_t last) { sum_forces(first, last); });
}

void World::Impl::compute_contacts(double dt)
{
    const auto start = std::chrono::steady_clock::now();
    for (std::vector<Crossing>& list : crossings) list.clear();
    sphere_loop(dt);
    sphere_wall_loop(dt);
    sphere_grid_loop(dt);
    node_loop(dt);
    sum_forces();
    sums = {};
    for (const LoopSums& s : block_sums) sums.add(s);
    dissipated_friction += sums.friction;
    dissipated_damping += sums.damping;
    counters.contacts += sums.touching;
    counters.pair_tests += std::int64_t(spheres.other.size() + sphere_walls.body.size() + sphere_grids.sphere.size() + nodes.slave.size());
    counters.node_tests += sums.node_queries;
    counters.seconds_pairs += seconds_since(start);
}

void World::Impl::refresh_forces()
{
    if (!lists_valid) make_lists();
    if (forces_valid) return;
    const double before = sums.elastic_normal + sums.elastic_tangential;
    const double friction = dissipated_friction;
    // Whoever moved the bodies: everything listed is looked at.
    for (std::size_t i = 0; i < x.size(); ++i)
        if (in[i] && has_nodes[i]) note_way(i);
    for (std::size_t k = 0; k < walls.size(); ++k) note_wall_way(k);
    std::fill(moved2.begin(), moved2.end(), free_path * skin * free_path * skin);
    std::fill(grid_drift.begin(), grid_drift.end(), free_path * skin);
    w_before = w;
    v_end = v;
    compute_contacts(0.0);
    // What bodies put in, taken out or moved by the caller changed in the contacts is the caller's work.
    wall_work += sums.elastic_normal + sums.elastic_tangential - before + dissipated_friction - friction;
    forces_valid = true;
}

}  // namespace coral::dem
