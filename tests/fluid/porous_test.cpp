#include "fluid/porous.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/parallel.h"
#include "fines_scene.h"

using namespace coral::fluid;
using namespace coral::fluid::test;
using Eigen::Vector3d;

namespace {

double deposited_volume(const Flow& flow)
{
    double sum = 0.0;
    for (int k = 0; k < flow.grid().cells.z(); ++k)
        for (int j = 0; j < flow.grid().cells.y(); ++j)
            for (int i = 0; i < flow.grid().cells.x(); ++i)
                sum += 1.0 - flow.porous_fields().void_fraction[flow.layout().index(i, j, k)];
    return sum * flow.grid().cell_volume();
}

}  // namespace

TEST(PeskinKernel, is_continuous_and_sums_to_one_on_a_line_of_integers)
{
    EXPECT_NEAR(peskin_kernel(1.0 - 1e-9), peskin_kernel(1.0 + 1e-9), 1e-8);
    EXPECT_NEAR(peskin_kernel(2.0 - 1e-9), 0.0, 1e-8);
    EXPECT_EQ(peskin_kernel(2.1), 0.0);
    for (double shift = 0.0; shift < 1.0; shift += 0.1) {
        double sum = 0.0;
        for (int i = -3; i <= 3; ++i) sum += peskin_kernel(std::abs(i - shift));
        EXPECT_NEAR(sum, 1.0, 1e-12);
    }
}

TEST(FineCoupling, keeps_the_volume_of_fines_anywhere_in_the_domain)
{
    for (const BoundaryKind kind : {BoundaryKind::slip, BoundaryKind::periodic}) {
        const GridSpec grid = box({12, 9, 15}, 1e-3, kind);
        Flow flow(grid, {});
        Fines fines = random_fines(grid, 12, 1e-3, 3.2e-3, 0.0, 3);
        fines.add(Vector3d::Zero(), 2e-3);            // in a corner
        fines.add(grid.size(), 1e-4);                 // a tenth of a cell
        fines.add(Vector3d(-5e-3, 4e-3, 0.0), 2e-3);  // outside
        KernelOptions options;
        options.smallest_void_fraction = -100.0;  // no clipping: a corner holds the particle eight times
        FineCoupling coupling(grid, options);
        coupling.place(fines.positions, fines.diameters, nullptr);
        coupling.deposit_volume(flow, fines.volumes, fines.velocities);
        EXPECT_NEAR(deposited_volume(flow) / fines.solid_volume(), 1.0, 1e-12);
    }
}

TEST(FineCoupling, mirrors_fines_at_walls)
{
    // beside a wall the field is that of the particle and its mirror image in a domain twice as wide
    const GridSpec half = box({10, 12, 12}, 1e-3, BoundaryKind::slip);
    GridSpec whole = box({20, 12, 12}, 1e-3, BoundaryKind::slip);
    whole.origin.x() = -10e-3;
    Flow flow_half(half, {}), flow_whole(whole, {});
    Fines one, two;
    for (const Vector3d& x : {Vector3d(0.7e-3, 5.1e-3, 6.3e-3), Vector3d(1.9e-3, 11.2e-3, 0.4e-3)}) {
        one.add(x, 2.4e-3, {0.1, 0.2, -0.3});
        two.add(x, 2.4e-3, {0.1, 0.2, -0.3});
        two.add(Vector3d(-x.x(), x.y(), x.z()), 2.4e-3, {-0.1, 0.2, -0.3});
    }
    FineCoupling coupling_half(half), coupling_whole(whole);
    coupling_half.place(one.positions, one.diameters, nullptr);
    coupling_whole.place(two.positions, two.diameters, nullptr);
    coupling_half.deposit_volume(flow_half, one.volumes, one.velocities);
    coupling_whole.deposit_volume(flow_whole, two.volumes, two.velocities);
    for (int k = 0; k < 12; ++k)
        for (int j = 0; j < 12; ++j)
            for (int i = 0; i < 10; ++i)
                EXPECT_NEAR(flow_half.porous_fields().void_fraction[flow_half.layout().index(i, j, k)],
                            flow_whole.porous_fields().void_fraction[flow_whole.layout().index(i + 10, j, k)], 1e-12);
}

