// Contact of surface nodes with a distance field (grid or wall).
#include <cmath>
#include <limits>
#include <span>

#include "core/parallel.h"
#include "dem/detail/impl.h"

namespace coral::dem {

namespace {

using detail::sigmoid;

/// What the nodes of one pair are tested against.
struct Field {
    detail::DistanceField body;
    const WallData* wall = nullptr;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< body to world
    Eigen::Matrix3d to_local = Eigen::Matrix3d::Identity();  ///< its inverse, over the scale
    Vec3 centre = Vec3::Zero();  ///< of the body, nearest image to the slave
    double scale = 1.0;

    /// Distance [m] and world gradient at a world point.
    double operator()(const Vec3& p, Vec3& gradient, detail::CellMemory& memory) const
    {
        if (!wall) {
            Vec3 local;
            const double d = scale * body.depth_and_gradient(to_local * (p - centre), local, memory);
            gradient = rotation * local;
            return d;
        }
        if (wall->kind == WallData::Kind::plane) {
            gradient = wall->normal;
            return wall->normal.dot(p - wall->point);
        }
        return wall->distance_and_gradient(p, gradient);
    }
};

/// What the forces at both ends of a step took from a pair's motion beside what its nodes store: of the order of the step only where nodes
/// open, close or change to another face, else of the third. Gathered over the nodes; see correct_crossings().
struct WorkError {
    double energy = 0.0, stored = 0.0, weight = 0.0;
    Vec3 push = Vec3::Zero(), arm = Vec3::Zero();
    bool clamped = false;  ///< a dashpot held a node back: the error is its doing

    void add(double node_energy, double node_stored, const Vec3& node_push, const Vec3& node_arm)
    {
        const double size = node_push.norm();
        energy += node_energy;
        stored += node_stored;
        weight += size;
        push += node_push;
        arm += size * node_arm;
    }

    /// Passes it on for correction, once it is more than the noise of depths.
    void hand_over(double& owed, Index pair, const GeneralForce& contact, const Vec3& to_b, std::vector<Crossing>& list, LoopSums& s) const
    {
        const double give = owed + energy, size = push.norm();
        owed = 0.0;
        if (clamped || !(size > 0.0)) {
            s.damping += give;
            return;
        }
        if (std::abs(give) < 1e-6 * stored) {
            if (contact.points > 0) owed = give;
            else s.damping += give;
            return;
        }
        const Vec3 at = arm / weight;
        list.push_back({contact.a, contact.b, give, push / size, to_b + at, at, contact.points > 0 ? pair : -1});
    }
};

/// One pair of the node list as it stands in this step. Three passes over its touching nodes: elastic forces, dashpots, friction.
class NodePair {
public:
    NodePair(World::Impl& world, std::size_t p, double dt) : world_(world), list_(world.nodes), p_(p), dt_(dt)
    {
        const std::size_t a = a_ = std::size_t(list_.slave[p]);
        const Index master = list_.master[p];
        double master_inverse_mass = 0.0, reach_b = world.equivalent[a], inverse_radius = 1.0 / world.equivalent[a];
        Index material_b;
        if (master >= 0) {
            const std::size_t b = std::size_t(master);
            to_b_ = world.periodic(world.x[a] - world.x[b]);
            field_.body = detail::DistanceField(*world.shapes[std::size_t(world.shape[b])]);
            field_.rotation = world.q[b].toRotationMatrix();
            field_.centre = world.x[a] - to_b_;
            field_.scale = world.scale[b];
            field_.to_local = field_.rotation.transpose() / field_.scale;
            master_inverse_mass = world.inverse_mass[b];
            inverse_radius += 1.0 / world.equivalent[b];
            velocity_b_ = world.v[b];
            end_b_ = world.v_end[b];
            spin_b_ = world.w[b];
            old_spin_b_ = world.w_before[b];
            material_b = world.material[b];
            reach_b = world.equivalent[b];
        } else {
            const WallData& wall = world.walls[std::size_t(-1 - master)];
            field_.wall = &wall;
            velocity_b_ = end_b_ = wall.velocity;
            inverse_radius *= wall.relative_curvature(world.equivalent[a]);
            material_b = wall.material;
        }
        smaller_ = std::min(world.equivalent[a], reach_b);
        law_ = &world.law(world.material[a], material_b);
        root_mass_ = std::sqrt(1.0 / (world.inverse_mass[a] + master_inverse_mass));
        share_ = list_.share[p];
        stiffness_ = share_ * law_->kn * inverse_radius / (2.0 * EIGEN_PI) * world.scale[a] * world.scale[a];
        inverse_length_ = sigmoid / (2.0 * smaller_);
    }

