// Contact of surface nodes with a distance field (grid or wall), and the ordered sums of all contact loops.
#include <cmath>

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
    Vec3 centre = Vec3::Zero();  ///< of the body, nearest image to the slave
    double scale = 1.0;

    /// Distance [m] and world gradient at a world point.
    double operator()(const Vec3& p, Vec3& gradient) const
    {
        if (!wall) {
            Vec3 local;
            const double d = scale * body.depth_and_gradient(rotation.transpose() * (p - centre) / scale, local);
            gradient = rotation * local;
            return d;
        }
        if (wall->kind == WallData::Kind::plane) {
            gradient = wall->normal;
            return wall->normal.dot(p - wall->point);
        }
        return wall->plate.distance_and_gradient(p, gradient);
    }
};

/// What the trapezoid of the forces at both ends of a step takes from a pair's motion beside what its nodes store: of the order of the
/// step only where nodes open, close or change to another face, else of the third. Gathered over the nodes; see correct_crossings().
struct WorkError {
    double energy = 0.0, stored = 0.0, weight = 0.0;
    Vec3 push = Vec3::Zero(), arm = Vec3::Zero();
    bool clamped = false;  ///< a dashpot held a node back: what it lost is booked as damping

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
    void hand_over(double& owed, Index pair, const GeneralForce& contact, const Vec3& to_b, std::vector<Crossing>& list) const
    {
        const double give = owed + energy, size = push.norm();
        owed = 0.0;
        if (clamped || !(size > 0.0)) return;
        if (std::abs(give) < 1e-6 * stored) {
            if (contact.points > 0) owed = give;
            return;
        }
        const Vec3 at = arm / weight;
        list.push_back({contact.a, contact.b, give, push / size, to_b + at, at, contact.points > 0 ? pair : -1});
    }
};

}  // namespace

