#include "phantom/random.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace coral::phantom {

namespace {
/// Scrambles seed and stream into one state (finaliser of splitmix64, Steele et al. 2014).
std::uint64_t scramble(std::uint64_t seed, std::uint64_t stream)
{
    std::uint64_t z = seed + 0x9e3779b97f4a7c15ULL * (stream + 1);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
}
}  // namespace

RandomSource::RandomSource(std::uint64_t seed, std::uint64_t stream) : engine_(scramble(seed, stream)) {}

double RandomSource::uniform()
{
    return static_cast<double>(engine_() >> 11) * 0x1.0p-53;
}

double RandomSource::uniform(double low, double high)
{
    return low + (high - low) * uniform();
}

double RandomSource::normal()
{
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
}

Eigen::Vector3d RandomSource::direction()
{
    const double z = uniform(-1, 1), phi = uniform(0, 2 * std::numbers::pi), s = std::sqrt(1 - z * z);
    return {s * std::cos(phi), s * std::sin(phi), z};
}

Eigen::Matrix3d RandomSource::rotation()
{
    Eigen::Vector4d q;
    for (double& component : q) component = normal();
    q.normalize();
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

}  // namespace coral::phantom
