// Complete state of a world as bytes, for a restart that goes on bit for bit.
#include <cstring>

#include "core/error.h"
#include "dem/detail/impl.h"

namespace coral::dem {

namespace {

constexpr std::uint64_t magic = 0x3730'4d45'4452'4f43;  // "CORDEM07"
constexpr std::uint64_t magic_name = 0x0000'ffff'ffff'ffff;  // the part without the version

std::uint64_t checksum(std::span<const std::uint8_t> bytes)
{
    std::uint64_t h = 1469598103934665603ull;
    for (const std::uint8_t b : bytes) h = (h ^ b) * 1099511628211ull;
    return h;
}

/// Writes, or reads back, one field after the other; both run through visit_state, so they cannot differ.
struct Writer {
    std::vector<std::uint8_t> bytes;
    void raw(const void* data, std::size_t size)
    {
        const auto* p = static_cast<const std::uint8_t*>(data);
        bytes.insert(bytes.end(), p, p + size);
    }
    template <class T>
    void operator()(T& value)
    {
        raw(&value, sizeof(T));
    }
    template <class T>
    void operator()(std::vector<T>& values)
    {
        std::uint64_t n = values.size();
        raw(&n, sizeof n);
        raw(values.data(), n * sizeof(T));
    }
};

struct Reader {
    std::span<const std::uint8_t> bytes;
    std::size_t at = 0;
    void raw(void* data, std::size_t size)
    {
        if (size > bytes.size() - at) throw Error("checkpoint", "the state of the bodies ends too early", "use an older checkpoint");
        if (size > 0) std::memcpy(data, bytes.data() + at, size);
        at += size;
    }
    template <class T>
    void operator()(T& value)
    {
        raw(static_cast<void*>(&value), sizeof(T));
    }
    template <class T>
    void operator()(std::vector<T>& values)
    {
        std::uint64_t n = 0;
        raw(&n, sizeof n);
        if (n > (bytes.size() - at) / sizeof(T)) throw Error("checkpoint", "the state of the bodies ends too early", "use an older checkpoint");
        values.resize(n);
        raw(static_cast<void*>(values.data()), n * sizeof(T));
    }
};

template <class Archive>
void visit_state(World::Impl& m, Archive& io)
{
    io(m.x), io(m.v), io(m.v_end), io(m.w), io(m.w_before), io(m.momentum), io(m.q), io(m.force), io(m.torque), io(m.external_force), io(m.external_torque), io(m.added_mass);
    io(m.scale), io(m.density), io(m.shape), io(m.material), io(m.motion), io(m.in);
    for (WallData& wall : m.walls) io(wall.point), io(wall.velocity), io(wall.force), io(wall.reference);
    io(m.options.gravity), io(m.any_external), io(m.active), io(m.lists_valid), io(m.forces_valid), io(m.mixed), io(m.skin), io(m.x_reference), io(m.q_reference), io(m.moved2), io(m.grid_drift);
    SphereList& s = m.spheres;
    io(s.row), io(s.other), io(s.memory), io(s.touch), io(s.root_mass), io(s.out), io(s.rows);
    SphereWallList& w = m.sphere_walls;
    io(w.body), io(w.wall), io(w.feature), io(w.touch), io(w.memory), io(w.out);
    SphereGridList& g = m.sphere_grids;
    io(g.sphere), io(g.grid), io(g.touch), io(g.slots), io(g.clearance), io(g.press), io(g.cut), io(g.within), io(g.listed), io(g.out);
    NodeList& n = m.nodes;
    io(n.slave), io(n.master), io(n.start), io(n.share), io(n.node), io(n.clearance), io(n.least), io(n.way_listed), io(n.owed), io(n.first), io(n.count), io(n.out);
    io(n.skin), io(n.ways), io(n.wall_ways);
    n.contacts.resize((n.slave.size() + node_grain - 1) / node_grain);
    n.fresh.resize(n.contacts.size());
    for (std::vector<NodeContact>& block : n.contacts) io(block);
    io(m.out_count[0]), io(m.out_count[1]), io(m.out_count[2]), io(m.out_count[3]), io(m.block_sums), io(m.sums), io(m.time);
    io(m.dissipated_friction), io(m.dissipated_damping), io(m.gravity_work), io(m.external_work), io(m.wall_work), io(m.initial), io(m.last_dt), io(m.initial_account), io(m.ledger_started);
    io(m.counters);
}

}  // namespace

std::vector<std::uint8_t> World::save() const
{
    Writer body;
    visit_state(*impl_, body);
    Writer all;
    std::uint64_t head[4] = {magic, checksum(body.bytes), impl_->x.size(), impl_->walls.size()};
    all(head);
    all.raw(body.bytes.data(), body.bytes.size());
    return std::move(all.bytes);
}

void World::restore(std::span<const std::uint8_t> state)
{
    Impl& m = *impl_;
    Reader in{state};
    std::uint64_t head[4] = {};
    in(head);
    const std::span<const std::uint8_t> rest = state.subspan(in.at);
    if (head[0] != magic && (head[0] & magic_name) == (magic & magic_name))
        throw Error("checkpoint", "another version of the tools wrote the state of the bodies", "resume with that version, or start the run anew");
    if (head[0] != magic || checksum(rest) != head[1]) throw Error("checkpoint", "the state of the bodies is damaged", "use an older checkpoint");
    if (head[2] != m.x.size() || head[3] != m.walls.size())
        throw Error("checkpoint", "it holds " + std::to_string(head[2]) + " bodies and " + std::to_string(head[3]) + " walls, the case has " +
                                      std::to_string(m.x.size()) + " and " + std::to_string(m.walls.size()),
                    "resume with the case that wrote it");
    visit_state(m, in);
    for (std::size_t i = 0; i < m.x.size(); ++i) m.update_mass(i);
    m.crossings.resize(std::max(m.crossings.size(), m.block_sums.size()));
    m.sphere_grids.pocket.assign(m.sphere_grids.within.size(), {});
    for (std::size_t k = 0; k < m.sphere_grids.within.size(); ++k)
        if (m.sphere_grids.within[k] > 0.0) m.make_pocket(k);
    m.nodes.unlisted.assign(m.nodes.slave.size(), 0.0F);
    m.spheres.make_room();
    m.sphere_walls.make_room();
    m.sphere_grids.make_room();
}

}  // namespace coral::dem