void World::Impl::node_loop(double dt)
{
    NodeList& l = nodes;
    const std::size_t base = (spheres.rows.size() + row_grain - 1) / row_grain +
                             (sphere_walls.body.size() + entry_grain - 1) / entry_grain + (sphere_grids.sphere.size() + grid_grain - 1) / grid_grain;
    // What was farther away when the list was made than both sides have come since is not looked at; the quarter more is for lattices,
    // whose values may rise a little faster than the way (free_path leaves the same room).
    const double near = 2.5 * node_drift;
    parallel_blocks(l.slave.size(), node_grain, [&](std::size_t first, std::size_t last) {
        LoopSums s;
        std::vector<Crossing>& crossing = crossings[base + first / node_grain];
        for (std::size_t p = first; p < last; ++p) {
            const std::size_t a = std::size_t(l.slave[p]);
            const Index master = l.master[p];
            GeneralForce& out = l.out[p];
            out = {};
            out.a = l.slave[p];
            out.b = master;
            Field field;
            const Shape& surface = *shapes[std::size_t(shape[a])];
            double master_inverse_mass = 0.0, reach_b = 0.0, inverse_radius = 1.0 / equivalent[a];
            Vec3 velocity_b = Vec3::Zero(), end_b = Vec3::Zero(), spin_b = Vec3::Zero(), to_b = Vec3::Zero();
            Index material_b;
            if (master >= 0) {
                const std::size_t b = std::size_t(master);
                to_b = periodic(x[a] - x[b]);
                field.body = detail::DistanceField(*shapes[std::size_t(shape[b])]);
                field.rotation = q[b].toRotationMatrix();
                field.centre = x[a] - to_b;
                field.scale = scale[b];
                master_inverse_mass = inverse_mass[b];
                inverse_radius += 1.0 / equivalent[b];
                velocity_b = v[b];
                end_b = v_end[b];
                spin_b = w[b];
                material_b = material[b];
                reach_b = equivalent[b];
            } else {
                const WallData& wall = walls[std::size_t(-1 - master)];
                field.wall = &wall;
                velocity_b = end_b = wall.velocity;
                material_b = wall.material;
                reach_b = equivalent[a];
            }
            const PairLaw& pair = law(material[a], material_b);
            const double root_mass = std::sqrt(1.0 / (inverse_mass[a] + master_inverse_mass));
            const double share = l.share[p];
            const double stiffness = share * pair.kn * inverse_radius / (2.0 * EIGEN_PI) * scale[a] * scale[a];
            const double inverse_length = sigmoid / (2.0 * std::min(equivalent[a], reach_b));
            const Eigen::Matrix3d rotation = scale[a] * q[a].toRotationMatrix();
            double total = 0.0;
            WorkError error;
            for (Index k = l.start[p]; k < l.start[p + 1]; ++k) {
                if (l.clearance[k] > near && l.touch[k] == 0) continue;
                ++s.node_queries;
                const Vec3 arm = rotation * surface.nodes()[std::size_t(l.node[k])];
                l.arm[k] = arm;
                const Vec3 old_gradient = l.gradient[k];
                const double old_depth = l.depth[k];
                const double depth = -field(x[a] + arm, l.gradient[k]);
                l.depth[k] = depth;
                l.force[k] = 0.0;
                if (depth <= 0.0 && l.touch[k] == 0) continue;
                const double area_stiffness = stiffness * surface.node_areas()[std::size_t(l.node[k])];
                double stored = 0.0;
                Vec3 push = Vec3::Zero();
                if (depth > 0.0) {
                    const detail::NodePotential potential = detail::node_potential(depth, inverse_length);
                    l.force[k] = area_stiffness * potential.force;
                    s.elastic_normal += area_stiffness * potential.energy;
                    total += l.force[k];
                    stored = area_stiffness * potential.energy;
                    push = l.force[k] * l.gradient[k];
                }
                if (dt <= 0.0 || l.touch[k] == 2) continue;
                double released = 0.0;
                if (l.touch[k] == 1) {
                    const detail::NodePotential past = detail::node_potential(old_depth, inverse_length);
                    released = area_stiffness * past.energy;
                    push += (area_stiffness * past.force) * old_gradient;
                }
                const Vec3 turned = dt * w[a].cross(arm), drift = dt * (v[a] - velocity_b);
                const Vec3 way = drift + dt * w[a].cross(arm - 0.5 * turned) - dt * spin_b.cross(to_b + arm - 0.5 * (drift + turned));
                error.add(released - stored - 0.5 * push.dot(way), stored + released, push, arm);
            }
            s.tests += l.start[p + 1] - l.start[p];
            const double inverse_total = total > 0.0 ? 1.0 / total : 0.0;
            // Friction bound of every spring: the whole normal force of the pair, known after a first pass.
            double normal_total = 0.0;
            for (Index k = l.start[p]; k < l.start[p + 1]; ++k) {
                if (l.depth[k] <= 0.0) {
                    if (l.touch[k]) {
                        l.touch[k] = 0;
                        l.spring[k].setZero();
                    }
                    continue;
                }
                const double weight = l.force[k] * inverse_total, slope = l.gradient[k].norm();
                const Vec3 n = slope < 1e-9 ? Vec3::UnitZ() : Vec3(l.gradient[k] / slope);
                const Vec3& arm = l.arm[k];
                const Vec3 relative = v_end[a] + w[a].cross(arm) - end_b - spin_b.cross(to_b + arm);
                double fn = l.force[k] * slope;
                if (!l.touch[k]) l.spring[k].setZero();
                l.touch[k] = 1;
                if (pair.damping > 0.0 && weight > 0.0) {
                    LoopSums node_sums;
                    fn = weight * share * normal_force(fn / (weight * share), -relative.dot(n), pair, root_mass, dt, node_sums);
                    s.damping += weight * share * node_sums.damping;
                    if (fn == 0.0) {
                        l.touch[k] = 2;
                        error.clamped = true;
                    }
                }
                l.force[k] = fn;
                normal_total += fn;
            }
            for (Index k = l.start[p]; k < l.start[p + 1]; ++k) {
                if (l.depth[k] <= 0.0) continue;
                const double slope = l.gradient[k].norm();
                const Vec3 n = slope < 1e-9 ? Vec3::UnitZ() : Vec3(l.gradient[k] / slope);
                const Vec3& arm = l.arm[k];
                const Vec3 relative = v[a] + w[a].cross(arm) - velocity_b - spin_b.cross(to_b + arm);
                const Vec3 slide = relative - n.dot(relative) * n;
                const double weight = normal_total > 0.0 ? l.force[k] / normal_total : 0.0;
                const Vec3 ft = tangential_force(pair, normal_total / share, n, slide, 0.5 * (w[a] + spin_b).dot(n), root_mass, dt,
                                                 weight * share, l.spring[k], s);
                const Vec3 fn = l.force[k] * n;
                out.normal_force += fn;
                out.tangential_force += ft;
                out.torque_a += arm.cross(fn + ft);
                out.torque_b -= (to_b + arm).cross(fn + ft);
                out.arm += weight * arm;
                out.overlap = std::max(out.overlap, l.depth[k]);
                ++out.points;
            }
            error.hand_over(l.owed[p], Index(p), out, to_b, crossing);
            if (out.points == 0) continue;
            ++s.touching;
            s.max_overlap = std::max(s.max_overlap, out.overlap / std::min(equivalent[a], reach_b));
        }
        block_sums[base + first / node_grain] = s;
    });
}

