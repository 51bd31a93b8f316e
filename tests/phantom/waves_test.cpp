#include "phantom/waves.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace {
using namespace coral::phantom;

TEST(WaveField, has_the_same_values_on_a_lattice_as_point_by_point)
{
    RandomSource random(5, 0);
    const WaveField field(2e-3, 64, random);
    Lattice lattice;
    lattice.frame = random.rotation();
    lattice.origin = {-1e-3, 2e-3, 3e-3};
    lattice.step = {1e-4, 1.5e-4, 2e-4};
    lattice.size = {20, 5, 6};
    const WaveField::OnLattice rows(field, lattice);
    std::vector<float> row(20);
    for (int k = 0; k < 6; ++k) {
        for (int j = 0; j < 5; ++j) {
            rows.row(j, k, row);
            for (int i = 0; i < 20; ++i) EXPECT_NEAR(row[i], field.at(lattice.point(i, j, k)), 2e-5);
        }
    }
}

TEST(WaveField, has_mean_zero_variance_one_and_the_correlation_of_its_spectrum)
{
    // Over realisations: <f(0) f(x)> = sin(kx)/(kx) for wave vectors uniform on the sphere |k| = 2 pi / wavelength.
    const double wavelength = 1.0, x = 0.3, kx = 2 * std::numbers::pi * x / wavelength;
    double mean = 0, square = 0, product = 0;
    const int fields = 4000;
    for (int n = 0; n < fields; ++n) {
        RandomSource random(11, n);
        const WaveField field(wavelength, 32, random);
        const double a = field.at({0, 0, 0}), b = field.at({0, 0, x});
        mean += a / fields;
        square += a * a / fields;
        product += a * b / fields;
    }
    const double deviation = 1 / std::sqrt(double(fields));
    EXPECT_NEAR(mean, 0, 4 * deviation);
    EXPECT_NEAR(square, 1, 6 * deviation);
    EXPECT_NEAR(product, std::sin(kx) / kx, 6 * deviation);
}
}  // namespace