TEST(FineCoupling, keeps_out_of_resolved_grains)
{
    const GridSpec grid = box({16, 16, 16}, 1e-3, BoundaryKind::slip);
    std::vector<RigidMotion> motions(1);
    motions[0].position.setConstant(8e-3);
    ImmersedBodies bodies(grid);
    bodies.add(sphere_shape(8e-3), motions[0]);
    bodies.place(motions);
    Flow flow(grid, {});
    Fines fines;
    fines.add({3.4e-3, 8e-3, 8e-3}, 2e-3);  // touches the grain
    fines.add({8e-3, 8e-3, 8e-3}, 1e-3);    // buried in it: nowhere else to go
    FineCoupling coupling(grid);
    coupling.place(fines.positions, fines.diameters, &bodies.cell_solid_fraction());
    coupling.deposit_volume(flow, fines.volumes, fines.velocities);
    EXPECT_NEAR(deposited_volume(flow) / fines.solid_volume(), 1.0, 1e-12);
    EXPECT_EQ(flow.porous_fields().void_fraction[flow.layout().index(5, 8, 8)], 1.0);  // solid cell beside the first
    std::vector<FeltFlow> felt(2);
    coupling.feel(flow, felt);
    EXPECT_TRUE(felt[1].velocity.allFinite());
    EXPECT_GT(felt[1].void_fraction, 0.1);
}

TEST(FineCoupling, a_particle_alone_feels_no_solid)
{
    const double grain_radius = 4e-3;
    const std::vector<Vector3d> places{{8.2e-3, 8.1e-3, 12.4e-3}, {0.6e-3, 0.7e-3, 12e-3}, {8e-3, 8e-3, 4e-3 + grain_radius + 0.8e-3}};
    for (const int cells : {1, 2})
        for (const BoundaryKind kind : {BoundaryKind::wall, BoundaryKind::periodic})
            for (const Vector3d& place : places) {
                const GridSpec grid = box({16, 16, 20}, 1e-3, kind);
                std::vector<RigidMotion> motions(1);
                motions[0].position = Vector3d(8e-3, 8e-3, 4e-3);
                ImmersedBodies bodies(grid);
                bodies.add(sphere_shape(2 * grain_radius), motions[0]);
                bodies.place(motions);
                Flow flow(grid, {});
                Fines fines;
                fines.add(place, 1.6e-3);
                KernelOptions options;
                options.coupling_cells = cells;
                std::vector<FeltFlow> plain(1), felt(1);
                for (const bool exclude : {false, true}) {
                    options.self_disturbance = exclude ? SelfDisturbance::volume_removed : SelfDisturbance::kept;
                    FineCoupling coupling(grid, options);
                    coupling.place(fines.positions, fines.diameters, &bodies.cell_solid_fraction());
                    coupling.deposit_volume(flow, fines.volumes, fines.velocities);
                    coupling.feel(flow, exclude ? felt : plain);
                }
                EXPECT_LT(plain[0].void_fraction, 0.97);
                EXPECT_NEAR(felt[0].void_fraction, 1.0, 1e-9) << cells << " " << int(kind) << " " << place.transpose();
            }
}

TEST(FineCoupling, own_volume_matters_less_the_denser_the_bed)
{
    EXPECT_NEAR(bulk_void_fraction(0.95, 0.05), 1.0, 1e-9);
    EXPECT_EQ(bulk_void_fraction(0.95, 0.0), 0.95);
    EXPECT_NEAR(bulk_void_fraction(0.5, 0.05), 0.5, 1.5e-3);
    double last = 0.0;
    for (double felt = 0.95; felt > 0.3; felt -= 0.05) {
        const double added = bulk_void_fraction(felt, 0.05) - felt;
        EXPECT_GT(added, 0.0);
        if (last > 0.0) {
            EXPECT_LT(added, last);
        }
        last = added;
    }
}

TEST(FineCoupling, feels_a_uniform_flow_exactly_whatever_the_blocks)
{
    const GridSpec grid = box({18, 12, 24}, 1e-3, BoundaryKind::periodic);
    for (const int cells : {0, 1, 2, 3}) {
        Flow flow(grid, {});
        flow.set_velocity([](const Vector3d&, int axis) { return 0.1 * (axis + 1); });
        Fines fines = random_fines(grid, 20, 3e-3, 4e-3, 0.0, 5);
        KernelOptions options;
        options.coupling_cells = cells;
        FineCoupling coupling(grid, options);
        coupling.place(fines.positions, fines.diameters, nullptr);
        coupling.deposit_volume(flow, fines.volumes, fines.velocities);
        std::vector<FeltFlow> felt(fines.size());
        coupling.feel(flow, felt);
        for (const FeltFlow& f : felt) {
            EXPECT_LT((f.velocity - Vector3d(0.1, 0.2, 0.3)).norm(), 1e-12);
            EXPECT_LT(f.void_fraction, 1.0);
        }
        EXPECT_EQ(coupling.coupling_cells(), cells == 0 ? 2 : cells);
    }
}

