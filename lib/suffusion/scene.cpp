#include "suffusion/scene.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"
#include "pack/sample.h"
#include "pack/sample_world.h"
#include "suffusion/shapes.h"

namespace coral::suffusion {

namespace {

dem::Motion motion_of(BodyMotion motion)
{
    return motion == BodyMotion::free ? dem::Motion::free : motion == BodyMotion::fixed ? dem::Motion::fixed : dem::Motion::prescribed;
}

dem::Material material_of(const std::string& name, const MaterialSpec& spec)
{
    return {name, spec.density, spec.normal_stiffness, spec.tangential_stiffness, spec.friction, spec.damping};
}

/// Largest sphere of the case [m]: grids must answer distances that far outside.
double largest_sphere_radius(const Case& description)
{
    double radius = 0;
    for (const BodySpec& body : description.bodies)
        if (body.shape == ShapeKind::sphere) radius = std::max(radius, 0.5 * body.diameter * body.scale);
    return radius;
}

/// Bodies of the sample and the friction of their contacts; its walls are those of the packing and stay out.
void add_sample(Scene& scene, pack::Sample& sample)
{
    const Case& c = scene.description;
    pack::refuse_cylinder(sample, "suffuse");
    scene.history = sample.history;
    if (c.overrides_material)
        for (pack::Material& m : sample.materials) m = material_of(m.name, c.materials.at("default"));
    const pack::SampleIds ids = pack::add_sample(scene.world, sample, {});
    pack::restore_springs(scene.world, sample, ids);
    for (const int body : ids.bodies) {
        const std::string& role = scene.world.role(body);
        if (const auto motion = c.motion_of_role.find(role); motion != c.motion_of_role.end()) scene.world.set_motion(body, motion_of(motion->second));
        const auto scheme = c.scheme_of_role.find(role);
        scene.bodies.push_back({scheme == c.scheme_of_role.end() ? Scheme::automatic : scheme->second});
    }
}

/// Histories of the files of shapes, after that of the sample; a step that several files share is told once.
void add_histories(Scene& scene)
{
    std::set<std::filesystem::path> files;
    std::set<std::string> told;
    for (const RecordEntry& step : scene.history) told.insert(to_json(History{step}));
    for (const BodySpec& body : scene.description.bodies) {
        if (body.file.empty() || !files.insert(body.file).second) continue;
        for (const RecordEntry& step : shape_history(body, scene.description.folder))
            if (told.insert(to_json(History{step})).second) scene.history.push_back(step);
    }
}

void add_bodies(Scene& scene, const std::map<std::string, int>& materials)
{
    const Case& c = scene.description;
    const double reach = largest_sphere_radius(c);
    std::map<std::string, int> shapes;
    for (const BodySpec& spec : c.bodies) {
        // Shapes are shared by all bodies that ask for the same; the reach is in metres of the unscaled shape.
        const std::string key = shape_key(spec);
        if (!shapes.contains(key)) shapes[key] = scene.world.add_shape(make_shape(spec, c.folder, reach / std::min(1.0, spec.scale)));
        dem::BodySpec body;
        body.shape = shapes[key];
        body.material = materials.at(spec.material);
        body.role = spec.role;
        body.scale = spec.shape == ShapeKind::sphere ? spec.diameter * spec.scale : spec.scale;
        body.position = spec.position;
        body.orientation = spec.orientation;
        if (spec.motion != BodyMotion::fixed) body.velocity = spec.velocity, body.angular_velocity = spec.angular_velocity;
        body.motion = motion_of(spec.motion);
        body.density = spec.density;
        scene.world.add_body(body);
        const auto of_role = c.scheme_of_role.find(spec.role);
        const bool by_role = spec.scheme == Scheme::automatic && of_role != c.scheme_of_role.end();
        scene.bodies.push_back({by_role ? of_role->second : spec.scheme});
    }
}

void add_walls(Scene& scene, const std::map<std::string, int>& materials)
{
    const Case& c = scene.description;
    for (const WallSpec& wall : c.walls) {
        const int material = materials.at(wall.material);
        if (wall.kind == WallKind::plane) scene.world.add_plane(wall.point, wall.normal, material);
        else if (wall.kind == WallKind::box) scene.world.add_box(wall.origin, wall.origin + wall.size, material);
        else scene.world.add_plate(wall.z, wall.thickness, wall.hole, wall.pitch, scene.hole_centre(), material);
    }
    if (!c.domain) return;
    for (int face = 0; face < 6; ++face) {
        const BoundaryKind kind = c.boundary[face].kind;
        if (kind == BoundaryKind::periodic || kind == BoundaryKind::outlet) continue;  // grains leave through an outlet
        const Eigen::Vector3d inward = Eigen::Vector3d::Unit(face / 2) * (face % 2 == 0 ? 1 : -1);
        scene.world.add_plane(face % 2 == 0 ? c.domain->origin : c.domain->origin + c.domain->size, inward, 0);
    }
}

void describe_bodies(Scene& scene)
{
    const Case& c = scene.description;
    dem::World& world = scene.world;
    std::map<int, int> shape_with_voids;  // shape -> one body of it
    for (int i = 0; i < world.body_count(); ++i) {
        BodyInfo& info = scene.bodies[static_cast<std::size_t>(i)];
        info.fine = world.role(i) == "fine";
        info.coarse = world.role(i) == "coarse";
        info.diameter = 2 * world.equivalent_radius(i);
        info.volume = world.shape(i).volume() * std::pow(world.scale(i), 3);
        info.mass = world.mass(i);
        if (info.scheme == Scheme::automatic) info.scheme = c.fluid ? scheme_for(info.diameter, c.domain->cell) : Scheme::resolved;
        const dem::Shape& shape = world.shape(i);
        if (shape.kind() == dem::ShapeKind::grid && shape.apparent_volume() > 1.001 * shape.volume()) shape_with_voids.emplace(world.shape_id(i), i);
    }
    std::vector<std::pair<int, int>> jobs(shape_with_voids.begin(), shape_with_voids.end());
    scene.apparent_shapes.resize(jobs.size());
    if (c.fluid)
        parallel_blocks(jobs.size(), 1, [&](std::size_t begin, std::size_t) {
            const dem::Shape& shape = world.shape(jobs[begin].second);
            scene.apparent_shapes[begin] = std::make_unique<ApparentShape>(shape.distance_grid(), 2 * shape.equivalent_radius());
        });
    for (int i = 0; i < world.body_count(); ++i)
        for (std::size_t job = 0; job < jobs.size(); ++job)
            if (jobs[job].first == world.shape_id(i)) scene.bodies[static_cast<std::size_t>(i)].apparent = scene.apparent_shapes[job].get();
}

void find_extent(Scene& scene)
{
    const dem::World& world = scene.world;
    if (world.body_count() == 0) return;
    scene.lower.setConstant(std::numeric_limits<double>::infinity());
    scene.upper = -scene.lower;
    for (int i = 0; i < world.body_count(); ++i) {
        // A grain reaches about as far as the sphere of its volume; the bounding sphere of a long one would overstate the bed.
        const double radius = world.equivalent_radius(i);
        scene.lower = scene.lower.cwiseMin((world.position(i).array() - radius).matrix());
        scene.upper = scene.upper.cwiseMax((world.position(i).array() + radius).matrix());
    }
    if (const WallSpec* plate = scene.description.plate()) scene.lower.z() = std::max(scene.lower.z(), plate->z);
}

dem::World make_world(const Case& c, const Eigen::Vector3d& period)
{
    dem::WorldOptions options;
    options.gravity = c.gravity;
    options.sphere_scheme = c.sphere_scheme;
    options.period = period;
    return dem::World(options);
}

}  // namespace

Eigen::Vector3d Scene::period() const
{
    Eigen::Vector3d period = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis)
        if (description.domain && description.boundary[2 * axis].kind == BoundaryKind::periodic) period[axis] = description.domain->size[axis];
    return period;
}

