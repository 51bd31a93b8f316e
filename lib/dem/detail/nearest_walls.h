#pragma once
/// \file dem/detail/nearest_walls.h
/// Spheres on the nearest wall of a grid: found one after the other, pressed on it a register full at a time.
#include "dem/detail/impl.h"
#include "dem/detail/lanes.h"

namespace coral::dem::detail {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

/// Those of a block of the loop.
class NearestWalls {
public:
    NearestWalls(World::Impl& world, double dt, LoopSums& sums, std::vector<Crossing>& crossing) : w_(world), dt_(dt), sums_(sums), crossing_(crossing) {}

    /// Looks at pair k. \returns whether it touches; `out` is then written by the end of press()
    bool find(std::size_t k, GeneralForce& out);
    /// What was found and is not yet pressed.
    void press();
    void add_sums();

private:
    struct Found {
        std::size_t entry;  ///< in the list
        GeneralForce* out;
        double* spring;     ///< of the wall
        Vec3 offset;        ///< of the sphere from the grid
        Vec3 normal;        ///< frame of the grid
        double slope, overlap;
    };
    struct Pressed;
    void open(std::size_t k, GeneralForce& out);
    Pressed forces(const std::size_t* sphere, const std::size_t* grid) const;
    void keep_books(const Pressed& p);
    void put_out(const Pressed& p) const;

    World::Impl& w_;
    double dt_;
    LoopSums& sums_;
    std::vector<Crossing>& crossing_;
    Found found_[wide_lane_count];
    int count_ = 0;
    WideLanes stored_ = all<WideLanes>(0.0), stretched_ = stored_, friction_ = stored_, damping_ = stored_, deep_ = stored_, deepest_ = stored_;
};

#pragma GCC diagnostic pop

}  // namespace coral::dem::detail
