#pragma once
/// \file dem/detail/presses.h
/// Spheres on grids and polyhedra: found one after the other, their forces worked a register full at a time.
#include "dem/detail/impl.h"
#include "dem/detail/lanes.h"

namespace coral::dem::detail {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

/// What a grid presses on a sphere: elastic forces by place on the sphere, each with its dashpot and friction spring.
struct Press {
    struct Place {
        Vec3 normal;  ///< frame of the grid
        double elastic, overlap;  ///< force [N]; what the arms are shortened by, half of it each [m]
        double* spring;
    };
    std::size_t entry;  ///< in the list
    GeneralForce* out;
    Vec3 offset;        ///< of the sphere from the grid
    double stored, overlap;
    int count;
    Place place[Slots::count];
};

/// Those of a block of the loop.
class Presses {
public:
    Presses(World::Impl& world, double dt, LoopSums& sums, std::vector<Crossing>& crossing) : w_(world), dt_(dt), sums_(sums), crossing_(crossing) {}

    /// Presses the sphere of pair k, seen so far from the grid and there in its frame and scale, on the nearest wall. \returns whether it touches; `out` is then written by the end of finish()
    bool on_nearest(std::size_t k, const Vec3& offset, const Vec3& local, GeneralForce& out);
    /// Room for a press with so many places; add() what was put there.
    Press& next(int count);
    void add(const Press& press);
    /// Pair k touches no more.
    void open(std::size_t k) { w_.open_press(k, dt_, sums_, crossing_); }
    /// Works what is left, and adds the sums.
    void finish();

private:
    static constexpr int full = wide_lane_count;
    /// Few have several places, and they would make the others wait.
    struct Group {
        int count = 0;
        Press press[full];
    };
    struct Forces;
    void work(Group& group);
    Forces forces(const Press* press) const;
    void add_place(const Press* press, int p, Forces& f) const;
    void put_out(const Press* press, int count, const Forces& f) const;
    void keep_books(const Press* press, int count, const Forces& f);

    World::Impl& w_;
    double dt_;
    LoopSums& sums_;
    std::vector<Crossing>& crossing_;
    Group one_, several_;
    WideLanes stored_ = all<WideLanes>(0.0), stretched_ = stored_, friction_ = stored_, damping_ = stored_, deep_ = stored_, deepest_ = stored_;
};

#pragma GCC diagnostic pop

}  // namespace coral::dem::detail