Eigen::Vector3d Scene::wrapped(Eigen::Vector3d x) const
{
    const Eigen::Vector3d length = period();
    for (int axis = 0; axis < 3; ++axis)
        if (length[axis] > 0) x[axis] -= length[axis] * std::floor((x[axis] - description.domain->origin[axis]) / length[axis]);
    return x;
}

Eigen::Vector3d Scene::nearest_image(Eigen::Vector3d r) const
{
    const Eigen::Vector3d length = period();
    for (int axis = 0; axis < 3; ++axis)
        if (length[axis] > 0) r[axis] -= length[axis] * std::nearbyint(r[axis] / length[axis]);
    return r;
}

Eigen::Vector2d Scene::hole_centre() const
{
    const WallSpec* plate = description.plate();
    const Eigen::Vector3d corner = description.domain ? description.domain->origin : Eigen::Vector3d::Zero().eval();
    return corner.head<2>().array() + 0.5 * (plate ? plate->pitch : 0);
}

Scheme scheme_for(double diameter, double cell)
{
    const double ratio = diameter / cell;
    return ratio > 8 ? Scheme::resolved : ratio >= 1.0 / 3 ? Scheme::semi_resolved : Scheme::unresolved;
}

std::string_view to_string(Scheme scheme)
{
    static constexpr std::array<std::string_view, 4> names{"auto", "resolved", "semi-resolved", "unresolved"};
    return names[static_cast<std::size_t>(scheme)];
}

std::unique_ptr<Scene> build_scene(Case description)
{
    auto scene = std::make_unique<Scene>(std::move(description));
    scene->world = make_world(scene->description, scene->period());
    std::optional<pack::Sample> sample;
    if (scene->description.sample) sample = pack::read_sample(*scene->description.sample, pack::SampleDetail::without_apparent_grids);
    if (sample && !scene->description.overrides_material) {
        const pack::Material& m = sample->materials.at(0);
        scene->description.materials["default"] = {m.density, m.normal_stiffness, m.tangential_stiffness, m.friction, m.damping};
    }
    std::map<std::string, int> materials;
    materials["default"] = scene->world.add_material(material_of("default", scene->description.materials.at("default")));
    for (const auto& [name, spec] : scene->description.materials)
        if (name != "default") materials[name] = scene->world.add_material(material_of(name, spec));
    if (sample) add_sample(*scene, *sample);
    add_bodies(*scene, materials);
    add_histories(*scene);
    add_walls(*scene, materials);
    describe_bodies(*scene);
    find_extent(*scene);
    for (const std::size_t body : scene->description.output.track)
        if (body >= scene->bodies.size())
            throw UsageError("output.track", "names body " + std::to_string(body) + " and the case has " + std::to_string(scene->bodies.size()),
                             "bodies are counted from 0, those of the sample first");
    return scene;
}

}  // namespace coral::suffusion
