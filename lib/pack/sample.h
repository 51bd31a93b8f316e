#pragma once
/// \file pack/sample.h
/// A packed sample in memory, and its file sample.h5: bodies, self-contained shape templates, materials, walls, contacts with
/// their friction history, gradation, stability criteria, and the history of the run that made it.
/// SI units; z up; the box of the sample has its lower corner at the origin, so the sample rests on z = 0.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/record.h"
#include "dem/body.h"
#include "sdf/distance_grid.h"

namespace coral::pack {

enum class ShapeKind { sphere, level_set, sh, polyhedron, superellipsoid };
enum class Role : std::uint8_t { coarse, fine };

/// "sphere", "level-set", "sh", "polyhedron", "superellipsoid"; "coarse", "fine" (the words of specification and file).
std::string_view to_string(ShapeKind kind);
std::string_view to_string(Role role);

/// Shape shared by bodies, in its own frame: centre of mass at the origin, lengths at scale 1.
/// A sphere is a unit template: diameter 1 m, so that a body's `scale` is its diameter.
struct ShapeTemplate {
    ShapeKind kind = ShapeKind::sphere;
    std::string name;                 ///< where it came from, such as "grains.vdb grain_3"; "sphere" for the unit sphere
    double volume = 0;                ///< of the solid, intraparticle voids left out [m3]
    double apparent_volume = 0;       ///< voids filled [m3]
    double equivalent_diameter = 0;   ///< of the sphere of the apparent volume [m]
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about the centre of mass, at density 1 kg/m3 [m5]
    /// Distance on a dense lattice, exact in the whole range that contact queries [m]; null for spheres and polyhedra.
    std::shared_ptr<const sdf::DistanceGrid> grid;
    /// The same with voids filled, clamped to a narrow band: tells void from outside. Null for shapes without voids.
    std::shared_ptr<const sdf::DistanceGrid> apparent_grid;
    std::vector<Eigen::Vector3d> nodes;  ///< surface nodes, shape frame [m]; empty for spheres
    std::vector<double> node_areas;      ///< their tributary areas; they sum to the surface [m2]
    int degree = 0;                      ///< of the spherical harmonics; 0 for other kinds
    std::vector<Eigen::Vector3d> vertices;  ///< of a polyhedron, whose hull it is; shape frame [m]
    Eigen::Vector3d radii = Eigen::Vector3d::Zero();          ///< of a superellipsoid [m]
    Eigen::Vector2d exponents = Eigen::Vector2d::Ones();      ///< of a superellipsoid: e1, e2 of Barr
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();         ///< of the harmonics in the shape frame [m]
    std::vector<double> coefficients;    ///< (degree + 1)^2 real orthonormal coefficients of the radius [m], index l(l+1)+m
};

/// The contact law, touching pairs and friction springs are those of the discrete element world.
/// Contact::second and ContactSpring::second: >= 0 a particle, -1 - w wall w of Sample::walls.
using Material = dem::Material;
using Contact = dem::Contact;
using ContactSpring = dem::ContactSpring;

struct Particle {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();            ///< of the centre of mass [m]
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< shape frame to world
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();            ///< [m/s]
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();    ///< world frame [rad/s]
    std::int32_t shape = 0;     ///< index into Sample::shapes
    double scale = 1;           ///< multiplies the lengths of the template [-]; diameter in m for spheres
    Role role = Role::coarse;
    std::int32_t material = 0;  ///< index into Sample::materials
};

/// Plane wall of the box, whose normal points into the sample; or a cylinder about z around it.
struct Wall {
    std::string name;  ///< "x-", "x+", "y-", "y+", "z-", "z+"; "side" of a cylinder
    Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< [m]
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< [-]
    double friction = 0;  ///< of the wall during the packing [-]
    double pressure = 0;  ///< mean normal pressure of the bodies on the wall at the end of the packing [Pa]
    double radius = 0;    ///< of a cylinder whose axis, along `normal`, goes through `point`; 0: a plane [m]
};

/// Point of a gradation curve.
struct PsdPoint {
    double size = 0;     ///< equivalent diameter of the apparent shape [m]
    double passing = 0;  ///< mass fraction of grains not larger [-]
};
using Psd = std::vector<PsdPoint>;

/// One internal-stability criterion with its verdict.
struct Criterion {
    std::string name;        ///< "kezdi", "kenney-lau", "mao", ...
    double value = 0;        ///< [-]; NaN when it does not apply
    double threshold = 0;    ///< [-]
    std::string verdict;     ///< "stable", "unstable" or "not applicable"
    std::string definition;  ///< value, condition of stability and source in one line
};

/// Figures of the packing; stored as attributes of /statistics. NaN when they do not exist (no fines, say).
struct Statistics {
    double porosity = 0;                ///< pores between and inside grains / box volume [-]
    double interparticle_porosity = 0;  ///< pores between the apparent shapes only / box volume [-]
    double void_ratio = 0;              ///< porosity / (1 - porosity) [-]
    double interparticle_void_ratio = 0;
    double fines_content = 0;           ///< fine mass / total mass [-]
    double gap_ratio = 0;               ///< smallest coarse / largest fine diameter [-]
    double coordination = 0;            ///< 2 grain-grain contacts / grains [-]; walls not counted
    double coordination_coarse_coarse = 0;  ///< coarse neighbours of a coarse grain, mean
    double coordination_coarse_fine = 0;    ///< fine neighbours of a coarse grain, mean
    double coordination_fine_coarse = 0;    ///< coarse neighbours of a fine grain, mean
    double coordination_fine_fine = 0;      ///< fine neighbours of a fine grain, mean
    double rattler_fraction = 0;        ///< grains with fewer than two contacts (walls counted) / grains [-]
    double kinetic_ratio = 0;           ///< kinetic energy of the mean motion over the last 500 steps / elastic energy of the contacts [-]
    double kinetic_energy = 0;          ///< of the last step [J]
    double unbalanced_ratio = 0;        ///< mean |net force| on a touching grain, mean over 500 steps / mean normal contact force [-]
    double mean_pressure = 0;           ///< over the walls; a cylinder counts as the four sides of a box [Pa]
    double max_overlap = 0;             ///< greatest depth / equivalent diameter of the smaller grain [-]
    double max_wall_overlap = 0;
    double dem_steps = 0;               ///< steps of the whole packing
    double dem_step = 0;                ///< of the final relaxation [s]
};

struct Sample {
    std::vector<Particle> particles;
    std::vector<ShapeTemplate> shapes;
    std::vector<Material> materials;
    Eigen::Vector3d size = Eigen::Vector3d::Zero();     ///< box from the origin to here; around a cylinder it is the least one [m]
    /// Lengths after which the sample repeats itself along x, y, z, those of the box; 0: it has walls there [m]. Positions lie within.
    Eigen::Vector3d period = Eigen::Vector3d::Zero();
    Eigen::Vector3d gravity = {0, 0, -9.81};            ///< in the final state [m/s2]
    std::vector<Wall> walls;
    std::vector<Contact> contacts;
    std::vector<ContactSpring> springs;
    Psd psd;
    std::vector<Criterion> criteria;
    Statistics statistics;
    History history;
};

/// Mass [kg], solid volume [m3], apparent volume [m3] and equivalent diameter [m] of one particle (template times scale).
double mass(const Sample& sample, const Particle& particle);
double volume(const Sample& sample, const Particle& particle);
double apparent_volume(const Sample& sample, const Particle& particle);
double equivalent_diameter(const Sample& sample, const Particle& particle);

/// The cylinder around the sample; null for a box.
const Wall* cylinder(const Sample& sample);
/// Space within the walls [m3].
double enclosed_volume(const Sample& sample);
/// Difference of two positions, by the nearest image in a periodic sample.
Eigen::Vector3d nearest_image(const Sample& sample, Eigen::Vector3d difference);
/// "60 mm x 60 mm x 58 mm, periodic along x and y", "a cylinder of 50 mm, 42 mm high".
std::string describe_enclosure(const Sample& sample);
/// One clear refusal for what takes boxes with six walls only.
/// \throws Error  a cylinder: \p who cannot take it, and what to do
void refuse_cylinder(const Sample& sample, const std::string& who);

/// Unit template of spheres (diameter 1 m).
ShapeTemplate unit_sphere();

/// Writes sample.h5; the file appears whole or not at all, with the same bytes for the same sample. Layout: docs/pack-spec.md.
/// \throws Error when it cannot be written, or when an index of the sample points nowhere
void write_sample(const Sample& sample, const std::filesystem::path& file);

/// What is read of a sample: the lattices with voids filled take as much memory as those of the solid, and contact and flow do without.
enum class SampleDetail { all, without_apparent_grids };

/// Reads sample.h5 back bit for bit; checks sizes, indices and finite numbers before it believes them.
/// \throws Error naming file and dataset
Sample read_sample(const std::filesystem::path& file, SampleDetail detail = SampleDetail::all);

}  // namespace coral::pack