void World::Impl::sum_forces()
{
    for (std::size_t i = 0; i < x.size(); ++i) {
        force[i].setZero();
        torque[i].setZero();
    }
    for (WallData& wall : walls) wall.force.setZero();
    const auto add_point = [&](const PointForce& c) {
        const Vec3 total = c.force * c.normal + c.tangential, moment = c.normal.cross(c.tangential);
        force[std::size_t(c.a)] += total;
        torque[std::size_t(c.a)] -= c.arm_a * moment;
        if (c.b < 0) {
            walls[std::size_t(-1 - c.b)].force -= total;
        } else {
            force[std::size_t(c.b)] -= total;
            torque[std::size_t(c.b)] -= c.arm_b * moment;
        }
    };
    const auto add_general = [&](const GeneralForce& c) {
        const Vec3 total = c.normal_force + c.tangential_force;
        force[std::size_t(c.a)] += total;
        torque[std::size_t(c.a)] += c.torque_a;
        if (c.b < 0) {
            walls[std::size_t(-1 - c.b)].force -= total;
        } else {
            force[std::size_t(c.b)] -= total;
            torque[std::size_t(c.b)] += c.torque_b;
        }
    };
    for (std::size_t block = 0; block < out_count[0].size(); ++block) {
        const PointForce* c = spheres.out.data() + spheres.row[block * row_grain];
        for (std::int32_t k = 0; k < out_count[0][block]; ++k) add_point(c[k]);
    }
    for (std::size_t block = 0; block < out_count[1].size(); ++block)
        for (std::int32_t k = 0; k < out_count[1][block]; ++k) add_point(sphere_walls.out[block * entry_grain + std::size_t(k)]);
    for (std::size_t block = 0; block < out_count[2].size(); ++block)
        for (std::int32_t k = 0; k < out_count[2][block]; ++k) add_general(sphere_grids.out[block * grid_grain + std::size_t(k)]);
    for (const GeneralForce& c : nodes.out)
        if (c.points > 0) add_general(c);
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
    counters.node_tests += std::int64_t(sphere_grids.sphere.size()) + sums.node_queries;
    counters.seconds_pairs += seconds_since(start);
}

void World::Impl::refresh_forces()
{
    if (!lists_valid) make_lists();
    if (forces_valid) return;
    const double before = sums.elastic_normal + sums.elastic_tangential;
    const double friction = dissipated_friction;
    node_drift = free_path * skin;  // whoever moved the bodies: every listed node is looked at
    v_end = v;
    compute_contacts(0.0);
    // What bodies put in, taken out or moved by the caller changed in the contacts is the caller's work.
    wall_work += sums.elastic_normal + sums.elastic_tangential - before + dissipated_friction - friction;
    forces_valid = true;
}

}  // namespace coral::dem
