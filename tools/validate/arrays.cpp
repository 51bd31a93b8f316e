// Periodic arrays of fixed spheres in Stokes flow: drag factor K in F = 6 pi mu a K U, U the superficial velocity, F with the mean pressure gradient's part.
#include "validate/arrays.h"

#include <fmt/format.h>

#include <numbers>
#include <optional>
#include <random>

#include "validate/check.h"
#include "validate/flow_start.h"

namespace coral::validate {

namespace {

using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

/// Places of the spheres of a cubic cell of unit edge, moved off the grid points.
std::vector<Vector3d> lattice_points(Lattice lattice, const Vector3d& shift)
{
    std::vector<Vector3d> points{{0, 0, 0}};
    if (lattice == Lattice::body_centred) points.push_back({0.5, 0.5, 0.5});
    if (lattice == Lattice::face_centred) points.insert(points.end(), {{0.5, 0.5, 0}, {0.5, 0, 0.5}, {0, 0.5, 0.5}});
    for (Vector3d& p : points) p += shift;
    return points;
}

fluid::GridSpec unit_cell(int cells)
{
    fluid::GridSpec grid;
    grid.cells.setConstant(cells);
    grid.cell = 1.0 / cells;
    for (fluid::Boundary& side : grid.boundary) side.kind = fluid::BoundaryKind::periodic;
    return grid;
}

fluid::FlowOptions creeping()
{
    fluid::FlowOptions options = flow_options();
    options.density = 1;
    options.kinematic_viscosity = 1;
    options.convection = fluid::Convection::none;
    return options;
}

}  // namespace

ArrayFlow::ArrayFlow(const std::vector<Vector3d>& centres, double diameter, int cells, const fluid::ForcingOptions& forcing)
    : flow_(unit_cell(cells), creeping()), bodies_(flow_.grid(), forcing), diameter_(diameter)
{
    for (const Vector3d& centre : centres) {
        fluid::RigidMotion motion;
        motion.position = centre;
        motions_.push_back(motion);
        bodies_.add(fluid::sphere_shape(diameter), motion);
    }
    bodies_.place(motions_);
    flow_.set_velocity([](const Vector3d&, int axis) { return axis == 0 ? 1.0 : 0.0; });
}

/// The acceleration of the fluid follows the drag, so that the mean velocity stays and the profile alone has to settle.
void ArrayFlow::step(double part_of_stable)
{
    const double dt = part_of_stable * flow_.stable_time_step();
    flow_.predict(dt);
    Vector3d force = Vector3d::Zero();
    for (const fluid::FluidAction& action : bodies_.measure(flow_, dt, motions_)) force += action.force;
    bodies_.apply(flow_, motions_);
    flow_.project(dt);
    force_ = force.x();
    flow_.set_body_acceleration({0.5 * (flow_.options().body_acceleration.x() + force_), 0, 0});
}

double ArrayFlow::drag_factor() const
{
    return force_ / static_cast<double>(motions_.size()) / (3 * pi * diameter_ * flow_.mean_superficial_velocity().x());
}

/// Steady when K changes by less than `tolerance` over a quarter of the time L^2/(4 pi^2 nu) in which the slowest mode falls by e.
double ArrayFlow::settle(double tolerance, double part_of_stable)
{
    const double n = flow_.grid().cells.x();
    const int window = std::max(30, static_cast<int>(0.1 * n * n / part_of_stable));
    double last = 0, K = 1;
    for (int round = 0; round < 60 && !(std::abs(K / last - 1) < tolerance); ++round) {
        last = K;
        for (int s = 0; s < window; ++s) step(part_of_stable);
        K = drag_factor();
    }
    return K;
}

double array_diameter(Lattice lattice, double solid_fraction)
{
    const int spheres = lattice == Lattice::simple ? 1 : lattice == Lattice::body_centred ? 2 : 4;
    return std::cbrt(6 * solid_fraction / (pi * spheres));
}

namespace {

struct Reference {
    Lattice lattice;
    const char* name;
    double solid_fraction, K;
};
/// Zick & Homsy, J. Fluid Mech. 115, 13 (1982), Table 2.
constexpr Reference simple_cubic[] = {{Lattice::simple, "SC", 0.027, 2.008}, {Lattice::simple, "SC", 0.064, 2.810}, {Lattice::simple, "SC", 0.125, 4.292},
                                      {Lattice::simple, "SC", 0.216, 7.442}, {Lattice::simple, "SC", 0.343, 15.4},  {Lattice::simple, "SC", 0.45, 28.1}};
/// Collocation with periodic Stokeslets, ours; it gives the simple cubic column of Zick & Homsy to all its digits.
constexpr Reference centred[] = {{Lattice::body_centred, "BCC", 0.064, 2.88939}, {Lattice::body_centred, "BCC", 0.216, 7.73878}, {Lattice::body_centred, "BCC", 0.45, 31.6876},
                                 {Lattice::body_centred, "BCC", 0.6, 88.7695},   {Lattice::face_centred, "FCC", 0.064, 2.88875}, {Lattice::face_centred, "FCC", 0.216, 7.75768},
                                 {Lattice::face_centred, "FCC", 0.45, 33.4893},  {Lattice::face_centred, "FCC", 0.6, 107.552}};
const Vector3d off_grid(0.5131, 0.4863, 0.5072);
constexpr double steady = 1e-4;

/// The same array at rising resolution, each started from the one before.
/// \param coarsest  resolution from which the tolerance holds
void resolve(const Reference& reference, const std::vector<double>& resolutions, double tolerance, double coarsest, const char* source, std::vector<Check>& checks)
{
    const double diameter = array_diameter(reference.lattice, reference.solid_fraction);
    std::optional<ArrayFlow> coarse;
    for (const double wanted : resolutions) {
        const double begin = processor_seconds();
        const int cells = static_cast<int>(std::lround(wanted / diameter));
        ArrayFlow array(lattice_points(reference.lattice, off_grid), diameter, cells);
        if (coarse) start_from(coarse->flow(), array.flow());
        const double K = array.settle(steady);
        checks.push_back({fmt::format("{} c = {}, drag factor K", reference.name, reference.solid_fraction), "1", reference.K, K, wanted < coarsest ? shown_only : tolerance, true, source,
                          cells * diameter, processor_seconds() - begin});
        coarse.emplace(std::move(array));
    }
}

}  // namespace

std::vector<Check> cubic_arrays(const StudyOptions& options)
{
    std::vector<Check> checks;
    for (const Reference& reference : simple_cubic) {
        std::vector<double> resolutions{7, 10, 14, 20};
        if (options.heavy) resolutions.insert(resolutions.end(), {28, 40});
        resolve(reference, resolutions, 0.015, 10, "Zick & Homsy 1982", checks);
    }
    return checks;
}

std::vector<Check> centred_arrays(const StudyOptions& options)
{
    std::vector<Check> checks;
    for (const Reference& reference : centred) {
        std::vector<double> resolutions{7, 10, 14};
        if (options.heavy) resolutions.insert(resolutions.end(), {20, 28});
        // at c = 0.6 the gaps are 0.04 to 0.07 of a diameter: less than a cell until 28 cells or so
        resolve(reference, resolutions, 0.02, reference.solid_fraction > 0.5 ? 28 : 13.5, "periodic Stokeslets, collocation", checks);
    }
    return checks;
}

/// K for centres anywhere in a cell: the greatest error of twelve places, the middle and the corner of a cell among them.
std::vector<Check> array_positions(const StudyOptions& options)
{
    std::vector<Check> checks;
    std::mt19937_64 random(11);
    std::vector<Vector3d> places{{0, 0, 0}, {0.5, 0.5, 0.5}, {0.5, 0, 0}, {0, 0.5, 0.5}};
    // the generator's own numbers: distributions of the library differ from one library to the next
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    for (int i = 0; i < 8; ++i) {
        const double x = unit(), y = unit(), z = unit();
        places.push_back({x, y, z});
    }
    for (const Reference& reference : {simple_cubic[3], simple_cubic[5]})
        for (const double wanted : {10.0, 15.0, 20.0, 40.0}) {
            if (wanted > 15 && !options.heavy) continue;
            const double begin = processor_seconds(), diameter = array_diameter(reference.lattice, reference.solid_fraction);
            const int cells = static_cast<int>(std::lround(wanted / diameter));
            double worst = reference.K;
            for (const Vector3d& place : places) {
                ArrayFlow array({(Vector3d::Constant(cells / 2) + place) / cells}, diameter, cells);
                const double K = array.settle(steady);
                if (std::abs(K - reference.K) > std::abs(worst - reference.K)) worst = K;
            }
            checks.push_back({fmt::format("SC c = {}, K at the worst of 12 places", reference.solid_fraction), "1", reference.K, worst, 0.025, true, "Zick & Homsy 1982",
                              cells * diameter, processor_seconds() - begin});
        }
    return checks;
}

/// K with the step cut down to a hundredth, for our forcing and for the paper's plain blend (Huang et al., eq. 6).
std::vector<Check> array_time_step(const StudyOptions& options)
{
    std::vector<Check> checks;
    const Reference& reference = simple_cubic[3];
    const double diameter = array_diameter(reference.lattice, reference.solid_fraction);
    for (const bool plain : {false, true})
        for (const double wanted : {10.0, 15.0, 20.0}) {
            if (wanted > (plain ? 10 : 15) && !options.heavy) continue;
            const int cells = static_cast<int>(std::lround(wanted / diameter));
            fluid::ForcingOptions forcing;
            forcing.plain_blend = plain;
            if (plain) forcing.fraction = fluid::FractionRule::corners;
            ArrayFlow array(lattice_points(Lattice::simple, off_grid), diameter, cells, forcing);
            for (const double part : {1.0, 0.1, 0.016, 0.01}) {
                const double begin = processor_seconds();
                const double K = array.settle(steady, part);
                const double number = part * 0.0625;  // dt is 0.75/12 of h2/nu at rest
                checks.push_back({fmt::format("SC c = 0.216, {}, nu dt/h2 = {:.3g}", plain ? "paper's blend" : "ours", number), "1", reference.K, K, plain ? shown_only : 0.015, true,
                                  "Zick & Homsy 1982", cells * diameter, processor_seconds() - begin});
            }
        }
    return checks;
}

}  // namespace coral::validate
