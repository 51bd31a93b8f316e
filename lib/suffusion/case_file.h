#pragma once
/// \file suffusion/case_file.h
/// A case as its case.toml describes it, checked and in SI. What the file does not name is left out of the run:
/// no [fluid] is dry DEM, no [[body]] and no sample is fluid only.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dem/body.h"
#include "fluid/flow_field.h"

namespace coral::suffusion {

enum class BoundaryKind { slip, wall, inlet, outlet, periodic };
enum class BodyMotion { free, fixed, prescribed };
enum class Scheme { automatic, resolved, semi_resolved, unresolved };
enum class ShapeKind { sphere, level_set, harmonics, polyhedron, superellipsoid };
enum class WallKind { plane, plate, box };

/// Faces in the order x- x+ y- y+ z- z+.
inline constexpr std::array<const char*, 6> face_names{"x-", "x+", "y-", "y+", "z-", "z+"};

struct FaceCondition {
    BoundaryKind kind = BoundaryKind::slip;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< inlet, and moving walls [m/s]
    double pressure = 0;                                 ///< outlet [Pa]
};

struct DomainSpec {
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< [m]
    Eigen::Vector3d size = Eigen::Vector3d::Zero();    ///< [m]
    double cell = 0;                                   ///< edge of the cubic cells [m]; 0 without fluid
    Eigen::Vector3i cells = Eigen::Vector3i::Zero();
};

struct FluidSpec {
    double density = 1000;              ///< [kg/m3]
    double kinematic_viscosity = 1e-6;  ///< [m2/s]
    Eigen::Vector3d body_acceleration = Eigen::Vector3d::Zero();  ///< on the fluid only [m/s2]
    Eigen::Vector3d initial_velocity = Eigen::Vector3d::Zero();   ///< [m/s]
    std::string drag = "gidaspow";               ///< a name of fluid::drag_law_names()
    std::string self_disturbance = "removed";    ///< removed | volume-removed | kept: fluid::SelfDisturbance
    fluid::Precision precision = fluid::Precision::float64;  ///< of the fields of the flow
    std::array<double, 2> kernel_support{2, 4};  ///< diameters of the volume and the felt kernel over that of the grain
};

struct MaterialSpec {
    double density = 2780;               ///< [kg/m3]
    double normal_stiffness = 2e5;       ///< [N/m]
    double tangential_stiffness = 1e5;   ///< [N/m]
    double friction = 0.7;
    double damping = 0.3;                ///< damping ratio
};

struct BodySpec {
    ShapeKind shape = ShapeKind::sphere;
    double diameter = 0;         ///< sphere [m]
    std::filesystem::path file;  ///< level-set: .vdb, sh: .sh.h5, polyhedron: mesh
    std::string grid;            ///< grid of the .vdb, or id in the .sh.h5
    double mesh_unit = 0;        ///< of the coordinates of a polyhedron's mesh [m]
    std::vector<Eigen::Vector3d> vertices;                       ///< polyhedron without a file; their hull counts [m]
    Eigen::Vector3d radii = Eigen::Vector3d::Zero();             ///< superellipsoid [m]
    std::array<double, 2> exponents{1, 1};                       ///< superellipsoid: e1, e2 of Barr
    double scale = 1;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();          ///< centre of mass [m]
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< [m/s]
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
    std::optional<double> density;                               ///< [kg/m3]; else that of the material
    std::string material = "default";
    std::string role = "coarse";
    BodyMotion motion = BodyMotion::free;
    Scheme scheme = Scheme::automatic;
    std::string location;  ///< "case.toml:12:1", for errors found later
};

struct WallSpec {
    WallKind kind = WallKind::plane;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< plane [m]
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< plane, towards the grains
    double z = 0;          ///< plate: upper face [m]
    double hole = 0;       ///< plate: edge of the square holes [m]
    double pitch = 0;      ///< plate: distance of hole centres [m]
    double thickness = 0;  ///< plate, downwards from z [m]
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< box: lower corner [m]
    Eigen::Vector3d size = Eigen::Vector3d::Zero();    ///< box [m]
    std::string material = "default";
};

enum class FlowScheme { automatic, adams_bashforth, runge_kutta };

struct TimeSpec {
    double duration = 0;    ///< [s]
    double dem_step = 0;    ///< [s]; 0 is automatic
    double cfl = 0.5;       ///< of Adams-Bashforth; Runge-Kutta takes fluid::runge_kutta_reach times the step
    FlowScheme flow_scheme = FlowScheme::automatic;  ///< automatic: Runge-Kutta where fines are coupled, their exchange costs more than two evaluations
    double max_step = 1e-3; ///< upper bound of the flow step [s]; start-up errors grow above it
};

struct OutputSpec {
    double interval = 0;          ///< series [s]
    double frames = 0;            ///< fields and bodies for viewing [s]; 0 is none
    double checkpoint = 60;       ///< wall time between checkpoints [s]
    int layers = 3;                 ///< of equal height, in which fines are counted
    bool track_all = true;
    std::vector<std::size_t> track;  ///< body numbers in file order, sample first
};

struct Case {
    std::filesystem::path folder;  ///< of case.toml; relative paths start here
    std::string text;              ///< case.toml as read
    std::optional<std::filesystem::path> sample;
    std::optional<DomainSpec> domain;
    std::array<FaceCondition, 6> boundary{};
    std::optional<FluidSpec> fluid;
    Eigen::Vector3d gravity{0, 0, -9.81};  ///< [m/s2]
    dem::SphereScheme sphere_scheme = dem::SphereScheme::automatic;  ///< [contact] spheres
    /// Whether the file has [material.default]; otherwise grains of a sample keep the sample's materials.
    bool overrides_material = false;
    std::map<std::string, MaterialSpec> materials;
    std::vector<BodySpec> bodies;
    std::vector<WallSpec> walls;
    /// Override of a sample's populations: [scheme] coarse = "resolved".
    std::map<std::string, Scheme> scheme_of_role;
    std::map<std::string, BodyMotion> motion_of_role;
    TimeSpec time;
    OutputSpec output;

    const WallSpec* plate() const;  ///< the filter plate, or null
    /// Axis of the mean flow: of the inlet, else of the body acceleration, else z. 0, 1 or 2.
    int flow_axis() const;
};

/// Reads a folder with case.toml, or a .toml file.
/// \throws UsageError with all errors of the file at once: unknown keys, bad values, unpaired periodic faces, sizes that are no whole
///         number of cells, an inlet that is closed or has no outlet
Case read_case(const std::filesystem::path& path);

}  // namespace coral::suffusion
