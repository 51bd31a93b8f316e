#pragma once
/// \file sdf/detail/foot_points.h
/// Points on the zero level of a lattice field, one for each node next to a change of sign.
#include <Eigen/Core>
#include <vector>

#include "sdf/detail/cubic_field.h"

namespace coral::sdf::detail {

/// Surface point and unit normal, in the field's lattice steps. Single precision: 1e-4 of a step on the largest lattices.
struct FootPoint {
    Eigen::Vector3f position, normal;
};

/// In lattice order, whatever the number of threads.
std::vector<FootPoint> find_foot_points(const CubicField& field);

}  // namespace coral::sdf::detail
