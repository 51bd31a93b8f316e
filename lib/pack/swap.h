#pragma once
/// \file pack/swap.h
/// Other shapes for the grains of a packed sample: level sets by harmonics or spheres, spheres by angular polyhedra or harmonics.
/// Centres, orientations and volumes (or masses) stay; overlaps are relaxed without letting the skeleton move.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pack/sample.h"

namespace coral::pack {

struct SwapOptions {
    std::optional<ShapeKind> coarse, fine;  ///< what the grains of a role become; none: they stay as they are
    std::filesystem::path library;  ///< grains.sh.h5 or grains.vdb that shapes come from; empty: the sample's own coarse grains
    bool keep_mass = false;         ///< mass in place of apparent volume: porous grains become smaller when their voids are filled
    int degree = 10;                ///< of harmonics that are fitted here
    int faces = 26;                 ///< of polyhedra, at most
    int fine_nodes = 500;           ///< surface nodes of new fine shapes
    bool drop_trapped = false;      ///< fines whose centre a new coarse shape covers, now or while the sample relaxes, and those that stay deeper than the overlap limit are taken out; else the former are moved to its surface
    double limit = 0.15;            ///< refused: a coarse grain, or the mean of the fines, displaced by more of its diameter [-]
    double overlap_limit = 0;       ///< refused: an overlap that stays above this share of the smaller diameter [-]; 0: twice the sample's deepest, at least 5 %
    bool restore_pressure = false;  ///< walls move until each pair has the pressure it had
    int max_steps = 3000;           ///< of the damped run
};

struct Displacement {
    double mean = 0, median = 0, largest = 0;  ///< over the diameter of the grain [-]
    int grains = 0;
};

struct Overlaps {
    int contacts = 0;    ///< touching pairs, walls included
    int deep = 0;        ///< those deeper than 1 % of the smaller diameter
    double largest = 0;  ///< over the smaller diameter [-]
};

/// How the swap went. Grain numbers are those of the sample that came in.
struct SwapReport {
    int swapped_coarse = 0, swapped_fine = 0;  ///< grains with a new shape
    int new_shapes = 0;                        ///< templates made
    int smallest_faces = 0, largest_faces = 0; ///< of the polyhedra made
    std::vector<int> trapped;                  ///< fines whose centre lay in a filled void: taken out, or moved to the surface
    std::vector<int> wedged;                   ///< fines that found no place between the new shapes, taken out
    Displacement coarse, fine;                 ///< by the relaxation; those moved out of filled voids are left out
    Displacement loaded_fine;                  ///< of the fines that carried load before: two contacts or more, and more than their own weight
    Eigen::Vector3d strain = Eigen::Vector3d::Zero();  ///< of the box by moving walls, positive when it becomes smaller [-]
    int pushed_fines = 0;                      ///< fines displaced by more than the limit
    Overlaps before, swapped, after;           ///< of the sample, right after the swap, at the end
    int springs_before = 0, springs_kept = 0;  ///< friction springs of the sample, and those that the new shapes took over
    double mass_before = 0, mass_after = 0;    ///< of all grains that stay [kg]
    double pressure_before = 0, pressure_after = 0;  ///< mean over the walls [Pa]
    bool unchanged = false;                    ///< contact forces are those of before: nothing was relaxed
    int iterations = 0;                        ///< of the overdamped relaxation
    std::int64_t steps = 0;                    ///< of the damped run
    bool relaxed = false;                      ///< whether the damped run met its limits
    double kinetic_energy = 0;                 ///< at the end of the damped run [J]
    double unbalanced_ratio = 0;               ///< mean |contact forces + weight| on a touching grain / mean normal contact force [-]
    double shapes_seconds = 0, relaxation_seconds = 0;
    std::vector<std::string> warnings;
};

/// The same grains with other shapes, nothing relaxed: the shape frames stay where they are, so that the centre of mass of a grain
/// moves by what separates the centroids of its old and its new shape. Spheres become shapes drawn evenly from the library, turned so
/// that they touch what they touched as deep as before, and overlap nothing else, of about 900 orientations each; others keep their orientation and become the shape of their own number. Friction springs of pairs whose kind of contact stays
/// are kept: those of nodes go to the nearest new node.
/// \throws UsageError  nothing to swap, or a shape that cannot be made from what there is
/// \throws Error       a damaged library, a grain that harmonics cannot describe
Sample replace_shapes(const Sample& sample, const SwapOptions& options, std::uint64_t seed, SwapReport& report);

/// replace_shapes(), then fines out of filled voids, then relaxation and measurement:
/// 1. Overdamped: grains move by 0.2 of what would close a lone spring, at most a twentieth of their radius at a time; first fines
///    alone with coarse grains held, those still in the way turned anew, then all, until no overlap is larger than twice what the sample had,
///    at least 0.05 % of the diameter.
/// 2. Damped run at the true parameters, drag 200 sqrt(g/d) with d the smallest diameter, fines that carried nothing held up against gravity,
///    with walls that restore the pressures if asked to, until the unbalanced ratio is below 0.05 and the kinetic energy below 1e-4 of the elastic, at most `max_steps` steps. Grains are left at rest.
/// Nothing is relaxed when contact forces are those of before to 1e-9 of the largest.
/// The same sample, options and seed give the same result for any number of threads.
/// \param report  set anew
/// \throws Error  the swap would burst the sample: a displacement or an overlap above its limit, or a grain outside the walls
Sample swap_shapes(const Sample& sample, const SwapOptions& options, std::uint64_t seed, SwapReport& report);

}  // namespace coral::pack
