#include "suffusion/fabric.h"

#include <cmath>

namespace coral::suffusion {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Fabric fabric_of(std::span<const Vector3d> normals)
{
    Fabric fabric;
    const double n = fabric.count = static_cast<double>(normals.size());
    if (normals.empty()) return fabric;
    for (const Vector3d& normal : normals) fabric.tensor += normal * normal.transpose() / n;
    const Matrix3d a = 7.5 * (fabric.tensor - Matrix3d::Identity() / 3);
    fabric.anisotropy = std::sqrt(1.5 * a.squaredNorm());
    fabric.floor = 7.5 / std::sqrt(n);
    if (fabric.anisotropy < 1e-12 || normals.size() < 2) return fabric;
    double sum = 0, squares = 0;
    for (const Vector3d& normal : normals) {
        const double s = 11.25 / fabric.anisotropy * normal.dot(a * normal);
        sum += s;
        squares += s * s;
    }
    fabric.error = std::sqrt(std::max(0.0, squares - sum * sum / n) / (n - 1) / n);
    return fabric;
}

}  // namespace coral::suffusion
