#pragma once
/// \file morph/detail/closing.h
/// Fields of the ball closing of one grain, shared by its apparent shape and the list of its voids. Distances in units of c, the
/// geometric mean of the voxel edges.
#include <cmath>
#include <cstdint>
#include <vector>

#include "morph/components.h"
#include "morph/voids.h"
#include "morph/voxel_stack.h"

namespace coral::morph::detail {

double mean_edge(const Mask& mask);  ///< c [m]

/// The padded box of a grain with what a ball from outside reaches.
struct Closing {
    Mask box;                           ///< input with margin
    std::vector<float> squared;         ///< d^2 to the solid
    std::vector<std::uint8_t> outside;  ///< E: centres a ball from outside reaches
    double reach = 0;                   ///< R + c/2
    Eigen::Vector3i margin;
};

/// \param radius  of the ball [m]
Closing roll_ball(const Mask& solid, double radius);

/// Apparent shape in the padded box.
std::vector<std::uint8_t> unreached(const Closing& closing);

/// Throat transform, of every void voxel the ball does not reach.
struct Bottlenecks {
    std::vector<float> radius;          ///< b(x) = max over paths from the reached outside to x of the least d on the path; 0 elsewhere
    std::vector<std::uint32_t> saddle;  ///< first voxel on that path where d is least
};

/// By a bucket queue that starts at E. \throws Error when the box has more than 2^32 voxels
Bottlenecks bottlenecks(const Closing& closing);

/// Whether a void widens by more than c behind its bottleneck.
inline bool behind_constriction(float squared_distance, float bottleneck) { return std::sqrt(squared_distance) > bottleneck + 1.0F; }

/// The void inside the apparent shape, in 6-connected parts.
struct VoidParts {
    std::vector<std::uint8_t> open;  ///< per voxel: void that is 6-connected to the outside
    Components parts;                ///< of all void inside the apparent shape
    std::vector<std::uint8_t> counts;  ///< per part: whether it is a void rather than a dimple, see ApparentShape::void_count
};

/// \param voids, open  per voxel of the padded box
VoidParts void_parts(const Closing& closing, const std::vector<std::uint8_t>& voids, std::vector<std::uint8_t> open);

/// The parts that count, largest first (first voxel among equals).
/// \param paths  throat transform; may be empty when no void is open
std::vector<Void> describe_voids(const Closing& closing, const std::vector<std::uint8_t>& apparent, const VoidParts& parts,
                                 const Bottlenecks& paths);

}  // namespace coral::morph::detail