    /// Elastic forces of all nodes within reach; `old` are the contacts of the last step, `now` gets those of this one.
    void press(std::span<const NodeContact> old, double near, std::vector<NodeContact>& now, LoopSums& s)
    {
        const Shape& surface = *world_.shapes[std::size_t(world_.shape[a_])];
        const Eigen::Matrix3d rotation = world_.scale[a_] * world_.q[a_].toRotationMatrix();
        auto past = old.begin();
        float least = find_near(near, surface);
        for (const Index k : near_) {
            const Index node = list_.node[std::size_t(k)];
            for (; past != old.end() && past->node < node; ++past) release(*past, 0.0, Vec3::Zero(), s);
            const bool held = past != old.end() && past->node == node;
            ++s.node_queries;
            NodeContact& c = now.emplace_back();
            c.node = node;
            // Nodes are many and far apart in memory: what touches carries its own.
            const bool carried = held && past->stiffness > 0.0;
            c.place = carried ? past->place : surface.nodes()[std::size_t(node)];
            c.arm = rotation * c.place;
            if (held && field_.body.grid) c.cell = past->cell;
            c.depth = -field_(world_.x[a_] + c.arm, c.gradient, c.cell);
            constexpr float none = -std::numeric_limits<float>::infinity();
            const float clearance = c.depth > 0.0 ? none : std::nextafter(float(near - c.depth - list_.slack()), none);
            list_.clearance[std::size_t(k)] = clearance;
            least = std::min(least, clearance);
            if (c.depth <= 0.0) {
                now.pop_back();
                if (held) release(*past++, 0.0, Vec3::Zero(), s);
                continue;
            }
            c.stiffness = carried ? past->stiffness : stiffness_ * surface.node_areas()[std::size_t(node)];
            const detail::NodePotential potential = detail::node_potential(c.depth, inverse_length_);
            c.force = c.stiffness * potential.force;
            const double stored = c.stiffness * potential.energy;
            s.elastic_normal += stored;
            total_ += c.force;
            const Vec3 push = c.force * c.gradient;
            if (held) {
                release(*past, stored, push, s, &c);
                c.spring = past->spring;
                old_.push_back(&*past++);
            } else {
                if (dt_ > 0.0) error_.add(-stored - 0.5 * dt_ * push.dot(velocity_now(c.arm)), stored, push, c.arm);
                old_.push_back(nullptr);
            }
        }
        for (; past != old.end(); ++past) release(*past, 0.0, Vec3::Zero(), s);
        list_.least[p_] = least;
    }

    void damp(std::span<NodeContact> contacts, LoopSums& s)
    {
        const double inverse_total = total_ > 0.0 ? 1.0 / total_ : 0.0;
        for (NodeContact& c : contacts) {
            const double weight = c.force * inverse_total, slope = c.gradient.norm();
            const Vec3& n = normal_.emplace_back(direction(c.gradient, slope));
            const double elastic = c.force * slope;
            c.force = elastic;
            c.touch = 1;
            if (law_->damping > 0.0 && weight > 0.0) {
                const Vec3 relative = world_.v_end[a_] + world_.w[a_].cross(c.arm) - end_b_ - spin_b_.cross(to_b_ + c.arm);
                c.force = weight * share_ * detail::normal_force(elastic / (weight * share_), -relative.dot(n), *law_, root_mass_);
                if (c.force == 0.0) {
                    c.touch = 2;
                    error_.clamped = true;
                }
            }
            c.drag = (c.force - elastic) * n;
            s.damping -= 0.5 * dt_ * c.drag.dot(velocity_now(c.arm));
            normal_total_ += c.force;
        }
    }

