// What a world reports: contacts, energies, statistics, friction springs; and its complete state as bytes.
#include <algorithm>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "dem/detail/impl.h"

namespace coral::dem {

namespace {

const PointMemory& memory_of(const World::Impl& m, const PointContact& c)
{
    return (c.b < 0 ? m.sphere_walls.memory : m.spheres.memory)[std::size_t(c.entry)];
}

Contact report(const World::Impl& m, const PointContact& c)
{
    const PointMemory& memory = memory_of(m, c);
    const double arm = m.radius[std::size_t(c.a)] - (c.b < 0 ? 1.0 : 0.5) * memory.overlap;
    const Vec3 push = memory.total.dot(memory.normal) * memory.normal;
    return {c.a, c.b, m.x[std::size_t(c.a)] - arm * memory.normal, memory.normal, push, memory.total - push, memory.overlap, 1};
}

Contact report(const World::Impl& m, const GeneralForce& c)
{
    const double size = c.normal_force.norm();
    const Vec3 normal = size > 0.0 ? Vec3(c.normal_force / size) : (c.arm.norm() > 0.0 ? Vec3(-c.arm.normalized()) : Vec3::UnitZ());
    return {c.a, c.b, m.x[std::size_t(c.a)] + c.arm, normal, c.normal_force, c.tangential_force, c.overlap, c.points};
}

bool in_order(int first_a, int second_a, int first_b, int second_b) { return first_a != first_b ? first_a < first_b : second_a < second_b; }

template <class Visit>
void for_each_contact(const World::Impl& m, const Visit& visit)
{
    for (std::size_t block = 0; block < m.out_count[0].size(); ++block)
        for (std::int32_t k = 0; k < m.out_count[0][block]; ++k) visit(m.spheres.out_of(block)[k]);
    for (std::size_t block = 0; block < m.out_count[1].size(); ++block)
        for (std::int32_t k = 0; k < m.out_count[1][block]; ++k) visit(m.sphere_walls.out[block * entry_grain + std::size_t(k)]);
    for (std::size_t block = 0; block < m.out_count[2].size(); ++block)
        for (std::int32_t k = 0; k < m.out_count[2][block]; ++k) visit(m.sphere_grids.out[block * grid_grain + std::size_t(k)]);
    for (std::size_t block = 0; block < m.out_count[3].size(); ++block)
        for (std::int32_t k = 0; k < m.out_count[3][block]; ++k) visit(m.nodes.out[block * node_grain + std::size_t(k)]);
}

}  // namespace

std::vector<Contact> World::contacts() const
{
    impl_->refresh_forces();
    std::vector<Contact> list;
    for_each_contact(*impl_, [&](const auto& c) { list.push_back(report(*impl_, c)); });
    std::stable_sort(list.begin(), list.end(), [](const Contact& a, const Contact& b) { return in_order(a.first, a.second, b.first, b.second); });
    return list;
}

// What the motion is owed in the middle of contacts: errors of work that wait for correction, and what velocity Verlet has in advance,
//     K_{n+1} - K_n = 1/2 (F_n + F_{n+1}) . (x_{n+1} - x_n) + [dt^2/8 (F . F/m + T . I^-1 T)] between n and n+1.
double World::Impl::on_account() const
{
    double owed = 0.0, advance = 0.0;
    for (const double pair : nodes.owed) owed += pair;
    for (const PressMemory& pair : sphere_grids.press) owed += pair.owed;
    for (std::size_t i = 0; i < x.size(); ++i) {
        if (!free(i)) continue;
        const Vec3 f = force[i] + external_force[i] + mass[i] * options.gravity, t = torque[i] + external_torque[i];
        const Vec3 inertia = i < added_mass.size() ? Vec3(added_mass[i].array() + mass[i]) : Vec3::Constant(mass[i]);
        advance += f.dot(f.cwiseQuotient(inertia)) + t.dot(apply_inverse_inertia(i, t));
    }
    return owed - 0.125 * last_dt * last_dt * advance;
}

Energy World::energy() const
{
    Impl& m = *impl_;
    m.refresh_forces();
    Energy e;
    e.kinetic = m.kinetic_energy();
    e.elastic_normal = m.sums.elastic_normal;
    e.elastic_tangential = m.sums.elastic_tangential;
    if (!m.ledger_started) {
        e.initial = e.stored();
        return e;
    }
    e.initial = m.initial;
    e.gravity_work = m.gravity_work;
    e.external_work = m.external_work;
    e.wall_work = m.wall_work;
    e.friction = m.dissipated_friction;
    e.damping = m.dissipated_damping;
    e.closure = e.stored() + m.on_account() - m.initial_account - (e.initial + e.gravity_work + e.external_work + e.wall_work - e.friction - e.damping);
    return e;
}

void World::reset_energy() { impl_->ledger_started = false; }

Statistics World::statistics() const
{
    Impl& m = *impl_;
    m.refresh_forces();
    Statistics s;
    s.kinetic_energy = m.kinetic_energy();
    s.max_overlap = m.sums.max_overlap;
    s.deep_contacts = m.sums.deep;
    double normal_sum = 0.0, net_sum = 0.0;
    std::int64_t pairs = 0, touching_bodies = 0;
    std::vector<std::uint8_t> touched(m.x.size(), 0);
    const auto note = [&](Index a, Index b, double size) {
        ++s.contacts;
        normal_sum += size;
        touched[std::size_t(a)] = 1;
        if (b >= 0) {
            ++pairs;
            touched[std::size_t(b)] = 1;
        }
    };
    for_each_contact(m, [&](const auto& c) {
        if constexpr (std::is_same_v<std::decay_t<decltype(c)>, PointContact>) note(c.a, c.b, memory_of(m, c).total.dot(memory_of(m, c).normal));
        else note(c.a, c.b, c.normal_force.norm());
    });
    for (std::size_t i = 0; i < m.x.size(); ++i) {
        if (!m.free(i)) continue;
        s.max_speed = std::max(s.max_speed, m.v[i].norm());
        if (!touched[i]) continue;
        net_sum += (m.force[i] + m.external_force[i] + m.mass[i] * m.options.gravity).norm();
        ++touching_bodies;
    }
    if (m.active > 0) s.coordination = 2.0 * double(pairs) / m.active;
    if (touching_bodies > 0 && normal_sum > 0.0) s.unbalanced_ratio = (net_sum / double(touching_bodies)) / (normal_sum / double(s.contacts));
    return s;
}

std::vector<int> World::swallowed() const
{
    impl_->refresh_forces();
    const Impl& m = *impl_;
    const SphereGridList& near = m.sphere_grids;
    std::vector<int> inside;
    for (std::size_t k = 0; k < near.sphere.size(); ++k) {
        const std::size_t i = std::size_t(near.sphere[k]), j = std::size_t(near.grid[k]);
        const detail::DistanceField field(*m.shapes[std::size_t(m.shape[j])]);
        const Vec3 local = m.q[j].conjugate() * m.periodic(m.x[i] - m.x[j]) / m.scale[j];
        if (m.scale[j] * field.distance(local) <= -m.radius[i] && (inside.empty() || inside.back() != int(i))) inside.push_back(int(i));
    }
    return inside;
}

// ---- Friction springs ----

std::vector<ContactSpring> World::contact_springs() const
{
    const Impl& m = *impl_;
    std::vector<ContactSpring> list;
    for (std::size_t r = 0; r < m.spheres.rows.size(); ++r)
        for (Index k = m.spheres.row[r]; k < m.spheres.row[r + 1]; ++k)
            if (m.spheres.touch[std::size_t(k)])
                list.push_back({m.spheres.rows[r], m.spheres.other[std::size_t(k)], 0, m.spheres.memory[std::size_t(k)].spring, Vec3::Zero()});
    const SphereWallList& w = m.sphere_walls;
    for (std::size_t k = 0; k < w.body.size(); ++k)
        if (w.touch[k]) list.push_back({w.body[k], -1 - w.wall[k], w.feature[k], w.memory[k].spring, Vec3::Zero()});
    const SphereGridList& g = m.sphere_grids;
    for (std::size_t k = 0; k < g.sphere.size(); ++k)
        for (int slot = 0; slot < Slots::count; ++slot)
            if (g.touch[k] && (g.slots[k].used >> slot & 1))
                list.push_back({g.sphere[k], g.grid[k], slot, g.slots[k].spring[slot], g.slots[k].normal[slot], g.within[k] > 0.0});
    const NodeList& n = m.nodes;
    for (std::size_t p = 0; p < n.slave.size(); ++p)
        for (const NodeContact& c : n.contacts_of(p)) list.push_back({n.slave[p], n.master[p], c.node, c.spring, Vec3::Zero()});
    std::stable_sort(list.begin(), list.end(), [](const ContactSpring& a, const ContactSpring& b) {
        return a.first == b.first && a.second == b.second ? a.node < b.node : in_order(a.first, a.second, b.first, b.second);
    });
    return list;
}

void World::set_contact_springs(std::span<const ContactSpring> springs)
{
    Impl& m = *impl_;
    if (!m.lists_valid) m.make_lists();
    std::vector<ContactSpring> of_nodes;
    for (const ContactSpring& s : springs) {
        const auto row = std::lower_bound(m.spheres.rows.begin(), m.spheres.rows.end(), s.first);
        if (row != m.spheres.rows.end() && *row == s.first && s.second >= 0) {
            const std::size_t r = std::size_t(row - m.spheres.rows.begin());
            const auto begin = m.spheres.other.begin() + m.spheres.row[r], end = m.spheres.other.begin() + m.spheres.row[r + 1];
            const auto found = std::lower_bound(begin, end, s.second);
            if (found != end && *found == s.second) {
                const std::size_t k = std::size_t(found - m.spheres.other.begin());
                m.spheres.memory[k].spring = s.spring;
                m.spheres.touch[k] = 1;
                continue;
            }
        }
        for (std::size_t k = 0; s.second < 0 && k < m.sphere_walls.body.size(); ++k)
            if (m.sphere_walls.body[k] == s.first && m.sphere_walls.wall[k] == -1 - s.second && m.sphere_walls.feature[k] == s.node) {
                m.sphere_walls.memory[k].spring = s.spring;
                m.sphere_walls.touch[k] = 1;
            }
        for (std::size_t k = 0; s.second >= 0 && k < m.sphere_grids.sphere.size(); ++k)
            if (m.sphere_grids.sphere[k] == s.first && m.sphere_grids.grid[k] == s.second && s.node >= 0 && s.node < Slots::count) {
                Slots& slots = m.sphere_grids.slots[k];
                slots.used = std::uint8_t(slots.used | 1 << s.node);
                slots.spring[s.node] = s.spring;
                slots.normal[s.node] = s.normal;
                m.sphere_grids.touch[k] = 1;
                if (s.cornered && m.options.sphere_scheme == SphereScheme::automatic && !(m.sphere_grids.within[k] > 0.0)) m.make_pocket_here(k);
            }
        of_nodes.push_back(s);
    }
    m.nodes.take_springs(of_nodes);
    m.forces_valid = false;
}

void World::Impl::drop_contacts(Index body)
{
    for (std::size_t r = 0; r < spheres.rows.size(); ++r)
        for (Index k = spheres.row[r]; k < spheres.row[r + 1]; ++k)
            if (spheres.rows[r] == body || spheres.other[std::size_t(k)] == body) {
                spheres.memory[std::size_t(k)] = {};
                spheres.touch[std::size_t(k)] = 0;
            }
    for (std::size_t k = 0; k < sphere_walls.body.size(); ++k)
        if (sphere_walls.body[k] == body) {
            sphere_walls.memory[k] = {};
            sphere_walls.touch[k] = 0;
        }
    for (std::size_t k = 0; k < sphere_grids.sphere.size(); ++k)
        if (sphere_grids.sphere[k] == body || sphere_grids.grid[k] == body) {
            sphere_grids.slots[k] = {};
            sphere_grids.press[k] = {};
            sphere_grids.touch[k] = 0;
        }
    for (std::size_t p = 0; p < nodes.slave.size(); ++p)
        if (nodes.slave[p] == body || nodes.master[p] == body) nodes.count[p] = 0;
    if (std::size_t(body) < nodes.ways.size()) nodes.ways[std::size_t(body)].listed = -std::numeric_limits<double>::infinity();
}

}  // namespace coral::dem
