#include "pack/detail/phases.h"

namespace coral::pack::detail {

void MotionWindow::start(const dem::World& world)
{
    x_.assign(world.positions().begin(), world.positions().end());
    v_.assign(world.velocities().begin(), world.velocities().end());
    time_ = world.time();
}

MotionWindow::Means MotionWindow::means(const dem::World& world) const
{
    const double period = world.time() - time_;
    std::vector<char> touching(x_.size(), 0);
    double contact_force = 0;
    Means means;
    for (const dem::Contact& c : world.contacts()) {
        contact_force += c.normal_force.norm();
        ++means.contacts;
        touching[std::size_t(c.first)] = 1;
        if (c.second >= 0) touching[std::size_t(c.second)] = 1;
    }
    double net = 0, grains = 0, kinetic = 0;
    for (std::size_t i = 0; i < x_.size(); ++i) {
        const double m = world.mass(int(i));
        const Eigen::Vector3d velocity = (world.position(int(i)) - x_[i]) / period;
        means.speed += velocity.norm() / double(x_.size());
        kinetic += 0.5 * m * velocity.squaredNorm();
        if (!touching[i]) continue;
        net += m / period * (world.velocity(int(i)) - v_[i]).norm();
        grains += 1;
    }
    const dem::Energy energy = world.energy();
    const double elastic = energy.elastic_normal + energy.elastic_tangential;
    if (contact_force > 0) means.unbalanced_ratio = (net / grains) / (contact_force / means.contacts);
    if (elastic > 0) means.kinetic_ratio = kinetic / elastic;
    return means;
}

}  // namespace coral::pack::detail
