#include "dem/world.h"

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/text.h"
#include "dem/detail/impl.h"

namespace coral::dem {

double restitution_of_damping(double damping)
{
    if (!(damping >= 0.0) || damping >= 1.0) throw Error("damping", to_text(damping) + " is not in [0, 1)", "give a ratio below 1");
    const double w = std::sqrt(1.0 - damping * damping);
    return std::exp(-damping / w * (std::numbers::pi - std::atan2(2.0 * damping * w, 1.0 - 2.0 * damping * damping)));
}

double damping_of_restitution(double restitution)
{
    if (!(restitution > 0.0) || restitution > 1.0)
        throw Error("restitution", to_text(restitution) + " is not in (0, 1]", "give the ratio of rebound to impact speed");
    double low = 0.0, high = 1.0 - 1e-12;
    for (int k = 0; k < 100; ++k) {
        const double middle = 0.5 * (low + high);
        (restitution_of_damping(middle) > restitution ? low : high) = middle;
    }
    return restitution == 1.0 ? 0.0 : 0.5 * (low + high);
}

// ---- Impl: small shared pieces ----

std::string World::Impl::name(std::size_t i) const { return "body " + std::to_string(i) + (role[i].empty() ? "" : " (" + role[i] + ")"); }

void World::Impl::update_laws()
{
    known_critical_step = -1.0;
    const std::size_t n = materials.size();
    const auto harmonic = [](double a, double b) { return a + b > 0.0 ? 2.0 * a * b / (a + b) : 0.0; };
    laws.assign(n * n, {});
    for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = 0; b < n; ++b) {
            const Material &s = materials[a], &t = materials[b];
            laws[a * n + b] = {harmonic(s.normal_stiffness, t.normal_stiffness), harmonic(s.tangential_stiffness, t.tangential_stiffness),
                               std::min(s.friction, t.friction), 0.5 * (s.damping + t.damping), 0.0, 0.0};
            PairLaw& law = laws[a * n + b];
            law.cn = 2.0 * law.damping * std::sqrt(law.kn);
            law.ct = 2.0 * law.damping * std::sqrt(law.kt);
        }
}

void World::Impl::update_mass(std::size_t i)
{
    known_critical_step = -1.0;
    const Shape& s = *shapes[std::size_t(shape[i])];
    const double c = scale[i];
    has_nodes[i] = s.kind() != ShapeKind::sphere;
    mass[i] = density[i] * s.volume() * c * c * c;
    principal[i] = density[i] * std::pow(c, 5) * s.principal_inertia();
    radius[i] = c * (has_nodes[i] ? s.bounding_radius() : s.radius());
    equivalent[i] = c * s.equivalent_radius();
    any_prescribed = any_prescribed || motion[i] == Motion::prescribed;
    const bool moves = free(i);
    inverse_mass[i] = moves ? 1.0 / mass[i] : 0.0;
    inverse_inertia[i] = moves ? 1.0 / principal[i].x() : 0.0;
}

void World::Impl::update_spin(std::size_t i)
{
    const Quat frame = q[i] * shapes[std::size_t(shape[i])]->principal_rotation();
    w[i] = frame * (frame.conjugate() * momentum[i]).cwiseQuotient(principal[i]);
}

void World::Impl::set_spin(std::size_t i, const Vec3& angular_velocity)
{
    w[i] = angular_velocity;
    const Quat frame = q[i] * shapes[std::size_t(shape[i])]->principal_rotation();
    momentum[i] = frame * (frame.conjugate() * angular_velocity).cwiseProduct(principal[i]);
}

Vec3 World::Impl::apply_inverse_inertia(std::size_t i, const Vec3& moment) const
{
    const Quat frame = q[i] * shapes[std::size_t(shape[i])]->principal_rotation();
    return frame * (frame.conjugate() * moment).cwiseQuotient(principal[i]);
}

double World::Impl::kinetic_energy(std::size_t i) const
{
    const double rotation = has_nodes[i] && motion[i] == Motion::free
                                ? momentum[i].dot(w[i])
                                : (has_nodes[i] ? w[i].dot(q[i] * shapes[std::size_t(shape[i])]->principal_rotation() *
                                                         (((q[i] * shapes[std::size_t(shape[i])]->principal_rotation()).conjugate() * w[i])
                                                              .cwiseProduct(principal[i])))
                                              : principal[i].x() * w[i].squaredNorm());
    return 0.5 * (mass[i] * v[i].squaredNorm() + rotation);
}

double World::Impl::kinetic_energy() const
{
    double sum = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i)
        if (in[i]) sum += kinetic_energy(i);
    return sum;
}

// ---- Building ----

