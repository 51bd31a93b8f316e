#pragma once
/// \file phantom/waves.h
/// Gaussian random field with one length scale, as a sum of plane waves:
///     f(p) = sqrt(2/M) sum_m cos(k_m . p + phase_m),   |k_m| = 2 pi / wavelength, directions uniform on the sphere
/// [Berk 1987, Phys. Rev. Lett. 58, 2718]. Mean 0, variance 1, isotropic, and Gaussian as M grows.
/// Known at every point, so that the same grain can be imaged at any voxel size.
#include <Eigen/Core>
#include <span>
#include <vector>

#include "phantom/random.h"

namespace coral::phantom {

/// Points p = origin + x-index * step[0] e_x + ... of a lattice aligned with the axes of a rotated frame:
/// the field is asked for at frame * p + offset.
struct Lattice {
    Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();  ///< lattice axes -> grain axes
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();     ///< first point, lattice axes [m]
    Eigen::Vector3d step = Eigen::Vector3d::Ones();       ///< spacing per axis [m]
    Eigen::Vector3i size = Eigen::Vector3i::Ones();       ///< points per axis

    /// Point in grain axes [m].
    Eigen::Vector3d point(int i, int j, int k) const
    {
        return frame * (origin + step.cwiseProduct(Eigen::Vector3d(i, j, k)));
    }
    std::size_t index(int i, int j, int k) const { return (static_cast<std::size_t>(k) * size.y() + j) * size.x() + i; }
    std::size_t count() const { return static_cast<std::size_t>(size.x()) * size.y() * size.z(); }
};

class WaveField {
public:
    /// \param wavelength  length of one period [m]: one void and one wall
    /// \param count       plane waves
    WaveField(double wavelength, int count, RandomSource& random);
    /// Value at one point in grain axes [m].
    double at(const Eigen::Vector3d& point) const;

    /// Values along x rows of a lattice: the phases factorise per axis, so a value costs two multiply-adds a wave.
    class OnLattice {
    public:
        OnLattice(const WaveField& field, const Lattice& lattice);
        /// \param values  one per x index; overwritten
        void row(int j, int k, std::span<float> values) const;

    private:
        int waves_;
        Eigen::Vector3i size_;
        std::vector<float> real_[3], imaginary_[3];  // [index][wave] for y and z, [wave][index] for x
    };

private:
    std::vector<Eigen::Vector3d> wave_vectors_;  // [1/m]
    std::vector<double> phases_;
};

}  // namespace coral::phantom
