#pragma once
/// \file pack/detail/swap.h
/// New templates for a swap (pack/swap.h), and the relaxation after it.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pack/detail/random.h"
#include "pack/sample.h"
#include "pack/swap.h"

namespace coral::pack::detail {

/// What a shape can be made from: a harmonic surface, the apparent level set, or points on the surface. Lengths as in the source.
struct Stone {
    std::int64_t id = 0;
    std::string name;
    int degree = 0;                    ///< of `coefficients`
    std::vector<double> coefficients;  ///< of harmonics; empty: to be fitted to `apparent`
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the harmonics, in the frame of the grain [m]
    double volume = 0;                                 ///< apparent [m3]
    std::shared_ptr<const sdf::DistanceGrid> apparent;
    std::vector<Eigen::Vector3d> points;
};

/// Number at the end of the name of a template ("grains.vdb grain_3"); none when there is none.
std::optional<std::int64_t> id_of(const std::string& name);

Stone stone_of(const ShapeTemplate& shape);

struct Library {
    std::vector<Stone> stones;
    History history;
};
/// All shapes of a .sh.h5 or .vdb file. \throws Error when damaged or empty
Library read_library(const std::filesystem::path& file);

/// A template, and where its origin (its centre of mass) lies in the frame of the stone [m].
struct NewShape {
    ShapeTemplate shape;
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

/// Harmonics of a stone with the body scaled to `volume` about its centre [m3].
/// \param reach  distance outside that contact queries [m]
/// \throws Error when fewer than nine tenths of the directions cross the surface once
NewShape harmonic_shape(const Stone& stone, double volume, int degree, double reach, int nodes, std::vector<std::string>& warnings);

/// Hull of a stone thinned to at most `faces` triangles, scaled to `volume`: starting from the points farthest along the axes, the point
/// farthest outside is taken in until the hull has as many corners as faces allow.
NewShape polyhedral_shape(const Stone& stone, double volume, int faces, int nodes);

/// Turns grains whose orientation is free, one after the other and several times over: of random turns, then of smaller and smaller ones from the best,
/// each takes the one in which it touches what it touched (the contacts of the sample) as deep as before and overlaps nothing else.
void turn_to_fit(Sample& sample, const std::vector<std::size_t>& grains, Random& random);

/// Whether two templates are the same body to contact, node for node.
bool same_template(const ShapeTemplate& a, const ShapeTemplate& b);

/// Springs of the old sample that mean the same between the new shapes.
/// \param origin  of the new frame of each grain in the old one, at the old scale [m]
/// \param is_new  whether a grain has a new shape
void keep_springs(const Sample& old, const std::vector<Eigen::Vector3d>& origin, const std::vector<char>& is_new, Sample& sample, SwapReport& report);

/// A sample with new shapes, nothing relaxed; its contacts are still those of the old shapes.
struct Replaced {
    Sample sample;
    std::vector<std::size_t> drawn;  ///< grains that were spheres: their orientation is free
    Random random;
};
Replaced replace(const Sample& sample, const SwapOptions& options, std::uint64_t seed, SwapReport& report);

/// Relaxes the new sample and measures it. `before` has the same grains; `moved_out` lies beside them.
/// Returns which fines found no place: with drop_trapped, any of them ends the work unmeasured, to be done again without them.
std::vector<char> relax_swapped(Replaced& swapped, const Sample& before, const std::vector<char>& moved_out, const SwapOptions& options, SwapReport& report);

}  // namespace coral::pack::detail
