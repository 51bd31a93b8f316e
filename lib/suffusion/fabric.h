#pragma once
/// \file suffusion/fabric.h
/// Fabric of the contacts: how evenly their normals point, and how far chance alone explains it.
#include <Eigen/Core>
#include <span>

namespace coral::suffusion {

struct Fabric {
    double count = 0;                                      ///< contacts
    Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();      ///< F = mean of n n^T, trace 1 (zero without contacts) [-]
    double anisotropy = 0;                                 ///< degree A of anisotropy [-]
    double error = 0;                                      ///< standard error of A [-]
    double floor = 0;                                      ///< A expected of as many random normals [-]
};

/// Fabric of contact normals.
///     F = 1/N sum n n^T,   a = 15/2 (F - I/3),   A = sqrt(3/2 a:a)      [Satake 1982; Guo and Zhao 2013]
/// By the delta method, with s_i = dA/dF : n_i n_i^T = 45/(4 A) n_i.a n_i, the standard error is sd(s)/sqrt(N). For random normals
/// E[(F - I/3):(F - I/3)] = 2/(3 N), so that sqrt(E[A^2]) = 7.5/sqrt(N): below that A tells nothing.
/// \param normals  unit vectors; their sign does not matter
/// \note Contacts are taken as independent; those of one grain are not quite, so the error is a lower bound.
Fabric fabric_of(std::span<const Eigen::Vector3d> normals);

}  // namespace coral::suffusion
