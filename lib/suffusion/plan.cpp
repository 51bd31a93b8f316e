#include "suffusion/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"
#include "core/units.h"
#include "fluid/flow.h"
#include "pack/sample_world.h"
#include "suffusion/scene.h"

namespace coral::suffusion {

namespace {

// Cost of one step, measured with suffuse on one core of a shared two-core machine: the paper's case and the small studies (docs/validation/flow-speed.md).
constexpr double seconds_per_cell = 1.1e-7;        ///< fluid step, per cell
constexpr double seconds_per_stage_cell = 3.7e-8;  ///< each evaluation of convection beyond the first, per cell
constexpr double seconds_per_solid_cell = 9e-8;    ///< placing and forcing resolved grains, per cell in them
constexpr double seconds_per_fine = 4e-5;          ///< kernel gather and spread, per fine and fluid step, at support 2d/4d and 2 to 6 cells per diameter
constexpr double seconds_per_grain_contact = 9e-7; ///< contact step, per grain
constexpr double seconds_per_angular_contact = 2.3e-6;  ///< the same of polyhedra, whose surface nodes touch
constexpr double bytes_per_cell = 700;
constexpr double pore_speed_ratio = 18;            ///< max sum |u_i| / superficial velocity in a gap-graded bed [measured: 15 to 20]

PopulationPlan population_of(const pack::Sample& sample, pack::Role role, double cell)
{
    PopulationPlan plan;
    plan.role = std::string(pack::to_string(role));
    std::vector<double> diameters;
    for (const pack::Particle& p : sample.particles)
        if (p.role == role) diameters.push_back(pack::equivalent_diameter(sample, p));
    plan.count = diameters.size();
    if (diameters.empty()) return plan;
    std::ranges::sort(diameters);
    plan.smallest = diameters.front();
    plan.largest = diameters.back();
    if (cell <= 0) return plan;
    plan.scheme = scheme_for(diameters[diameters.size() / 2], cell);
    plan.mixed = scheme_for(plan.smallest, cell) != scheme_for(plan.largest, cell);
    const char* reason = plan.scheme == Scheme::resolved        ? "above 8 the flow around each grain is resolved on the cells"
                         : plan.scheme == Scheme::semi_resolved ? "between 1/3 and 8 the flow is felt through a kernel, drag by Gidaspow"
                                                                : "below 1/3 the grain is far smaller than a cell";
    plan.why = fmt::format("{:.1f} to {:.1f} cells per diameter; {}", plan.smallest / cell, plan.largest / cell, reason);
    return plan;
}

/// Whether a transform over that many cells is fast: no prime factor above 7. Over 122 = 2 x 61 cells the pressure takes four times as long as over 120.
bool is_smooth(int cells)
{
    for (const int prime : {2, 3, 5, 7})
        while (cells % prime == 0) cells /= prime;
    return cells == 1;
}

/// Edge of the cells near the wanted one that divides the sample's plan in whole cells, with the least gap along y and fast transforms.
double fitting_cell(const Eigen::Vector3d& size, double wanted)
{
    const int around = std::max(1, static_cast<int>(std::lround(size.x() / wanted)));
    double best = size.x() / around, least = std::numeric_limits<double>::infinity();
    for (int n = std::max(1, static_cast<int>(0.95 * around)); n <= static_cast<int>(std::ceil(1.05 * around)); ++n) {
        const double cell = size.x() / n;
        const double along_y = std::ceil(size.y() / cell - 1e-6), gap = along_y - size.y() / cell;
        // A closer fit is worth a slightly different cell, but not for a gap that is already small; nor are slow transforms.
        const double slow = is_smooth(n) && is_smooth(static_cast<int>(along_y)) ? 0 : 0.5;
        const double badness = std::max(gap, 0.02) + 0.5 * std::abs(cell / wanted - 1) + slow;
        if (badness < least) least = badness, best = cell;
    }
    return best;
}

/// Domain: the sample, with free space above and below in the proportion of the paper (64 mm for 60 mm). The plate's faces lie a quarter of a
/// cell off the cell faces: a plate exactly on them is the worst case of an immersed wall [measured in packed beds].
void lay_out(Plan& plan)
{
    const double cell = fitting_cell(plan.sample_size, plan.options.cell);
    plan.domain.cell = cell;
    const int below = std::max(5, static_cast<int>(std::lround(3.0 / 60 * plan.sample_size.z() / cell)));
    const int above = std::max(2, static_cast<int>(std::lround(1.0 / 60 * plan.sample_size.z() / cell)));
    plan.domain.cells = {static_cast<int>(std::lround(plan.sample_size.x() / cell)), static_cast<int>(std::ceil(plan.sample_size.y() / cell - 1e-6)),
                         below + static_cast<int>(std::ceil(plan.sample_size.z() / cell)) + above};
    plan.domain.size = plan.domain.cells.cast<double>() * cell;
    plan.domain.origin = {0, -0.5 * (plan.domain.size.y() - plan.sample_size.y()), -(below - 0.25) * cell};
    plan.plate_thickness = 2 * cell;
    const double wanted = plan.options.pitch > 0 ? plan.options.pitch : 2 * plan.options.hole;
    const double holes = std::max(1.0, std::round(plan.sample_size.x() / wanted));
    plan.pitch = plan.sample_size.x() / holes;
    plan.plate_open_fraction = std::pow(plan.options.hole / plan.pitch, 2);
}

/// Flow, grains and holes of the filter must repeat themselves after the lengths of the sample.
void check_period(const Plan& plan)
{
    for (int axis = 0; axis < 2; ++axis) {
        const double length = plan.period[axis], holes = length / plan.pitch;
        if (length <= 0) continue;
        if (std::abs(plan.domain.size[axis] - length) > 1e-9 * length)
            throw UsageError("--cell", "near " + to_text(plan.options.cell) + " m: no number of cells of " + to_text(plan.domain.cell) + " m fills the periodic " + "xyz"[axis] + " of " + to_text(length) + " m",
                             "give an edge that divides both sides of the sample");
        if (std::abs(holes - std::round(holes)) > 1e-9 * holes)
            throw UsageError("--hole", "gives a pitch of " + to_text(plan.pitch) + " m, which does not divide the periodic " + "xyz"[axis] + " of " + to_text(length) + " m", "take another size of holes");
    }
}

void predict(Plan& plan, const pack::Sample& sample)
{
    const double dx = plan.domain.cell, nu = FluidSpec{}.kinematic_viscosity;
    const double speed = pore_speed_ratio * plan.options.velocity;
    const bool staged = plan.populations[1].count > 0 && plan.populations[1].scheme != Scheme::resolved;
    plan.flow_step = std::min(TimeSpec{}.max_step, (staged ? fluid::runge_kutta_reach : 1) / (15 * nu / (dx * dx) + speed / (dx * TimeSpec{}.cfl)));
    dem::World world(pack::world_options(sample));
    pack::add_sample(world, sample);
    if (const double critical = world.critical_time_step(); plan.options.dem_step > 1.5 * critical)
        throw UsageError("--dem-step", "is " + format_quantity(plan.options.dem_step, Dimension::time) + ", above 1.5 of the critical step, " +
                                           format_quantity(critical, Dimension::time) + " of the lightest grain", "give 0 for 0.3 of it");
    plan.dem_step = plan.options.dem_step > 0 ? plan.options.dem_step : world.auto_time_step();
    plan.flow_steps = plan.options.duration / plan.flow_step;
    plan.dem_steps = plan.options.duration / plan.dem_step;
    const double cells = plan.domain.cells.cast<double>().prod();
    double grids = 0;
    for (const pack::ShapeTemplate& shape : sample.shapes)
        if (shape.grid) grids += 1.6 * static_cast<double>(shape.grid->node_count()) * sizeof(float);
    plan.memory = cells * bytes_per_cell + grids + 2e3 * static_cast<double>(sample.particles.size()) + 5e7;
    const double fines = static_cast<double>(plan.populations[1].count);
    const double speed_up = 1 + 0.7 * (std::min(thread_count(), 16) - 1);
    double solid_cells = 0, contact = 0;
    for (const pack::Particle& p : sample.particles) {
        if (p.role == pack::Role::coarse) solid_cells += std::numbers::pi / 6 * std::pow(pack::equivalent_diameter(sample, p) / dx, 3);
        const bool angular = sample.shapes[static_cast<std::size_t>(p.shape)].kind == pack::ShapeKind::polyhedron;
        contact += angular ? seconds_per_angular_contact : seconds_per_grain_contact;
    }
    const double flow = cells * (seconds_per_cell + (staged ? 2 * seconds_per_stage_cell : 0)) + solid_cells * seconds_per_solid_cell + fines * seconds_per_fine;
    plan.run_time = (plan.flow_steps * flow + plan.dem_steps * contact) / speed_up;
}

void warn(Plan& plan)
{
    const PopulationPlan &coarse = plan.populations[0], &fine = plan.populations[1];
    if (plan.options.hole <= fine.largest)
        plan.warnings.push_back(fmt::format("holes of {} hold back the largest fines ({})", format_quantity(plan.options.hole, Dimension::length),
                                            format_quantity(fine.largest, Dimension::length)));
    if (plan.options.hole >= coarse.smallest)
        plan.warnings.push_back(fmt::format("holes of {} let the smallest coarse grains ({}) through",
                                            format_quantity(plan.options.hole, Dimension::length), format_quantity(coarse.smallest, Dimension::length)));
    if (coarse.smallest / plan.domain.cell < 12)
        plan.warnings.push_back(fmt::format("{:.1f} cells per smallest coarse grain: flow in throats below 3 cells is rough; a finer --cell helps",
                                            coarse.smallest / plan.domain.cell));
    if (plan.options.hole / plan.domain.cell < 4)
        plan.warnings.push_back(fmt::format("{:.1f} cells per hole: the plate's own pressure drop is rough", plan.options.hole / plan.domain.cell));
    if (std::abs(plan.domain.cell / plan.options.cell - 1) > 1e-9)
        plan.warnings.push_back(fmt::format("cell {} instead of {}: the sample is then a whole number of cells wide",
                                            format_quantity(plan.domain.cell, Dimension::length), format_quantity(plan.options.cell, Dimension::length)));
}

std::string duration_text(double seconds)
{
    if (seconds < 120) return fmt::format("{:.0f} s", seconds);
    if (seconds < 7200) return fmt::format("{:.0f} min", seconds / 60);
    return fmt::format("{:.1f} h", seconds / 3600);
}

std::string vector_text(const Eigen::Vector3d& v) { return "[" + to_text(v.x()) + ", " + to_text(v.y()) + ", " + to_text(v.z()) + "]"; }

}  // namespace

Plan make_plan(const pack::Sample& sample, const PlanOptions& options)
{
    pack::refuse_cylinder(sample, "the flow on its rectangular cells");
    Plan plan;
    plan.options = options;
    plan.sample_size = sample.size;
    plan.period = sample.period;
    const double smallest_coarse = population_of(sample, pack::Role::coarse, 0).smallest;
    if (population_of(sample, pack::Role::fine, 0).count == 0)
        throw Error("sample", "has no fines: nothing can be eroded", "pack a population with role = \"fine\"");
    if (smallest_coarse <= 0) throw Error("sample", "has no coarse grains", "pack a population with role = \"coarse\"");
    if (!(options.velocity > 0)) throw UsageError("--velocity", "is " + to_text(options.velocity) + " m/s: the inlet is closed", "give a speed above zero");
    if (!(options.duration > 0)) throw UsageError("--duration", "is " + to_text(options.duration) + " s", "give a time above zero");
    if (!(std::abs(options.angle) <= M_PI))
        throw UsageError("--angle", "is " + to_text(std::round(options.angle * 180 / M_PI)) + " deg (a bare number is in radians)", "write it with its unit, such as 45deg, from -180deg to 180deg");
    if (!(options.dem_step >= 0)) throw UsageError("--dem-step", "is " + to_text(options.dem_step) + " s", "give a time above zero, or 0 for 0.3 of the critical step");
    if (plan.options.hole == 0) plan.options.hole = 0.4 * smallest_coarse;
    if (plan.options.cell == 0) plan.options.cell = smallest_coarse / 30;
    const double width = std::min(sample.size.x(), sample.size.y());
    if (!(plan.options.hole > 0) || plan.options.hole >= width)
        throw UsageError("--hole", "is " + to_text(plan.options.hole) + " m", "give an edge above zero and below the width of the sample, " + to_text(width) + " m");
    if (!(plan.options.cell > 0) || plan.options.cell > width / 8)
        throw UsageError("--cell", "is " + to_text(plan.options.cell) + " m", "give an edge above zero and at most an eighth of the sample's width, " + to_text(width) + " m");
    lay_out(plan);
    const double narrowest = plan.options.hole + 1.5 * plan.domain.cell;
    if (plan.options.pitch != 0 && !(plan.options.pitch > 0 && plan.pitch >= narrowest))
        throw UsageError("--pitch", "is " + to_text(plan.options.pitch) + " m, for a sample of this width " + to_text(plan.pitch) + " m",
                         "give at least the hole and one and a half cells beside it, " + to_text(narrowest) + " m");
    check_period(plan);
    plan.populations = {population_of(sample, pack::Role::coarse, plan.domain.cell), population_of(sample, pack::Role::fine, plan.domain.cell)};
    plan.gravity = 9.81 * Eigen::Vector3d(std::sin(options.angle), 0, -std::cos(options.angle));
    for (double& g : plan.gravity)
        if (std::abs(g) < 1e-12) g = 0;
    predict(plan, sample);
    warn(plan);
    return plan;
}

std::string explain(const Plan& plan)
{
    const auto length = [](double v) { return format_quantity(v, Dimension::length); };
    std::string text = fmt::format("domain    {} x {} x {} cells of {} ({:.2f} million)\n", plan.domain.cells.x(), plan.domain.cells.y(), plan.domain.cells.z(),
                                   length(plan.domain.cell), plan.domain.cells.cast<double>().prod() / 1e6);
    text += fmt::format("flow      {} downwards, {:.0f} deg from gravity; outlet p = 0; {} sides\n", format_quantity(plan.options.velocity, Dimension::velocity),
                        plan.options.angle * 180 / M_PI, plan.period.isZero(0) ? "slip" : plan.period.head<2>().minCoeff() > 0 ? "periodic" : "slip and periodic");
    text += fmt::format("filter    square holes {} every {}, {:.0f} % open, {} thick\n", length(plan.options.hole), length(plan.pitch),
                        100 * plan.plate_open_fraction, length(plan.plate_thickness));
    text += plan.options.lid ? fmt::format("lid       stays at {}: it holds the grains, water passes\n", length(plan.sample_size.z())) : "lid       taken away: a compressed sample springs up\n";
    for (const PopulationPlan& p : plan.populations)
        text += fmt::format("{:<9} {} grains of {} to {}: {}{} ({})\n", p.role, p.count, length(p.smallest), length(p.largest), to_string(p.scheme),
                            p.mixed ? " (most; decided grain by grain)" : "", p.why);
    text += fmt::format("steps     flow about {} ({:.0f}), contact {} ({:.2g})\n", format_quantity(plan.flow_step, Dimension::time), plan.flow_steps,
                        format_quantity(plan.dem_step, Dimension::time), plan.dem_steps);
    text += fmt::format("memory    about {:.2f} GB\n", plan.memory / 1e9);
    text += fmt::format("time      about {} for {} on {} threads (within a factor of 2)\n", duration_text(plan.run_time),
                        format_quantity(plan.options.duration, Dimension::time), thread_count());
    for (const std::string& warning : plan.warnings) text += "note      " + warning + "\n";
    return text;
}

std::string case_text(const Plan& plan, const pack::Sample& sample, const std::string& sample_file)
{
    const pack::Material& material = sample.materials.at(0);
    std::string text = "# Suffusion of a packed sample: water flows down through it, fines leave through the filter plate.\n"
                       "# Written by make-case; every key may be changed. Numbers are SI; strings may carry units (\"0.5mm\").\n\n";
    text += fmt::format("sample = \"{}\"              # bodies of the packing; more can be added with [[body]]\n\n", sample_file);
    text += fmt::format("[domain]\norigin = {}  # m; the sample rests on the filter plate at z = 0\nsize = {}\ncell = {}  # cubic cells, {:.1f} per smallest coarse grain\n\n",
                        vector_text(plan.domain.origin), vector_text(plan.domain.size), to_text(plan.domain.cell), plan.populations[0].smallest / plan.domain.cell);
    text += "[boundary]                # slip | wall | inlet | outlet | periodic; grains leave through outlets only\n";
    for (const std::string_view face : {"x-", "x+", "y-", "y+"})
        text += fmt::format("\"{}\" = {{ type = \"{}\" }}\n", face, plan.period[face[0] - 'x'] > 0 ? "periodic" : "slip");
    text += fmt::format("\"z+\" = {{ type = \"inlet\", velocity = [0, 0, {}] }}  # m/s\n\"z-\" = {{ type = \"outlet\", pressure = 0 }}  # Pa\n\n",
                        to_text(-plan.options.velocity));
    text += fmt::format("[fluid]\ndensity = {}              # kg/m3\nkinematic_viscosity = {}  # m2/s\ndrag = \"gidaspow\"\n"
                        "precision = \"double\"        # of the flow's fields; \"single\": 0.6 of the time and half the memory, balances to 1e-6\n\n", to_text(FluidSpec{}.density),
                        to_text(FluidSpec{}.kinematic_viscosity));
    text += fmt::format("[gravity]\nvector = {}  # m/s2; {:.0f} deg from the flow\n\n", vector_text(plan.gravity), plan.options.angle * 180 / M_PI);
    text += fmt::format("[material.default]\ndensity = {}               # kg/m3\nnormal_stiffness = {}      # N/m\ntangential_stiffness = {}  # N/m\n"
                        "friction = {}\ndamping = {}                # ratio to critical\n\n",
                        to_text(material.density), to_text(material.normal_stiffness), to_text(material.tangential_stiffness), to_text(material.friction),
                        to_text(material.damping));
    text += "[scheme]                  # auto | resolved | semi-resolved | unresolved, by role\n";
    for (const PopulationPlan& p : plan.populations) text += fmt::format("{} = \"auto\"  # {}: {}\n", p.role, to_string(p.scheme), p.why);
    text += "\n[motion]                  # free | fixed, by role\ncoarse = \"free\"\n\n";
    text += fmt::format("[[wall]]                  # the filter\ntype = \"plate\"\nz = 0                     # upper face, m\nhole = {}\npitch = {}\nthickness = {}\n\n",
                        to_text(plan.options.hole), to_text(plan.pitch), to_text(plan.plate_thickness));
    if (plan.options.lid)
        text += fmt::format("[[wall]]                  # the lid of the packing: holds the grains, water passes; leave it out and a compressed sample springs up\n"
                            "type = \"plane\"\npoint = [0, 0, {}]\nnormal = [0, 0, -1]\n\n", to_text(plan.sample_size.z()));
    if (plan.domain.size.y() > plan.sample_size.y() * (1 + 1e-9))
        text += fmt::format("[[wall]]                  # the sample is not a whole number of cells deep\ntype = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\n\n"
                            "[[wall]]\ntype = \"plane\"\npoint = [0, {}, 0]\nnormal = [0, -1, 0]\n\n", to_text(plan.sample_size.y()));
    const std::string dem_step = plan.options.dem_step > 0 ? to_text(plan.dem_step) + "          # s; \"auto\" is 0.3 of the critical step"
                                                           : "\"auto\"       # about " + format_quantity(plan.dem_step, Dimension::time) + " here";
    text += fmt::format("[time]\nduration = {}        # s\ndem_step = {}\ncfl = {}\nmax_step = {}      # s\n\n", to_text(plan.options.duration),
                        dem_step, to_text(TimeSpec{}.cfl), to_text(TimeSpec{}.max_step));
    text += fmt::format("[output]\ninterval = {}        # s, series\nframes = {}           # s, fields and bodies for viewing; \"none\" to leave out\ntrack = \"all\"            # or a list of body numbers\n",
                        to_text(plan.options.duration / 400), to_text(plan.options.duration / 40));
    return text;
}

}  // namespace coral::suffusion