    /// Friction, and the sums of the pair. Springs share the force by the nodes' parts of the normal force.
    void rub(std::span<NodeContact> contacts, GeneralForce& out, LoopSums& s)
    {
        const double per_normal = normal_total_ > 0.0 ? 1.0 / normal_total_ : 0.0;
        for (std::size_t k = 0; k < contacts.size(); ++k) {
            NodeContact& c = contacts[k];
            const NodeContact* const past = old_[k];
            const Vec3& n = normal_[k];
            const Vec3 velocity = velocity_now(c.arm), slide = velocity - n.dot(velocity) * n;
            const double weight = share_ * c.force * per_normal;
            Vec3 old_slide = Vec3::Zero();
            double held = 0.0, taken = 0.0;
            if (past && past->touch) {
                const Vec3 old_velocity = velocity_before(past->arm), old_n = direction(past->gradient);
                old_slide = old_velocity - old_n.dot(old_velocity) * old_n;
                held = -0.5 * past->pull.dot(past->spring);
                taken = -0.5 * dt_ * past->pull.dot(old_velocity);
            }
            const detail::Friction friction = detail::rub({*law_, n, slide, old_slide, 0.5 * (world_.w[a_] + spin_b_).dot(n), root_mass_}, normal_total_ / share_,
                                                          dt_, c.spring);
            c.pull = weight * friction.pull;
            const Vec3 tangential = weight * friction.total, brake = tangential - c.pull;
            c.drag += brake;
            const double stored = -0.5 * c.pull.dot(c.spring);
            s.elastic_tangential += stored;
            // Nodes that come and go take springs along: what they hold and nobody gets back is lost as by slip.
            s.friction += taken - 0.5 * dt_ * c.pull.dot(velocity) - (stored - held);
            s.damping -= 0.5 * dt_ * brake.dot(velocity);
            const Vec3 normal = c.force * n;
            out.normal_force += normal;
            out.tangential_force += tangential;
            out.torque_a += c.arm.cross(normal + tangential);
            out.torque_b -= (to_b_ + c.arm).cross(normal + tangential);
            out.arm += c.force * per_normal * c.arm;
            out.overlap = std::max(out.overlap, c.depth);
            ++out.points;
        }
    }

    void finish(const GeneralForce& out, double& owed, std::vector<Crossing>& crossing, LoopSums& s) const
    {
        error_.hand_over(owed, Index(p_), out, to_b_, crossing, s);
        if (out.points == 0) return;
        ++s.touching;
        s.max_overlap = std::max(s.max_overlap, out.overlap / smaller_);
    }

private:
    static Vec3 direction(const Vec3& gradient, double slope) { return slope < 1e-9 ? Vec3::UnitZ() : Vec3(gradient / slope); }
    static Vec3 direction(const Vec3& gradient) { return direction(gradient, gradient.norm()); }

    /// Finds the nodes that may touch, and fetches their places. \return least clearance of the others
    float find_near(double near, const Shape& surface)
    {
        const std::size_t first = std::size_t(list_.start[p_]), count = std::size_t(list_.start[p_ + 1]) - first;
        const float* const clearance = list_.clearance.data() + first;
        constexpr float infinite = std::numeric_limits<float>::infinity();
        const float limit = std::nextafter(float(near), infinite);
        near_.resize(count);
        std::size_t found = 0;
        for (std::size_t k = 0; k < count; ++k) {  // without branches, that nobody could foresee
            near_[found] = Index(first + k);
            found += clearance[k] <= limit;
        }
        near_.resize(found);
        for (const Index k : near_)
            if (list_.clearance[std::size_t(k)] > -infinite) __builtin_prefetch(&surface.nodes()[std::size_t(list_.node[std::size_t(k)])]);
        // Lanes compare side by side, so that the loop vectorises.
        constexpr std::size_t lanes = 8;
        float least[lanes];
        std::fill(least, least + lanes, infinite);
        std::size_t k = 0;
        for (; k + lanes <= count; k += lanes)
            for (std::size_t l = 0; l < lanes; ++l) {
                const float far = clearance[k + l] <= limit ? infinite : clearance[k + l];
                least[l] = far < least[l] ? far : least[l];
            }
        for (; k < count; ++k)
            if (clearance[k] > limit) least[0] = std::min(least[0], clearance[k]);
        return *std::min_element(least, least + lanes);
    }

    /// Of a point of the slave against the master, in the middle of the step, as the geometry is at its end ...
    Vec3 velocity_now(const Vec3& arm) const { return world_.v[a_] - velocity_b_ + world_.w[a_].cross(arm) - spin_b_.cross(to_b_ + arm); }
    /// ... and at its start.
    Vec3 velocity_before(const Vec3& arm) const
    {
        const Vec3 drift = world_.v[a_] - velocity_b_;
        return drift + world_.w_before[a_].cross(arm) - old_spin_b_.cross(to_b_ - dt_ * drift + arm);
    }

    /// The half step that the forces of a contact of the last step still act for; `stored` and `push` are what became of it.
    void release(const NodeContact& past, double stored, const Vec3& push, LoopSums& s, const NodeContact* now = nullptr)
    {
        const Vec3 velocity = velocity_before(past.arm);
        const detail::NodePotential potential = detail::node_potential(past.depth, inverse_length_);
        const Vec3 old_push = (past.stiffness * potential.force) * past.gradient;
        const double released = past.stiffness * potential.energy;
        s.damping -= 0.5 * dt_ * past.drag.dot(velocity);
        double work = old_push.dot(velocity);
        if (now) work += push.dot(velocity_now(now->arm));
        else s.friction -= 0.5 * dt_ * past.pull.dot(velocity) + 0.5 * past.pull.dot(past.spring);
        if (dt_ <= 0.0) return;
        const double energy = released - stored - 0.5 * dt_ * work;
        if (past.touch == 2) s.damping += energy;
        else error_.add(energy, stored + released, push + old_push, past.arm);
    }

