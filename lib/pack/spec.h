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

/// One kind of grains.
struct Population {
    std::string name;
    Role role = Role::coarse;
    ShapeKind shape = ShapeKind::sphere;
    std::filesystem::path file;        ///< grains.vdb or grains.sh.h5; empty for spheres
    std::vector<std::int64_t> grains;  ///< ids to draw from; empty means all
    Gradation gradation = Gradation::single;
    double smallest = 0, largest = 0;  ///< diameters [m]; equal for `single`
    Psd psd;                           ///< for `table`
    bool own_size = false;             ///< no diameter given: grains keep the size of the file (level-set and sh only)
    std::optional<std::int64_t> count;
    std::optional<double> mass_fraction;  ///< of the whole sample [-]
    std::string material = "default";
    int surface_nodes = 0;             ///< 0: 6000 for level-set, 2500 for sh
    double grid_spacing = 0;           ///< of tabulated sh shapes [m]; 0: equivalent diameter / 60
};

struct Dropping {
    int layers = 0;                 ///< pairs of a coarse and a fine layer; 0: from the box and the grains
    double drop_height = 0;         ///< gap between the settled surface and the lowest new grain [m]; 0: half the largest fine
    double friction = 0.1;          ///< sliding friction while grains settle [-]
    double damping = 0.5;           ///< contact damping ratio while grains settle [-]
    double stiffness_factor = 0.05; ///< softening of contacts while grains settle; the step grows by 1/sqrt of it
    double drag = 20;               ///< viscous damping rate of velocities while grains settle [1/s]
    double unbalanced_ratio = 0.05; ///< a layer has settled below this
    double kinetic_ratio = 0.1;     ///< and below this mean speed over sqrt(g d)
    double time_limit = 0.2;        ///< longest settling of one layer, then the next is dropped [s]
};

enum class CompressionTarget { none, pressure, void_ratio };

struct Compression {
    CompressionTarget target = CompressionTarget::none;
    double pressure = 0;             ///< [Pa]
    double void_ratio = 0;           ///< interparticle [-]
    double friction = -1;            ///< while walls move [-]; negative: the material's
    double stiffness_factor = 0.05;  ///< while walls move far from the target
    double max_velocity = 0.1;       ///< of a wall [m/s]
    double tolerance = 0.02;         ///< of the pressure on each wall, relative
    double unbalanced_ratio = 1e-2;  ///< final relaxation ends below this
    double kinetic_ratio = 1e-4;     ///< and below this kinetic / elastic energy
    double time_limit = 0.5;         ///< of the compression, simulated [s]
    double gravity_factor = 0;       ///< share of gravity acting during compression and relaxation [-]
};

struct Spec {
    Eigen::Vector3d size = Eigen::Vector3d::Zero();  ///< box, z is only the ground plan's height when nothing is compressed [m]
    std::vector<Material> materials;
    std::vector<Population> populations;
    Dropping dropping;
    Compression compression;
    double dem_step = 0;     ///< [s]; 0: automatic
    double step_factor = 0.2;///< of the automatic step: omega dt at the stiffest contact [-]
    Eigen::Vector3d gravity = {0, 0, -9.81};
    std::vector<std::string> warnings;  ///< odd but allowed, for the user to read
};

/// Reads and checks a specification; relative paths in it are relative to its folder.
/// \throws UsageError with all errors at once, one a line
Spec read_spec(const std::filesystem::path& file);

}  // namespace coral::pack
