#pragma once
/// \file phantom/random.h
/// Random numbers that are the same on every machine: mt19937_64 with distributions written out here.
#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace coral::phantom {

class RandomSource {
public:
    /// Streams of one seed are independent: the n-th grain does not change when more grains are asked for.
    RandomSource(std::uint64_t seed, std::uint64_t stream);
    double uniform();  ///< in [0, 1), 53 bits
    double uniform(double low, double high);
    double normal();              ///< mean 0, standard deviation 1 (Box and Muller 1958)
    Eigen::Vector3d direction();  ///< uniform on the unit sphere
    Eigen::Matrix3d rotation();   ///< uniform over all rotations (normalised Gaussian quaternion)

private:
    std::mt19937_64 engine_;
};

}  // namespace coral::phantom
