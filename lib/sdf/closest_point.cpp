#include "sdf/detail/closest_point.h"

#include <algorithm>

namespace coral::sdf::detail {

NearestFoot::NearestFoot(const Lattice& lattice, const std::vector<FootPoint>& feet, const std::vector<std::uint8_t>& solid,
                         double reach_solid, double reach_open)
    : lattice_(lattice), feet_(feet), row_(std::size_t(lattice.size.x()) + 2), layer_(row_ * (std::size_t(lattice.size.y()) + 2))
{
    const std::size_t total = layer_ * (std::size_t(lattice.size.z()) + 2);
    foot_.assign(total, -1);
    squared_.assign(total, 0.0f);  // the frame of border nodes takes no foot
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
                    }
                }
            }
    }
}

/// One pass over the lattice: a node takes the foot of any of the seven neighbours already passed, if it is nearer.
void NearestFoot::sweep(int dx, int dy, int dz)
{
    const std::ptrdiff_t ox = -dx, oy = -dy * std::ptrdiff_t(row_), oz = -dz * std::ptrdiff_t(layer_);
    const std::array<std::ptrdiff_t, 7> neighbours = {ox, oy, oz, ox + oy, ox + oz, oy + oz, ox + oy + oz};
    const Eigen::Vector3i n = lattice_.size;
    const Eigen::Vector3f origin = lattice_.origin.cast<float>();
    const float step = float(lattice_.step);
    for (int c = 0; c < n.z(); ++c) {
        const int k = dz > 0 ? c : n.z() - 1 - c;
        const float z = origin.z() + step * float(k);
        for (int b = 0; b < n.y(); ++b) {
            const int j = dy > 0 ? b : n.y() - 1 - b;
            const float y = origin.y() + step * float(j);
            std::size_t node = padded(dx > 0 ? 0 : n.x() - 1, j, k);
            for (int a = 0; a < n.x(); ++a, node += std::size_t(std::ptrdiff_t(dx))) {
                const float x = origin.x() + step * float(dx > 0 ? a : n.x() - 1 - a);
                std::int32_t own = foot_[node], seen = -1;
                float best = squared_[node];
                for (const std::ptrdiff_t offset : neighbours) {
                    const std::int32_t candidate = foot_[node + std::size_t(offset)];
                    if (candidate < 0 || candidate == own || candidate == seen) continue;
                    seen = candidate;
                    const Eigen::Vector3f& p = feet_[std::size_t(candidate)].position;
                    const float ex = x - p.x(), ey = y - p.y(), ez = z - p.z(), d2 = ex * ex + ey * ey + ez * ez;
                    if (d2 < best) {
                        best = d2;
                        own = candidate;
                    }
                }
                foot_[node] = own;
                squared_[node] = best;
            }
        }
    }
}

}  // namespace coral::sdf::detail
