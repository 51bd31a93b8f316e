#include "sdf/detail/closest_point.h"

#include <algorithm>
#include <limits>

namespace coral::sdf::detail {

NearestFoot::NearestFoot(const Lattice& lattice, const std::vector<FootPoint>& feet, const std::vector<std::uint8_t>& solid,
                         double reach_solid, double reach_open)
    : lattice_(lattice), feet_(feet), row_(std::size_t(lattice.size.x()) + 2), layer_(row_ * (std::size_t(lattice.size.y()) + 2))
{
    const std::size_t total = layer_ * (std::size_t(lattice.size.z()) + 2);
    foot_.assign(total, -1);
    squared_.assign(total, 0.0f);  // the frame of border nodes takes no foot
    for (std::vector<float>* position : {&x_, &y_, &z_}) position->assign(total, std::numeric_limits<float>::infinity());
    for (int i = 0; i < lattice.size.x(); ++i) along_.push_back(float(lattice.origin.x()) + float(lattice.step) * float(i));
    const float solid2 = float(std::min(reach_solid * reach_solid, 1e30)), open2 = float(std::min(reach_open * reach_open, 1e30));
    std::size_t node = 0;
    for (int k = 0; k < lattice.size.z(); ++k)
        for (int j = 0; j < lattice.size.y(); ++j)
            for (int i = 0; i < lattice.size.x(); ++i, ++node) squared_[padded(i, j, k)] = solid[node] ? solid2 : open2;
    scatter();
    // The straight line from a foot to a node stays in one octant, so one sweep for each octant carries it there.
    for (int direction = 0; direction < 8; ++direction) sweep(direction & 1 ? -1 : 1, direction & 2 ? -1 : 1, direction & 4 ? -1 : 1);
}

/// Offers every foot point to the 4^3 nodes around it. The first of equals stays, so the order of feet decides.
void NearestFoot::scatter()
{
    const Eigen::Vector3f origin = lattice_.origin.cast<float>();
    const float step = float(lattice_.step), inverse = 1.0f / step;
    for (std::size_t f = 0; f < feet_.size(); ++f) {
        const Eigen::Vector3f p = (feet_[f].position - origin) * inverse;
        const Eigen::Array3i cell(int(std::floor(p.x())), int(std::floor(p.y())), int(std::floor(p.z())));
        const Eigen::Array3i first = (cell - 1).max(0), last = (cell + 2).min(lattice_.size.array() - 1);
        for (int k = first.z(); k <= last.z(); ++k)
            for (int j = first.y(); j <= last.y(); ++j) {
                const float dy = (p.y() - float(j)) * step, dz = (p.z() - float(k)) * step, side2 = dy * dy + dz * dz;
                std::size_t n = padded(first.x(), j, k);
                for (int i = first.x(); i <= last.x(); ++i, ++n) {
                    const float dx = (p.x() - float(i)) * step, d2 = dx * dx + side2;
                    if (d2 < squared_[n]) {
                        squared_[n] = d2;
                        foot_[n] = std::int32_t(f);
                        x_[n] = feet_[f].position.x();
                        y_[n] = feet_[f].position.y();
                        z_[n] = feet_[f].position.z();
                    }
                }
            }
    }
}

/// Offers a row of nodes the feet of another row, whose nodes stand `other` away. Rows do not overlap.
void NearestFoot::take_from(std::size_t row, std::ptrdiff_t other, float y, float z)
{
    const std::size_t from = row + std::size_t(other);
    const float *px = &x_[from], *py = &y_[from], *pz = &z_[from], *along = along_.data();
    const std::int32_t* pf = &foot_[from];
    float *qx = &x_[row], *qy = &y_[row], *qz = &z_[row], *best = &squared_[row];
    std::int32_t* qf = &foot_[row];
    const int n = lattice_.size.x();
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) {
        const float ex = along[i] - px[i], ey = y - py[i], ez = z - pz[i], d2 = ex * ex + ey * ey + ez * ez;
        const bool nearer = d2 < best[i];
        best[i] = nearer ? d2 : best[i];
        qx[i] = nearer ? px[i] : qx[i];
        qy[i] = nearer ? py[i] : qy[i];
        qz[i] = nearer ? pz[i] : qz[i];
        qf[i] = nearer ? pf[i] : qf[i];
    }
}

/// Carries feet along a row, each node offering its own to the next.
void NearestFoot::carry_along(std::size_t row, int dx, float y, float z)
{
    const int n = lattice_.size.x();
    std::ptrdiff_t i = dx > 0 ? 0 : n - 1;
    std::size_t last = row + std::size_t(i);
    for (int a = 1; a < n; ++a) {
        i += dx;
        const std::size_t node = row + std::size_t(i);
        const float ex = along_[std::size_t(i)] - x_[last], ey = y - y_[last], ez = z - z_[last], d2 = ex * ex + ey * ey + ez * ez;
        if (d2 < squared_[node]) {
            squared_[node] = d2;
            x_[node] = x_[last];
            y_[node] = y_[last];
            z_[node] = z_[last];
            foot_[node] = foot_[last];
        }
        last = node;
    }
}

/// One pass over the lattice: a node takes the foot of any of the seven neighbours already passed, if it is nearer.
void NearestFoot::sweep(int dx, int dy, int dz)
{
    const std::ptrdiff_t ox = -dx, oy = -dy * std::ptrdiff_t(row_), oz = -dz * std::ptrdiff_t(layer_);
    const Eigen::Vector3i n = lattice_.size;
    const float step = float(lattice_.step);
    for (int c = 0; c < n.z(); ++c) {
        const int k = dz > 0 ? c : n.z() - 1 - c;
        const float z = float(lattice_.origin.z()) + step * float(k);
        for (int b = 0; b < n.y(); ++b) {
            const int j = dy > 0 ? b : n.y() - 1 - b;
            const float y = float(lattice_.origin.y()) + step * float(j);
            const std::size_t row = padded(0, j, k);
            for (const std::ptrdiff_t other : {oy, oz, ox + oy, ox + oz, oy + oz, ox + oy + oz}) take_from(row, other, y, z);
            carry_along(row, dx, y, z);
        }
    }
}

}  // namespace coral::sdf::detail
