#include "fluid/poisson.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/parallel.h"

using namespace coral::fluid;

namespace {

enum class Ends { neumann, dirichlet_high, dirichlet_low, dirichlet_both, periodic };
const std::vector<Ends> all_ends = {Ends::neumann, Ends::dirichlet_high, Ends::dirichlet_low, Ends::dirichlet_both,
                                    Ends::periodic};

void set_ends(GridSpec& grid, int axis, Ends ends)
{
    const auto kind = [](bool outlet) { return outlet ? BoundaryKind::outlet : BoundaryKind::slip; };
    grid.boundary[2 * axis].kind = kind(ends == Ends::dirichlet_low || ends == Ends::dirichlet_both);
    grid.boundary[2 * axis + 1].kind = kind(ends == Ends::dirichlet_high || ends == Ends::dirichlet_both);
    if (ends == Ends::periodic)
        grid.boundary[2 * axis].kind = grid.boundary[2 * axis + 1].kind = BoundaryKind::periodic;
}

/// Seven-point Laplacian by the definition of the boundary conditions, cell by cell.
std::vector<double> laplacian(const GridSpec& grid, const std::vector<double>& x)
{
    const Eigen::Vector3i n = grid.cells;
    const auto at = [&](Eigen::Vector3i c) { return x[std::size_t((c.z() * n.y() + c.y()) * n.x() + c.x())]; };
    std::vector<double> result;
    for (int k = 0; k < n.z(); ++k)
        for (int j = 0; j < n.y(); ++j)
            for (int i = 0; i < n.x(); ++i) {
                const Eigen::Vector3i c(i, j, k);
                double sum = 0.0;
                for (int axis = 0; axis < 3; ++axis)
                    for (int side = 0; side < 2; ++side) {
                        Eigen::Vector3i other = c;
                        other[axis] += side == 0 ? -1 : 1;
                        double value = at(c);
                        if (other[axis] >= 0 && other[axis] < n[axis])
                            value = at(other);
                        else if (grid.periodic(axis))
                            other[axis] = (other[axis] + n[axis]) % n[axis], value = at(other);
                        else if (grid.outlet(axis, side))
                            value = -at(c);
                        sum += value - at(c);
                    }
                result.push_back(sum / (grid.cell * grid.cell));
            }
    return result;
}

/// Largest error of the solution for b = lap x with random x of zero mean.
double round_trip_error(const GridSpec& grid, unsigned seed, Precision precision = Precision::float64)
{
    const Poisson poisson(grid, precision);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::vector<double> x(grid.cell_count());
    double mean = 0.0;
    for (double& value : x) mean += value = uniform(random);
    for (double& value : x) value -= mean / double(x.size());
    const std::vector<double> b = laplacian(grid, x);
    FlowField work = poisson.make_work(), scratch;
    const auto address = [&](std::size_t c) {
        const std::size_t nx = std::size_t(grid.cells.x()), ny = std::size_t(grid.cells.y());
        return c % nx + poisson.row() * (c / nx % ny) + poisson.plane() * (c / (nx * ny));
    };
    for (std::size_t c = 0; c < x.size(); ++c) work.set(address(c), b[c]);
    poisson.solve(work, scratch);
    double worst = 0.0;
    for (std::size_t c = 0; c < x.size(); ++c) worst = std::max(worst, std::abs(work[address(c)] - x[c]));
    return worst;
}

}  // namespace

TEST(Poisson, inverts_the_seven_point_laplacian_for_every_mix_of_boundaries)
{
    unsigned seed = 1;
    for (const Ends x : all_ends)
        for (const Ends y : all_ends)
            for (const Ends z : all_ends) {
                GridSpec grid;
                grid.cells = {6, 9, 8};
                grid.cell = 0.3;
                set_ends(grid, 0, x), set_ends(grid, 1, y), set_ends(grid, 2, z);
                EXPECT_LT(round_trip_error(grid, seed), 1e-12) << int(x) << int(y) << int(z);
                ++seed;
            }
}

TEST(Poisson, stays_accurate_on_a_grid_of_working_size)
{
    for (const Ends z : all_ends) {
        GridSpec grid;
        grid.cells = {40, 30, 48};
        grid.cell = 5e-4;
        set_ends(grid, 0, Ends::neumann), set_ends(grid, 1, Ends::periodic), set_ends(grid, 2, z);
        EXPECT_LT(round_trip_error(grid, 7), 1e-11) << int(z);
    }
}

TEST(Poisson, in_single_precision_is_wrong_by_a_few_units_of_the_last_place)
{
    for (const Ends x : all_ends)
        for (const Ends z : all_ends) {
            GridSpec grid;
            grid.cells = {40, 30, 48};
            grid.cell = 5e-4;
            set_ends(grid, 0, x), set_ends(grid, 1, Ends::neumann), set_ends(grid, 2, z);
            EXPECT_LT(round_trip_error(grid, 11, Precision::float32), 3e-5) << int(x) << int(z);  // random values up to 1
        }
}

TEST(Poisson, gives_the_same_bits_with_one_and_two_threads)
{
    GridSpec grid;
    grid.cells = {20, 17, 23};
    grid.cell = 0.1;
    grid.boundary[z_minus].kind = BoundaryKind::outlet;
    const Poisson poisson(grid);
    FlowField one = poisson.make_work(), scratch;
    for (std::size_t c = 0; c < one.size(); ++c) one.set(c, std::sin(double(c * c % 1001)));
    FlowField two = one;
    coral::set_thread_count(1);
    poisson.solve(one, scratch);
    coral::set_thread_count(2);
    poisson.solve(two, scratch);
    EXPECT_EQ(one, two);
}

TEST(Poisson, is_exact_for_odd_even_and_single_cells_across_the_planes)
{
    for (const Eigen::Vector3i& cells :
         {Eigen::Vector3i(1, 1, 5), Eigen::Vector3i(2, 3, 7), Eigen::Vector3i(5, 4, 6), Eigen::Vector3i(7, 1, 9)}) {
        GridSpec grid;
        grid.cells = cells;
        grid.cell = 0.2;
        grid.boundary[z_plus].kind = BoundaryKind::outlet;
        EXPECT_LT(round_trip_error(grid, 3), 1e-12) << cells.transpose();
    }
}