TEST(FineCoupling, feels_a_uniform_flow_exactly_beside_walls_and_grains)
{
    GridSpec grid = box({17, 15, 20}, 1e-3, BoundaryKind::slip);  // a last block cut short on two axes
    grid.boundary[z_minus].kind = grid.boundary[z_plus].kind = BoundaryKind::periodic;
    std::vector<RigidMotion> motions(1);
    motions[0].position = Vector3d(8e-3, 8e-3, 8e-3);
    ImmersedBodies bodies(grid);
    bodies.add(sphere_shape(8e-3), motions[0]);
    bodies.place(motions);
    Flow flow(grid, {});
    flow.set_velocity([](const Vector3d&, int axis) { return axis == 2 ? 0.3 : 0.0; });
    Fines fines;
    fines.add({0.3e-3, 0.2e-3, 9e-3}, 2e-3);  // in an edge of the box
    fines.add({8e-3, 3.1e-3, 8e-3}, 2e-3);    // touches the grain
    fines.add({1.2e-3, 8e-3, 8e-3}, 2.4e-3);  // between grain and wall
    fines.add({16.6e-3, 14.8e-3, 9e-3}, 2e-3);
    for (const int cells : {1, 2}) {
        KernelOptions options;
        options.coupling_cells = cells;
        FineCoupling coupling(grid, options);
        coupling.place(fines.positions, fines.diameters, &bodies.cell_solid_fraction());
        coupling.deposit_volume(flow, fines.volumes, fines.velocities);
        std::vector<FeltFlow> felt(fines.size());
        coupling.feel(flow, felt);
        for (const FeltFlow& f : felt) EXPECT_LT((f.velocity - Vector3d(0.0, 0.0, 0.3)).norm(), 1e-12) << cells;
    }
}

TEST(FineCoupling, a_fine_in_the_void_of_a_grain_feels_the_flow_of_the_void)
{
    // hollow grain, void 5 mm, wall 2.5 mm thick: still water inside, a stream outside, and the other way round
    const double inner = 2.5e-3, outer = 5e-3;
    const GridSpec grid = box({28, 28, 28}, 0.5e-3, BoundaryKind::periodic);
    const Vector3d centre = Vector3d::Constant(7.1e-3);
    std::vector<RigidMotion> motions(1);
    motions[0].position = centre;
    BodyShape shell = sphere_shape(2 * outer);
    shell.distance = [=](std::span<const Vector3d> points, std::span<double> distances) {
        for (std::size_t i = 0; i < points.size(); ++i)
            distances[i] = std::max(points[i].norm() - outer, inner - points[i].norm());
    };
    ImmersedBodies bodies(grid);
    bodies.add(shell, motions[0]);
    bodies.place(motions);
    Fines fines;
    fines.add(centre, 0.8e-3);
    fines.add(centre + Vector3d(1.9e-3, 0.0, 0.0), 0.8e-3);  // lies against the wall of the void
    for (const bool stream_inside : {false, true}) {
        Flow flow(grid, {});
        flow.set_velocity([&](const Vector3d& x, int axis) {
            const bool inside = (x - centre).norm() < 0.5 * (inner + outer);
            return axis == 2 && inside == stream_inside ? 0.2 : 0.0;
        });
        FineCoupling coupling(grid);
        coupling.place(fines.positions, fines.diameters, &bodies.cell_solid_fraction());
        coupling.deposit_volume(flow, fines.volumes, fines.velocities);
        std::vector<FeltFlow> felt(fines.size());
        coupling.feel(flow, felt);
        for (const FeltFlow& f : felt) EXPECT_NEAR(f.velocity.z(), stream_inside ? 0.2 : 0.0, 1e-12);
    }
}

