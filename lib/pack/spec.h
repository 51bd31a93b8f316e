#pragma once
/// \file pack/spec.h
/// The specification of a packing: what pack-sample reads (TOML). All keys, units and defaults are in docs/pack-spec.md.
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "pack/sample.h"

namespace coral::pack {

/// How the diameters of a population are drawn. `uniform` draws evenly in diameter **by number** between the two ends;
/// `table` inverts a gradation curve given **by mass** (log-linear between its points).
enum class Gradation { single, uniform, table };

/// Corners of a convex polyhedron: the hull of them, at the size of its file [m].
struct Corners {
    std::string name;  ///< of the mesh file, or "polyhedron"
    std::vector<Eigen::Vector3d> points;
};

/// One kind of grains.
struct Population {
    std::string name;
    Role role = Role::coarse;
    ShapeKind shape = ShapeKind::sphere;
    std::string location;              ///< "file:line:column" of its shape, for errors found later
    std::filesystem::path file;        ///< grains.vdb or grains.sh.h5; empty for other shapes
    std::vector<Corners> polyhedra;    ///< to draw from; only for `polyhedron`
    std::vector<std::filesystem::path> meshes;  ///< that they come from; empty with vertices
    Eigen::Vector3d radii = Eigen::Vector3d::Zero();      ///< of a superellipsoid [m]
    Eigen::Vector2d exponents = Eigen::Vector2d::Ones();  ///< of a superellipsoid: e1, e2 of Barr
    std::vector<std::int64_t> grains;  ///< ids to draw from; empty means all
    Gradation gradation = Gradation::single;
    double smallest = 0, largest = 0;  ///< diameters [m]; equal for `single`
    Psd psd;                           ///< for `table`
    bool own_size = false;             ///< no diameter given: grains keep the size of the file, times `scale` (not for spheres)
    double scale = 1;                  ///< of lengths; only with own_size [-]
    std::optional<std::int64_t> count;
    std::optional<double> mass_fraction;  ///< of the whole sample [-]
    std::string material = "default";
    int surface_nodes = 0;             ///< 0: 6000 for level-set, 2500 for others
    double grid_spacing = 0;           ///< of tabulated sh and superellipsoid shapes [m]; 0: equivalent diameter / 60
};

/// Grains are poured in alternating layers of coarse and fine; each layer settles before the next comes.
/// Softer contacts allow a longer step where gravity sets the pace; the final relaxation always has the true parameters.
struct Dropping {
    int layers = 0;                  ///< pairs of a coarse and a fine layer; 0: as many as the coarse grains need
    double drop_height = 0;          ///< gap between the highest settled grain and a new one [m]
    double friction = 0.1;           ///< sliding friction while grains settle [-]
    double damping = 0.5;            ///< contact damping ratio while grains settle [-]
    double stiffness_factor = 0.02;  ///< softens contacts while grains settle; the step grows by 1/sqrt of it [-]
    double drag = 10;                ///< rate at which velocities decay while grains settle [1/s]
    double unbalanced_ratio = 0.1;   ///< a layer has settled when the unbalanced ratio is below this ...
    double speed_ratio = 0.05;       ///< ... and the mean speed below this times sqrt(g d), d of the smallest grain
    double time_limit = 0.4;         ///< longest settling of one layer [s]
};

enum class CompressionTarget { none, pressure, void_ratio };

/// Which walls close in: all planes that there are, top and base alone (platens), or the top alone.
enum class MovingWalls { all, platens, top };

/// Walls move at true stiffness and density, then stand still for the final relaxation.
struct Compression {
    CompressionTarget target = CompressionTarget::none;
    double pressure = 0;             ///< [Pa]
    double void_ratio = 0;           ///< interparticle [-]
    MovingWalls walls = MovingWalls::all;
    double friction = -1;            ///< while walls move [-]; negative: the material's
    double max_velocity = 0.2;       ///< of a wall [m/s]
    double tolerance = 0.02;         ///< of the mean pressure of each pair of walls, relative [-]
    double unbalanced_ratio = 0.01;  ///< compression and final relaxation end below this ...
    double kinetic_ratio = 1e-4;     ///< ... and below this kinetic / elastic energy
    double time_limit = 0.5;         ///< compression, simulated time [s]
    double relaxation_limit = 0.2;   ///< final relaxation, simulated time [s]
    double drag = 50;                ///< rate at which velocities decay during compression and relaxation [1/s]
};

/// Void ratios of the densest and the loosest state, measured elsewhere (ISO 17892, ASTM D4253 and D4254): no packing can tell them.
struct DensityLimits {
    double e_min = 0, e_max = 0;     ///< [-]
};

struct Spec {
    std::string text;  ///< of the file
    Eigen::Vector3d size = Eigen::Vector3d::Zero();  ///< box the grains are dropped into, or around the cylinder; z is the height they should fill [m]
    bool cylinder = false;                             ///< of diameter size.x about z, in place of the box
    Eigen::Vector3d period = Eigen::Vector3d::Zero();  ///< of the sides without walls: that of `size`; else 0 [m]
    std::vector<Material> materials;
    std::vector<Population> populations;
    Dropping dropping;
    Compression compression;
    std::optional<DensityLimits> density;
    std::string box_location, box_key;  ///< "file:line:column" and name of the size of the box, for errors found later
    double dem_step = 0;     ///< [s]; 0: automatic
    bool force_step = false;   ///< takes a step above the critical one, too
    dem::SphereScheme sphere_scheme = dem::SphereScheme::automatic;
    std::string step_location;  ///< "file:line:column" of the step
    Eigen::Vector3d gravity = {0, 0, -9.81};
    std::vector<std::string> warnings;  ///< odd but allowed, for the user to read
};

/// Section of the box or cylinder [m2].
double base_area(const Spec& spec);

/// Reads and checks a specification; relative paths in it are relative to its folder.
/// \param grains  when given, takes the place of `file` in every level-set population
/// \throws UsageError with all errors at once, one a line
Spec read_spec(const std::filesystem::path& file, const std::filesystem::path& grains = {});

/// Multiplies the lengths of every population that keeps the size of its file.
/// \throws UsageError  when none does
void scale_grains(Spec& spec, double factor);

}  // namespace coral::pack
