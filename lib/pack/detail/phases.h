#pragma once
/// \file pack/detail/phases.h
/// The phases of a packing (pack/pack.h), one function each.
#include <string>
#include <vector>

#include "dem/world.h"
#include "pack/detail/box.h"
#include "pack/detail/keeper.h"
#include "pack/pack.h"
#include "pack/populations.h"

namespace coral::pack::detail {

/// Scales all velocities by exp(-rate time): the drag that shortens settling. A split step of its own, every few steps.
void decay_velocities(dem::World& world, double rate, double time);

/// Mean motion over many steps. A fine held in a groove of a grain is pushed by one wall of the groove in one step and by the other in
/// the next (one query at its centre finds the nearest wall only), so the force of a single step says nothing about balance; its mean does.
class MotionWindow {
public:
    explicit MotionWindow(const dem::World& world) { start(world); }
    /// Begins a new window now.
    void start(const dem::World& world);

    struct Means {
        double unbalanced_ratio = 0;  ///< mean |m dv/T| of touching grains / mean normal contact force [-]; 0 without contacts
        double kinetic_ratio = 0;     ///< sum m |dx/T|^2 / 2 over the elastic energy [-]; 0 without contacts
        double speed = 0;             ///< mean |dx/T| [m/s]
        int contacts = 0;             ///< touching pairs, walls included
    };
    /// From the start of the window to now, T later. \pre at least one step was taken
    Means means(const dem::World& world) const;

private:
    std::vector<Eigen::Vector3d> x_, v_;
    double time_ = 0;
};

/// "unbalanced ratio 0.012, kinetic ratio 3e-04", for the progress line.
std::string describe(const MotionWindow::Means& means);

/// How far a value has come on its way down to a limit that it nears like an exponential; for the time left.
class Approach {
public:
    /// \param ratio  value over limit, the worst of several
    double share(double ratio);

private:
    double first_ = 0;
};

/// Servo of one pair of walls: closing speed of each wall [m/s] from the missing pressure [Pa].
/// \param gap  between the walls [m]; \param wall_contacts  on one of them; \param stiffness  of a contact [N/m]; \param mass  of the sample [kg]
double servo_speed(double missing, double area, double gap, int wall_contacts, double stiffness, double mass, double limit);
/// Share of that speed to take. Flat sides of grains on a wall are stiffer than contacts of spheres, by a factor that is not known beforehand: the
/// share is halved whenever the pressure has gone past its target by more than `allowed` [Pa] on both sides, and comes back by and by.
double servo_share(ServoGain& gain, double missing, double allowed);
/// Both walls of a pair close at this speed each, or the upper one alone at twice it [m/s].
void set_pair_speed(dem::World& world, const Box& box, int axis, double speed, bool both);
void stop_walls(dem::World& world, const Box& box);

/// Pours the grains: sets pose of every particle, and the smooth walls of the sample with the top one above the highest grain.
void pour(Grains& grains, const Spec& spec, std::uint64_t seed, Keeper& keeper);

/// Compresses to the target in a world built from the sample (bodies in its order).
void compress(dem::World& world, const Box& box, const Spec& spec, double apparent_volume, Keeper& keeper);

/// Comes to rest with walls that stand still. Returns the means of the last window.
MotionWindow::Means relax(dem::World& world, const Spec& spec, Keeper& keeper);

/// Poses, walls, contacts, springs, gradation, criteria and statistics of the final state; the lower corner moves to the origin.
void measure(const dem::World& world, const Box& box, const MotionWindow::Means& rest, double dem_step, std::int64_t steps, Sample& sample);

}  // namespace coral::pack::detail
