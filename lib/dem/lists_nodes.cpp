// Lists of surface nodes near a partner. A pair is looked at anew when one of its bodies has moved; the others keep their nodes, so that
// a few loose grains do not cost a whole packing.
#include <algorithm>
#include <cmath>
#include <limits>

#include "dem/detail/impl.h"

namespace coral::dem {

namespace {

constexpr double steepest_ball = 1.05;  ///< distances over a ball of nodes rise by this much of its radius at most

struct Directed {
    Index slave, master;
    double share;
};

std::vector<Directed> direct(const World::Impl& world, const std::vector<BroadPair>& pairs)
{
    std::vector<Directed> directed;
    for (const BroadPair& pair : pairs) {
        const std::size_t a = std::size_t(pair.a), b = std::size_t(pair.b);
        if (!world.has_nodes[a] || !world.has_nodes[b]) continue;
        // Nodes of the body of smaller outer volume; ties go to the lower id.
        const bool first = world.equivalent[a] <= world.equivalent[b];
        const double share = world.options.two_way_nodes ? 0.5 : 1.0;
        if (first || world.options.two_way_nodes) directed.push_back({pair.a, pair.b, share});
        if (!first || world.options.two_way_nodes) directed.push_back({pair.b, pair.a, share});
    }
    Vec3 gradient;
    for (std::size_t i = 0; i < world.x.size(); ++i) {
        if (!world.has_nodes[i] || !world.free(i)) continue;
        for (std::size_t wall = 0; wall < world.walls.size(); ++wall) {
            const WallData& data = world.walls[wall];
            const double height = data.kind == WallData::Kind::plane ? data.normal.dot(world.x[i] - data.point)
                                                                     : data.distance_and_gradient(world.x[i], gradient);
            if (height < world.radius[i] + world.skin) directed.push_back({Index(i), -1 - Index(wall), 1.0});
        }
    }
    std::sort(directed.begin(), directed.end(), [](const Directed& s, const Directed& t) { return key_of(s.slave, s.master) < key_of(t.slave, t.master); });
    return directed;
}

/// Nodes of `slave` within reach of a partner, tested cluster by cluster. `distance(limit, p)` of a place in the slave's shape frame may be
/// any lower bound above the limit. \return lower bound of the distance of all others
template <class Distance>
double append_nodes(const World::Impl& world, Index slave, const Distance& distance, NodeList& l)
{
    const double reach = l.skin + l.slack();
    const std::size_t a = std::size_t(slave);
    const Shape& shape = *world.shapes[std::size_t(world.shape[a])];
    double unlisted = std::numeric_limits<double>::infinity();
    const auto near = [&](const Shape::Cluster& c) {
        const double around = steepest_ball * world.scale[a] * c.radius, nearest = distance(around + reach, c.centre) - around;
        if (nearest <= reach) return true;
        unlisted = std::min(unlisted, nearest);
        return false;
    };
    for (const Shape::Cluster& group : shape.groups()) {
        if (!near(group)) continue;
        for (int c = group.begin; c < group.end; ++c) {
            const Shape::Cluster& cluster = shape.clusters()[std::size_t(c)];
            if (!near(cluster)) continue;
            for (int n = cluster.begin; n < cluster.end; ++n) {
                const double d = distance(reach, shape.nodes()[std::size_t(n)]);
                if (d < reach) {
                    l.node.push_back(n);
                    l.clearance.push_back(std::nextafter(float(d - l.slack()), -std::numeric_limits<float>::infinity()));
                } else {
                    unlisted = std::min(unlisted, d);
                }
            }
        }
    }
    return unlisted;
}

/// Lists the near nodes of a pair. \return lower bound of the distance of all others
double look_at(const World::Impl& world, const Directed& d, NodeList& l)
{
    const std::size_t a = std::size_t(d.slave);
    const Eigen::Matrix3d rotation = world.scale[a] * world.q[a].toRotationMatrix();
    if (d.master >= 0) {
        const std::size_t b = std::size_t(d.master);
        const double scale = world.scale[b];
        const Eigen::Matrix3d world_to_b = world.q[b].toRotationMatrix().transpose() / scale, to_b = world_to_b * rotation;
        const Vec3 shift = world_to_b * world.periodic(world.x[a] - world.x[b]);
        const Shape& shape = *world.shapes[std::size_t(world.shape[b])];
        if (shape.kind() == ShapeKind::grid)
            return append_nodes(world, d.slave, [&](double, const Vec3& p) { return scale * shape.distance_grid().sample(to_b * p + shift); }, l);
        const Polyhedron& polyhedron = shape.polyhedron();
        // The plane that was highest last is asked first: of nodes near each other most are far from the same one.
        Vec3 normal = Vec3::Zero();
        double offset = std::numeric_limits<double>::infinity();
        return append_nodes(world, d.slave, [&](double limit, const Vec3& p) {
            const Vec3 local = to_b * p + shift;
            double height = normal.dot(local) - offset;
            if (scale * height > limit) return scale * height;
            height = polyhedron.depth_and_normal(local, normal);
            offset = normal.dot(local) - height;
            return scale * height;
        }, l);
    }
    const WallData& wall = world.walls[std::size_t(-1 - d.master)];
    if (wall.kind == WallData::Kind::plane) {
        const double height = wall.normal.dot(world.x[a] - wall.point);
        const Vec3 up = rotation.transpose() * wall.normal;
        return append_nodes(world, d.slave, [&](double, const Vec3& p) { return height + up.dot(p); }, l);
    }
    Vec3 gradient;
    return append_nodes(world, d.slave, [&](double, const Vec3& p) { return wall.distance_and_gradient(world.x[a] + rotation * p, gradient); }, l);
}

/// How far bodies and walls have come since their pairs were last looked at.
struct Moves {
    enum Kind : std::uint8_t { little, far, unknown };
    std::vector<Kind> bodies, walls;
    Kind of(const Directed& d) const { return std::max(bodies[std::size_t(d.slave)], d.master < 0 ? walls[std::size_t(-1 - d.master)] : bodies[std::size_t(d.master)]); }
};

/// Those that have come farther than `keeps` start anew.
Moves take_moves(World::Impl& world, double keeps)
{
    const auto take = [keeps](double way, Way& of) {
        if (way <= keeps) return Moves::little;
        of.listed = of.length;
        return std::isfinite(way) ? Moves::far : Moves::unknown;
    };
    Moves moves{std::vector(world.x.size(), Moves::little), std::vector(world.walls.size(), Moves::little)};
    for (std::size_t i = 0; i < world.x.size(); ++i)
        if (world.in[i] && world.has_nodes[i]) moves.bodies[i] = take(world.note_way(i), world.nodes.ways[i]);
    for (std::size_t k = 0; k < world.walls.size(); ++k) moves.walls[k] = take(world.note_wall_way(k), world.nodes.wall_ways[k]);
    return moves;
}

}  // namespace

std::span<const NodeContact> NodeList::contacts_of(std::size_t pair) const
{
    return {contacts[pair / node_grain].data() + first[pair], std::size_t(count[pair])};
}

void NodeList::take_springs(std::vector<ContactSpring> springs)
{
    const auto key = [](const ContactSpring& s) { return std::pair(key_of(s.first, s.second), s.node); };
    std::sort(springs.begin(), springs.end(), [&](const ContactSpring& s, const ContactSpring& t) { return key(s) < key(t); });
    auto next = springs.begin();
    for (std::size_t p = 0; p < slave.size(); ++p) {
        if (p % node_grain == 0) contacts[p / node_grain].clear();
        std::vector<NodeContact>& of_block = contacts[p / node_grain];
        first[p] = Index(of_block.size());
        const std::uint64_t pair = key_of(slave[p], master[p]);
        while (next != springs.end() && key_of(next->first, next->second) < pair) ++next;
        for (; next != springs.end() && key_of(next->first, next->second) == pair; ++next) {
            NodeContact c;
            c.node = next->node;
            c.touch = 1;
            c.spring = next->spring;
            of_block.push_back(c);
        }
        count[p] = Index(of_block.size()) - first[p];
    }
}

double World::Impl::note_wall_way(std::size_t k)
{
    Way& way = nodes.wall_ways[k];
    const double now = (walls[k].point - way.x).norm();
    if (!(now <= nodes.hop())) {
        way.length += now;
        way.x = walls[k].point;
    }
    return way.length - way.listed;
}

void World::Impl::list_nodes(const std::vector<BroadPair>* pairs)
{
    const auto start = std::chrono::steady_clock::now();
    std::vector<Directed> directed;
    if (pairs) directed = direct(*this, *pairs);
    else
        for (std::size_t p = 0; p < nodes.slave.size(); ++p) directed.push_back({nodes.slave[p], nodes.master[p], nodes.share[p]});
    NodeList old = std::move(nodes);
    NodeList& l = nodes;
    l = {};
    l.skin = node_skin * skin;
    l.ways = std::move(old.ways);
    l.wall_ways = std::move(old.wall_ways);
    l.ways.resize(x.size());
    l.wall_ways.resize(walls.size());
    // Whoever has used up half of the way is looked at anew, so that the lists last a while.
    const double keeps = l.skin == old.skin ? 0.5 * free_path * l.skin : -1.0;
    const Moves moves = take_moves(*this, keeps);

    l.start.push_back(0);
    l.node.reserve(old.node.size() + old.node.size() / 8);
    l.clearance.reserve(l.node.capacity());
    l.contacts.resize((directed.size() + node_grain - 1) / node_grain);
    l.fresh.resize(l.contacts.size());
    std::size_t o = 0;
    for (const Directed& d : directed) {
        while (o < old.slave.size() && key_of(old.slave[o], old.master[o]) < key_of(d.slave, d.master)) ++o;
        const bool known = o < old.slave.size() && old.slave[o] == d.slave && old.master[o] == d.master;
        const Moves::Kind move = moves.of(d);
        const double way = l.way_of(d.slave, d.master);
        // Most pairs are so far apart that their bodies may move for long before any node comes near that is not listed.
        const bool stays = known && (move == Moves::little || (move == Moves::far && keeps >= 0.0 && old.unlisted[o] - steepest * (way - old.way_listed[o]) > l.skin + l.slack()));
        const std::size_t begin = l.node.size();
        l.way_listed.push_back(stays ? old.way_listed[o] : way);
        if (stays) {
            l.unlisted.push_back(old.unlisted[o]);
            l.node.insert(l.node.end(), old.node.begin() + old.start[o], old.node.begin() + old.start[o + 1]);
            l.clearance.insert(l.clearance.end(), old.clearance.begin() + old.start[o], old.clearance.begin() + old.start[o + 1]);
        } else {
            l.unlisted.push_back(std::nextafter(float(look_at(*this, d, l)), 0.0F));
        }
        float least = std::numeric_limits<float>::infinity();
        for (std::size_t k = begin; k < l.node.size(); ++k) least = std::min(least, l.clearance[k]);
        std::vector<NodeContact>& contacts = l.contacts[l.slave.size() / node_grain];
        l.first.push_back(Index(contacts.size()));
        l.count.push_back(known ? old.count[o] : 0);
        if (known && old.count[o] > 0) {
            const auto from = old.contacts[o / node_grain].begin() + old.first[o];
            contacts.insert(contacts.end(), from, from + old.count[o]);
        }
        l.owed.push_back(known ? old.owed[o] : 0.0);
        l.slave.push_back(d.slave);
        l.master.push_back(d.master);
        l.share.push_back(d.share);
        l.least.push_back(least);
        l.start.push_back(Index(l.node.size()));
    }
    l.out.resize(l.slave.size());
    if (!pairs) {
        make_blocks();
        counters.seconds_lists += seconds_since(start);
        ++counters.rebuilds;
    }
}

}  // namespace coral::dem