    const World::Impl& world_;
    NodeList& list_;
    std::size_t p_, a_;
    double dt_;
    Field field_;
    const PairLaw* law_;
    Vec3 velocity_b_ = Vec3::Zero(), end_b_ = Vec3::Zero(), spin_b_ = Vec3::Zero(), old_spin_b_ = Vec3::Zero(), to_b_ = Vec3::Zero();
    double root_mass_, share_, stiffness_, inverse_length_, smaller_, total_ = 0.0, normal_total_ = 0.0;
    WorkError error_;
    // Of the pair at hand: room that is kept.
    struct Scratch {
        std::vector<Index> near;               ///< entries of the list that may touch
        std::vector<const NodeContact*> old;   ///< of each contact, if it was there in the last step
        std::vector<Vec3> normal;              ///< of each contact
    };
    static Scratch& scratch()
    {
        static thread_local Scratch room;
        room.old.clear();
        room.normal.clear();
        return room;
    }
    Scratch& scratch_ = scratch();
    std::vector<Index>& near_ = scratch_.near;
    std::vector<const NodeContact*>& old_ = scratch_.old;
    std::vector<Vec3>& normal_ = scratch_.normal;
};

/// Fetches the lists of a pair and what its contacts keep.
void fetch_pair(const NodeList& l, std::size_t p, std::span<const NodeContact> contacts)
{
    __builtin_prefetch(l.clearance.data() + l.start[p]);
    __builtin_prefetch(l.node.data() + l.start[p]);
    constexpr std::size_t cache_line = 64;
    const std::span<const std::byte> kept = std::as_bytes(contacts);
    for (std::size_t at = 0; at < kept.size(); at += cache_line) __builtin_prefetch(kept.data() + at);
}

/// Fetches what the loop reads of a body. The partners of a body lie anywhere in memory.
void fetch_body(const World::Impl& world, std::size_t i)
{
    for (const std::vector<Vec3>* of : {&world.x, &world.v, &world.v_end, &world.w, &world.w_before}) __builtin_prefetch(&(*of)[i]);
    __builtin_prefetch(&world.q[i]);
}

}  // namespace

void World::Impl::node_loop(double dt)
{
    NodeList& l = nodes;
    const std::size_t base = out_count[0].size() + out_count[1].size() + out_count[2].size();
    parallel_blocks(l.slave.size(), node_grain, [&](std::size_t first, std::size_t last) {
        const std::size_t block = first / node_grain;
        LoopSums s;
        std::vector<Crossing>& crossing = crossings[base + block];
        std::vector<NodeContact>&contacts = l.contacts[block], &fresh = l.fresh[block];
        // What was farther away when it was last looked at than both sides have come since is not looked at.
        std::size_t due[node_grain], count = 0;
        double near[node_grain];
        for (std::size_t p = first; p < last; ++p) {
            near[count] = steepest * (l.way_of(l.slave[p], l.master[p]) - l.way_listed[p]);
            if (l.count[p] == 0 && double(l.least[p]) > near[count]) continue;
            if (l.master[p] >= 0) fetch_body(*this, std::size_t(l.master[p]));
            fetch_pair(l, p, {contacts.data() + l.first[p], std::size_t(l.count[p])});
            due[count++] = p;
        }
        s.tests = l.start[last] - l.start[first];
        fresh.clear();
        GeneralForce* const begin = l.out.data() + first;
        GeneralForce* out = begin;
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t p = due[k];
            const Index from = Index(fresh.size());
            NodePair pair(*this, p, dt);
            *out = {};
            out->a = l.slave[p];
            out->b = l.master[p];
            pair.press({contacts.data() + l.first[p], std::size_t(l.count[p])}, near[k], fresh, s);
            const std::span<NodeContact> now(fresh.data() + from, fresh.size() - std::size_t(from));
            pair.damp(now, s);
            pair.rub(now, *out, s);
            pair.finish(*out, l.owed[p], crossing, s);
            if (out->points > 0) ++out;
            l.first[p] = from;
            l.count[p] = Index(now.size());
        }
        contacts.swap(fresh);
        out_count[3][block] = std::int32_t(out - begin);
        block_sums[base + block] = s;
    });
}

}  // namespace coral::dem
