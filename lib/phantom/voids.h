#pragma once
/// \file phantom/voids.h
/// Voids inside a grain, after the skeleton of a coral: compartments divided by septa, each a sponge (level cut of a
/// Gaussian random field) that is either sealed by a skin or open to the outside; sealed chambers (spheres); and
/// channels (a straight cylinder from the outside to a blind ball) whose throat is known. Chambers and channels keep a
/// wall of solid around them.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "phantom/outline.h"
#include "phantom/waves.h"

namespace coral::phantom {

/// Lengths relative to the equivalent diameter of the grain.
struct VoidSpec {
    double porosity = 0.3;     ///< voids / apparent volume; 0 leaves the grain solid
    bool sponge = true;        ///< false: only chambers and channels, and the porosity is what they give
    double wavelength = 0.25;  ///< of the sponge: one void and one wall
    int compartments = 5;
    double open_share = 0.5;  ///< share of the compartments that are open to the outside
    double wall = 0.05;       ///< least thickness of skin, septa, and walls around chambers and channels
    int chambers = 1, channels = 1;
    std::array<double, 2> chamber_radius{0.06, 0.10};  ///< smallest, largest
    std::array<double, 2> channel_radius{0.06, 0.10};
};

struct Chamber {
    Eigen::Vector3d centre;  ///< grain axes [m]
    double radius;           ///< [m]
};

/// Half-line from `centre` along `direction` with radius `throat`, and a ball around its start.
struct Channel {
    Eigen::Vector3d centre, direction;
    double throat_radius, ball_radius;  ///< [m]; throat_radius < ball_radius
};

class Voids {
public:
    /// \throws UsageError when chambers and channels alone exceed the porosity or the walls leave too little room for
    /// it
    Voids(const VoidSpec& spec, const Outline& outline, RandomSource& random);

    const std::vector<Chamber>& chambers() const { return chambers_; }
    const std::vector<Channel>& channels() const { return channels_; }
    const WaveField& field() const { return field_; }
    /// Whether a point of depth `depth` >= 0 below the outline, where the field has value `f`, is void.
    bool is_void(const Eigen::Vector3d& point, double depth, float f) const
    {
        const Kind kind = classify(point, depth);
        return kind == Kind::empty || (kind == Kind::sponge && f > level_);
    }

private:
    enum class Kind { solid, sponge, empty };
    Kind classify(const Eigen::Vector3d& point, double depth) const;
    bool has_room(const Eigen::Vector3d& centre, double radius) const;
    void place_compartments(const VoidSpec& spec, RandomSource& random);
    void place_channels(const VoidSpec& spec, RandomSource& random);
    void place_chambers(const VoidSpec& spec, RandomSource& random);
    void choose_level(double porosity);

    const Outline& outline_;
    WaveField field_;
    double wall_;                         ///< [m]
    float level_ = 0;                     ///< the sponge is void where the field is above it
    std::vector<Eigen::Vector3d> seeds_;  ///< of the compartments (Voronoi cells)
    std::vector<bool> open_;              ///< per compartment
    std::vector<Chamber> chambers_;
    std::vector<Channel> channels_;
    std::vector<Eigen::Vector3d> surface_;
};

}  // namespace coral::phantom