World::World(const WorldOptions& options) : impl_(std::make_unique<Impl>())
{
    if (!options.gravity.allFinite()) throw Error("world", "gravity is no number", "give three finite numbers");
    for (int k = 0; k < 3; ++k) {
        const double length = options.period[k];
        if (!(length >= 0.0) || !std::isfinite(length)) throw Error("world", "periodic length " + to_text(length) + " m", "give a positive length, or 0");
        impl_->periodic.length[k] = length;
        impl_->periodic.inverse[k] = length > 0.0 ? 1.0 / length : 0.0;
        impl_->periodic.any = impl_->periodic.any || length > 0.0;
    }
    if (!(options.overlap_cap > 0.0) || !(options.step_fraction > 0.0) || !(options.skin >= 0.0))
        throw Error("world", "overlap cap, step fraction and skin must be positive", "leave them at their defaults");
    impl_->options = options;
}
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;
World::~World() = default;

int World::add_shape(std::shared_ptr<const Shape> shape)
{
    if (!shape) throw Error("shape", "is empty", "make it with Shape::sphere or Shape::grid");
    impl_->shapes.push_back(std::move(shape));
    return int(impl_->shapes.size()) - 1;
}

int World::add_material(const Material& m)
{
    const auto positive = [&](double value, const char* what, bool zero) {
        if (!(zero ? value >= 0.0 : value > 0.0) || !std::isfinite(value))
            throw Error("material '" + m.name + "'", std::string(what) + " is " + to_text(value), "give a positive number");
    };
    positive(m.density, "density", false);
    positive(m.normal_stiffness, "normal_stiffness", false);
    positive(m.tangential_stiffness, "tangential_stiffness", true);
    positive(m.friction, "friction", true);
    positive(m.damping, "damping", true);
    impl_->materials.push_back(m);
    impl_->update_laws();
    impl_->forces_valid = false;
    return int(impl_->materials.size()) - 1;
}

int World::add_body(const BodySpec& spec)
{
    Impl& m = *impl_;
    const std::string where = "body " + std::to_string(m.x.size());
    if (spec.shape < 0 || std::size_t(spec.shape) >= m.shapes.size()) throw Error(where, "has no shape " + std::to_string(spec.shape), "add the shape first");
    if (spec.material < 0 || std::size_t(spec.material) >= m.materials.size())
        throw Error(where, "has no material " + std::to_string(spec.material), "add the material first");
    if (!(spec.scale > 0.0) || !std::isfinite(spec.scale)) throw Error(where, "scale " + to_text(spec.scale) + " is not positive", "give a positive scale");
    if (!spec.position.allFinite() || !spec.velocity.allFinite() || !spec.angular_velocity.allFinite() || !spec.orientation.coeffs().allFinite() ||
        !(spec.orientation.norm() > 0.0))
        throw Error(where, "position, orientation or velocity is no number", "give finite numbers");
    const double density = spec.density.value_or(m.materials[std::size_t(spec.material)].density);
    if (!(density > 0.0) || !std::isfinite(density)) throw Error(where, "density " + to_text(density) + " is not positive", "give a positive density");
    m.x.push_back(spec.position);
    m.v.push_back(spec.motion == Motion::fixed ? Vec3(Vec3::Zero()) : spec.velocity);
    m.v_end.push_back(m.v.back());
    m.w.push_back(Vec3::Zero());
    m.w_before.push_back(Vec3::Zero());
    m.momentum.push_back(Vec3::Zero());
    m.q.push_back(spec.orientation.normalized());
    for (std::vector<Vec3>* zero : {&m.force, &m.torque, &m.external_force, &m.external_torque, &m.principal}) zero->push_back(Vec3::Zero());
    for (std::vector<double>* zero : {&m.mass, &m.inverse_mass, &m.inverse_inertia, &m.radius, &m.equivalent}) zero->push_back(0.0);
    m.scale.push_back(spec.scale);
    m.density.push_back(density);
    m.shape.push_back(spec.shape);
    m.material.push_back(spec.material);
    m.motion.push_back(spec.motion);
    m.in.push_back(1);
    m.has_nodes.push_back(0);
    m.role.push_back(spec.role);
    const std::size_t i = m.x.size() - 1;
    m.update_mass(i);
    m.set_spin(i, spec.motion == Motion::fixed ? Vec3(Vec3::Zero()) : spec.angular_velocity);
    ++m.active;
    if (m.ledger_started) m.wall_work += m.kinetic_energy(i);
    m.lists_valid = m.forces_valid = false;
    return int(i);
}

void World::remove_body(int body)
{
    Impl& m = *impl_;
    const std::size_t i = std::size_t(body);
    if (!m.in[i]) return;
    m.wall_work -= m.kinetic_energy(i);
    m.in[i] = 0;
    m.inverse_mass[i] = m.inverse_inertia[i] = 0.0;
    m.known_critical_step = -1.0;
    --m.active;
    m.lists_valid = m.forces_valid = false;
}

