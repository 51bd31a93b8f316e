#pragma once
/// \file tools/validate/bed.h
/// Random beds of equal spheres.
#include <Eigen/Core>
#include <vector>

namespace coral::validate {

/// Spheres at random places pushed apart until none overlaps by more than a thousandth of the diameter.
/// \param size  of the box, which is periodic or holds the spheres whole [m]
std::vector<Eigen::Vector3d> random_spheres(int count, double diameter, const Eigen::Vector3d& size, bool periodic, unsigned seed);

}  // namespace coral::validate