TEST(FineCoupling, exchanges_momentum_with_the_flow_to_round_off)
{
    for (const BoundaryKind kind : {BoundaryKind::slip, BoundaryKind::periodic, BoundaryKind::wall})
        for (const int grain : {0, 1}) {
            GridSpec grid = box({16, 14, 21}, 1e-3, kind);
            grid.boundary[z_plus] = {BoundaryKind::inlet, Vector3d(0.0, 0.0, -0.05), 0.0};
            grid.boundary[z_minus].kind = BoundaryKind::outlet;
            FlowOptions flow_options;
            if (kind == BoundaryKind::slip) flow_options.scheme = TimeScheme::runge_kutta;
            Flow flow(grid, flow_options);
            std::vector<RigidMotion> motions(1);
            motions[0].position = Vector3d(5e-3, 7e-3, 9e-3);
            ImmersedBodies bodies(grid);
            if (grain) {
                bodies.add(sphere_shape(6e-3), motions[0]);
                bodies.place(motions);
            }
            Fines fines = random_fines(grid, 150, 1.2e-3, 2.5e-3, 0.03, 11);
            fines.add({3e-3, 3e-3, 3e-3}, 5e-3), fines.add({3e-3, 3e-3, 3e-3}, 5e-3);  // denser than the limit: clipped
            KernelOptions options;
            options.smallest_void_fraction = 0.3;
            options.coupling_cells = 1 + grain;  // blocks of two: the last one along z is cut short
            FineCoupling coupling(grid, options);
            for (int step = 0; step < 12; ++step) {
                const double dt = flow.stable_time_step();
                fines.step(flow, coupling, dt, grain ? &bodies : nullptr, motions);
                Vector3d drag = Vector3d::Zero(), pressure = Vector3d::Zero();
                for (std::size_t i = 0; i < fines.size(); ++i) {
                    drag += dt * (fines.forces[i] + fines.lag[i]);
                    pressure -= dt * flow.options().density * fines.volumes[i] * fines.felt[i].pressure_gradient;
                }
                const MomentumTally& tally = flow.momentum();
                EXPECT_LT((drag + tally.drag).norm(), 1e-11 * drag.norm());
                EXPECT_LT((pressure - tally.fines_pressure).norm(), 1e-10 * (pressure.norm() + drag.norm()));
                EXPECT_LT(tally.relative_error(), 1e-10) << int(kind) << " step " << step;
                EXPECT_LT(flow.mass().relative_error(), 1e-11);
            }
        }
}

TEST(FineCoupling, gives_the_same_bits_with_one_and_two_threads)
{
    std::vector<FlowField> results;
    for (const int threads : {1, 2}) {
        coral::set_thread_count(threads);
        GridSpec grid = box({16, 14, 20}, 1e-3, BoundaryKind::slip);
        grid.boundary[z_plus] = {BoundaryKind::inlet, Vector3d(0.0, 0.0, -0.05), 0.0};
        grid.boundary[z_minus].kind = BoundaryKind::outlet;
        Flow flow(grid, {});
        Fines fines = random_fines(grid, 300, 1.2e-3, 3.5e-3, 0.03, 17);
        FineCoupling coupling(grid);
        for (int step = 0; step < 6; ++step) fines.step(flow, coupling, flow.stable_time_step());
        results.push_back(flow.velocity(2));
    }
    EXPECT_EQ(results[0], results[1]);
}

namespace {

/// Spheres that do not overlap, at random in a periodic cube.
std::vector<Vector3d> random_bed(int count, double d, double length, unsigned seed)
{
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, length);
    std::vector<Vector3d> x;
    for (int i = 0; i < count; ++i) x.emplace_back(uniform(random), uniform(random), uniform(random));
    for (double deepest = d; deepest > 1e-3 * d;) {
        deepest = 0.0;
        std::vector<Vector3d> move(x.size(), Vector3d::Zero());
        for (std::size_t a = 0; a < x.size(); ++a)
            for (std::size_t b = a + 1; b < x.size(); ++b) {
                Vector3d apart = x[a] - x[b];
                apart -= length * (apart / length).array().round().matrix();
                const double overlap = 1.002 * d - apart.norm();
                if (overlap <= 0.0) continue;
                deepest = std::max(deepest, overlap - 0.002 * d);
                move[a] += 0.3 * overlap * apart.normalized();
                move[b] -= 0.3 * overlap * apart.normalized();
            }
        for (std::size_t a = 0; a < x.size(); ++a) x[a] += move[a];
    }
    return x;
}