int World::add_plane(const Vec3& point, const Vec3& normal, int material)
{
    Impl& m = *impl_;
    const std::string where = "wall " + std::to_string(m.walls.size());
    if (material < 0 || std::size_t(material) >= m.materials.size()) throw Error(where, "has no material " + std::to_string(material), "add the material first");
    if (!point.allFinite() || !normal.allFinite() || !(normal.norm() > 0.0)) throw Error(where, "point or normal is no number or zero", "give finite numbers");
    WallData wall;
    wall.point = point;
    wall.normal = normal.normalized();
    wall.material = material;
    m.walls.push_back(wall);
    m.lists_valid = m.forces_valid = false;
    return int(m.walls.size()) - 1;
}

int World::add_box(const Vec3& lower, const Vec3& upper, int material)
{
    if (!((upper - lower).minCoeff() > 0.0)) throw Error("box", "its upper corner is not above its lower corner", "swap the corners");
    int first = -1;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {1.0, -1.0}) {
            const int id = add_plane(side > 0.0 ? lower : upper, side * Vec3::Unit(axis), material);
            if (first < 0) first = id;
        }
    return first;
}

int World::add_plate(double top, double thickness, double hole, double pitch, const Eigen::Vector2d& hole_centre, int material)
{
    Impl& m = *impl_;
    const std::string where = "plate (wall " + std::to_string(m.walls.size()) + ")";
    if (material < 0 || std::size_t(material) >= m.materials.size()) throw Error(where, "has no material " + std::to_string(material), "add the material first");
    if (!std::isfinite(top) || !hole_centre.allFinite()) throw Error(where, "z or hole centre is no number", "give finite numbers");
    if (!(thickness > 0.0) || !std::isfinite(thickness)) throw Error(where, "thickness " + to_text(thickness) + " m is not positive", "give a thickness");
    if (!(hole >= 0.0) || (hole > 0.0 && !(pitch > hole)))
        throw Error(where, "holes of " + to_text(hole) + " m at a pitch of " + to_text(pitch) + " m leave no plate", "make the pitch larger than the hole");
    WallData wall;
    wall.kind = WallData::Kind::plate;
    wall.point = {hole_centre.x(), hole_centre.y(), top};
    wall.material = material;
    wall.plate = {top, thickness, hole, hole > 0.0 ? pitch : 1.0, hole_centre};
    m.walls.push_back(wall);
    m.lists_valid = m.forces_valid = false;
    return int(m.walls.size()) - 1;
}

int World::add_cylinder(const Eigen::Vector2d& centre, double radius, int material)
{
    Impl& m = *impl_;
    const std::string where = "cylinder (wall " + std::to_string(m.walls.size()) + ")";
    if (material < 0 || std::size_t(material) >= m.materials.size()) throw Error(where, "has no material " + std::to_string(material), "add the material first");
    if (!centre.allFinite()) throw Error(where, "its axis is no number", "give finite numbers");
    if (!(radius > 0.0) || !std::isfinite(radius)) throw Error(where, "radius " + to_text(radius) + " m is not positive", "give a radius");
    WallData wall;
    wall.kind = WallData::Kind::cylinder;
    wall.point = {centre.x(), centre.y(), 0.0};
    wall.radius = radius;
    wall.material = material;
    m.walls.push_back(wall);
    m.lists_valid = m.forces_valid = false;
    return int(m.walls.size()) - 1;
}

// ---- Bodies ----

namespace {
std::size_t at(int body) { return std::size_t(body); }
}  // namespace

int World::body_count() const { return int(impl_->x.size()); }
int World::active_count() const { return impl_->active; }
bool World::active(int body) const { return impl_->in[at(body)] != 0; }
const Shape& World::shape(int body) const { return *impl_->shapes[at(impl_->shape[at(body)])]; }
int World::shape_id(int body) const { return impl_->shape[at(body)]; }
int World::material_id(int body) const { return impl_->material[at(body)]; }
const std::string& World::role(int body) const { return impl_->role[at(body)]; }
Motion World::motion(int body) const { return impl_->motion[at(body)]; }
double World::scale(int body) const { return impl_->scale[at(body)]; }
double World::mass(int body) const { return impl_->mass[at(body)]; }
double World::equivalent_radius(int body) const { return impl_->equivalent[at(body)]; }
double World::bounding_radius(int body) const { return impl_->radius[at(body)]; }
Eigen::Matrix3d World::inertia(int body) const
{
    const Eigen::Matrix3d axes = (impl_->q[at(body)] * shape(body).principal_rotation()).toRotationMatrix();
    return axes * impl_->principal[at(body)].asDiagonal() * axes.transpose();
}
std::span<const Vec3> World::positions() const { return impl_->x; }
std::span<const Vec3> World::velocities() const { return impl_->v; }
std::span<const Vec3> World::angular_velocities() const { return impl_->w; }
std::span<const Quat> World::orientations() const { return impl_->q; }
std::span<const Vec3> World::contact_forces() const { return impl_->force; }
std::span<const Vec3> World::contact_torques() const { return impl_->torque; }