/// Pressure gradient over that of Ergun at the superficial velocity found, in a periodic bed of 343 spheres at the
/// porosity of the paper's bed, 0.4925. Started at Ergun's velocity; mean over the second half of the run.
double ergun_ratio(double reynolds, int cells_per_diameter, unsigned seed)
{
    const double d = 0.01, nu = reynolds < 30.0 ? 1e-4 : 1e-6, void_fraction = 0.4925;
    const double L = d * std::cbrt(343 * pi / 6 / (1.0 - void_fraction));
    const int n = 2 * int(std::lround(0.5 * L / d * cells_per_diameter));
    const double U = reynolds * nu / d, gradient = ergun_pressure_gradient(void_fraction, U, d, 1000.0, nu);
    FlowOptions options;
    options.kinematic_viscosity = nu;
    options.body_acceleration = {0.0, 0.0, gradient / 1000.0};
    const GridSpec grid = box({n, n, n}, L / n, BoundaryKind::periodic);
    Flow flow(grid, options);
    flow.set_velocity([&](const Vector3d&, int axis) { return axis == 2 ? U / void_fraction : 0.0; });
    Fines fines;
    for (const Vector3d& x : random_bed(343, d, L, seed)) fines.add(x, d);
    FineCoupling coupling(grid);
    // slow flow settles with the drag's own time, d^2/150 nu and less; fast flow when it has crossed some diameters
    const double duration = reynolds < 30.0 ? 0.4 * d * d / nu : 12.0 * d * void_fraction / U;
    double t = 0.0, sum = 0.0, span = 0.0;
    while (t < duration) {
        const double dt = flow.stable_time_step();
        fines.step(flow, coupling, dt);
        t += dt;
        if (t < 0.5 * duration) continue;
        sum += dt * flow.mean_superficial_velocity().z();
        span += dt;
    }
    return gradient / ergun_pressure_gradient(void_fraction, sum / span, d, 1000.0, nu);
}

/// Terminal speed in still water over that of its drag law.
double terminal_speed_ratio(double diameter, double cells_per_diameter, DragLaw law = DragLaw::gidaspow)
{
    const double density = 2780.0, rho = 1000.0, nu = 1e-6, g = 9.81, h = diameter / cells_per_diameter;
    const double weight = (density - rho) * pi / 6 * std::pow(diameter, 3) * g, length = std::max(diameter, h);
    double low = 0.0, high = 10.0;
    for (int i = 0; i < 100; ++i) {
        const double v = 0.5 * (low + high);
        (drag_coefficient(law, 1.0, v, diameter, rho, nu) * v < weight ? low : high) = v;
    }
    const int width = 4 * int(std::lround(3.0 * length / h)), height = 4 * int(std::lround(7.0 * length / h));
    GridSpec grid = box({width, width, height}, h, BoundaryKind::slip);
    Flow flow(grid, {});
    FineCoupling coupling(grid);
    Fines fine;
    fine.add({0.5 * width * h + 0.21 * h, 0.5 * width * h - 0.13 * h, height * h - 6 * length}, diameter, {0, 0, -low});
    const double mass = density * fine.volumes[0], start = fine.positions[0].z();
    double sum = 0.0, span = 0.0;
    for (double fallen = 0.0; fallen < 14.0 * length; fallen = start - fine.positions[0].z()) {
        const double speed = std::abs(fine.velocities[0].z());
        const double dt = std::min(flow.stable_time_step(), 0.3 * h / speed);
        fine.step(flow, coupling, dt);
        const double force = fine.forces[0].z() + fine.lag[0].z() - rho * fine.volumes[0] * fine.felt[0].pressure_gradient.z();
        // linear in the new speed, as the coupled solver takes it
        fine.velocities[0].z() += dt * (force - weight) / (mass + dt * fine.coefficients[0]);
        if (fallen < 8.0 * length) continue;
        sum += dt * std::abs(fine.velocities[0].z());
        span += dt;
    }
    return sum / span / low;
}

}  // namespace

TEST(FineCoupling, in_a_homogeneous_bed_has_the_pressure_gradient_of_ergun)
{
    for (const int cells_per_diameter : {1, 3}) {
        EXPECT_NEAR(ergun_ratio(1.0, cells_per_diameter, 1), 1.0, 0.07) << cells_per_diameter;
        EXPECT_NEAR(ergun_ratio(1000.0, cells_per_diameter, 1), 1.0, 0.03) << cells_per_diameter;
    }
}

TEST(FineCoupling, a_particle_falls_through_water_as_fast_as_its_drag_law_says)
{
    for (const double cells_per_diameter : {1.0 / 3.0, 1.0, 3.0}) {
        EXPECT_NEAR(terminal_speed_ratio(2e-3, cells_per_diameter), 1.0, 0.03) << cells_per_diameter;  // Re 594
        EXPECT_NEAR(terminal_speed_ratio(5e-4, cells_per_diameter), 1.0, 0.03) << cells_per_diameter;  // Re 41
    }
}