void World::set_motion(int body, Motion motion)
{
    Impl& m = *impl_;
    m.motion[at(body)] = motion;
    m.update_mass(at(body));
    if (motion == Motion::fixed) set_velocity(body, Vec3::Zero(), Vec3::Zero());
    m.set_spin(at(body), m.w[at(body)]);
    m.lists_valid = m.forces_valid = false;
}

void World::set_pose(int body, const Vec3& position, const Quat& orientation)
{
    Impl& m = *impl_;
    const Vec3 spin = m.w[at(body)];
    const double before = m.kinetic_energy(at(body));
    m.x[at(body)] = position;
    m.q[at(body)] = orientation.normalized();
    m.set_spin(at(body), spin);
    m.wall_work += m.kinetic_energy(at(body)) - before;
    m.lists_valid = m.forces_valid = false;
}

void World::set_velocity(int body, const Vec3& velocity, const Vec3& angular_velocity)
{
    Impl& m = *impl_;
    const double before = m.kinetic_energy(at(body));
    m.v[at(body)] = velocity;
    m.set_spin(at(body), angular_velocity);
    m.wall_work += m.kinetic_energy(at(body)) - before;
}

void World::set_shape(int body, int shape, double scale)
{
    Impl& m = *impl_;
    if (shape < 0 || at(shape) >= m.shapes.size() || !(scale > 0.0)) throw Error(m.name(at(body)), "new shape or scale is not valid", "add the shape first");
    const double before = m.kinetic_energy(at(body));
    const Vec3 spin = m.w[at(body)];
    m.shape[at(body)] = shape;
    m.scale[at(body)] = scale;
    m.update_mass(at(body));
    m.set_spin(at(body), spin);
    m.wall_work += m.kinetic_energy(at(body)) - before;
    m.drop_contacts(body);
    m.lists_valid = m.forces_valid = false;
}

void World::set_external_force(int body, const Vec3& force, const Vec3& torque)
{
    impl_->any_external = impl_->any_external || !force.isZero(0.0) || !torque.isZero(0.0);
    impl_->external_force[at(body)] = force;
    impl_->external_torque[at(body)] = torque;
}

void World::set_added_mass(int body, const Vec3& added)
{
    impl_->added_mass.resize(impl_->x.size(), Vec3::Zero());
    impl_->added_mass[at(body)] = added;
}

void World::clear_external_forces()
{
    std::fill(impl_->external_force.begin(), impl_->external_force.end(), Vec3::Zero());
    std::fill(impl_->external_torque.begin(), impl_->external_torque.end(), Vec3::Zero());
    impl_->any_external = false;
}

// ---- Walls, settings, time ----

int World::wall_count() const { return int(impl_->walls.size()); }
void World::set_wall_velocity(int wall, const Vec3& velocity)
{
    WallData& data = impl_->walls[at(wall)];
    if (data.kind != WallData::Kind::plane && !velocity.isZero(0.0)) throw Error("wall " + std::to_string(wall), std::string("is a ") + (data.kind == WallData::Kind::plate ? "plate" : "cylinder") + " and does not move", "move planes only");
    data.velocity = velocity;
}
const Vec3& World::wall_velocity(int wall) const { return impl_->walls[at(wall)].velocity; }
Vec3 World::wall_point(int wall) const { return impl_->walls[at(wall)].point; }
Vec3 World::wall_normal(int wall) const { return impl_->walls[at(wall)].normal; }
const Vec3& World::wall_force(int wall) const { return impl_->walls[at(wall)].force; }
void World::set_gravity(const Vec3& gravity) { impl_->options.gravity = gravity; }
const Vec3& World::gravity() const { return impl_->options.gravity; }
const Vec3& World::period() const { return impl_->options.period; }
void World::set_friction(int material, double friction)
{
    impl_->materials[at(material)].friction = friction;
    impl_->update_laws();
}
const Material& World::material(int id) const { return impl_->materials[at(id)]; }
double World::time() const { return impl_->time; }
double World::critical_time_step() const { return impl_->critical_step(); }
double World::auto_time_step() const { return impl_->automatic_step(); }
const Counters& World::counters() const { return impl_->counters; }

}  // namespace coral::dem
