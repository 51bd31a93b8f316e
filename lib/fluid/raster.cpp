#include "fluid/detail/raster.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace coral::fluid::detail {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

/// Lattice of the corners of all control volumes of a component within a box of them.
struct Corners {
    Vector3d origin;  ///< of lattice point (0, 0, 0), world
    double spacing = 0.0;
    Vector3i low;   ///< first control volume
    Vector3i high;  ///< one past the last
    Vector3i points;
    std::vector<double> distance;

    bool empty() const { return (high - low).minCoeff() <= 0; }
    std::size_t index(int i, int j, int k) const
    {
        return (std::size_t(k) * std::size_t(points.y()) + std::size_t(j)) * std::size_t(points.x()) + std::size_t(i);
    }
};

/// Axis-aligned box of the body in the world.
void world_box(const BodyShape& shape, const RigidMotion& motion, Vector3d& low, Vector3d& high)
{
    const Eigen::Matrix3d turn = motion.orientation.toRotationMatrix();
    const Vector3d middle = motion.position + turn * (0.5 * (shape.box_min + shape.box_max));
    const Vector3d half = turn.cwiseAbs() * (0.5 * (shape.box_max - shape.box_min));
    low = middle - half;
    high = middle + half;
}

Corners corners_of(const GridSpec& grid, int component, const BodyShape& shape, const RigidMotion& motion)
{
    Vector3d box_low, box_high;
    world_box(shape, motion, box_low, box_high);
    Corners c;
    c.spacing = grid.cell;
    for (int d = 0; d < 3; ++d) {
        const double shift = d == component ? 0.5 : 0.0;  // volume i spans (i - shift, i + 1 - shift) cells
        const int first = component == cells_component || d != component ? 0 : grid.first_unknown(d);
        const int last = component == cells_component || d != component ? grid.cells[d] : grid.last_unknown(d);
        const double low = (box_low[d] - grid.origin[d]) / grid.cell + shift,
                     high = (box_high[d] - grid.origin[d]) / grid.cell + shift;
        if (grid.periodic(d)) {
            c.low[d] = int(std::floor(low));
            c.high[d] = std::min(int(std::floor(high)) + 1, c.low[d] + grid.cells[d]);
        } else {
            c.low[d] = std::max(first, int(std::floor(std::clamp(low, -1.0, double(last)))));
            c.high[d] = std::min(last, int(std::floor(std::clamp(high, -1.0, double(last)))) + 1);
        }
        c.origin[d] = grid.origin[d] + (c.low[d] - shift) * grid.cell;
    }
    c.points = c.high - c.low + Vector3i::Ones();
    return c;
}

/// Distances on the lattice. Blocks of points that lie further from the surface than their own size plus the diagonal
/// of a cell are settled by one query: all volumes with a corner there are then all solid or all fluid, whatever the
/// exact value.
void sample(Corners& c, const BodyShape& shape, const RigidMotion& motion)
{
    c.distance.resize(c.index(0, 0, c.points.z()));
    const Eigen::Matrix3d to_body = motion.orientation.conjugate().toRotationMatrix();
    std::vector<Vector3i> blocks, undecided;
    std::vector<Vector3d> points;
    std::vector<double> values;
    int size = 8;
    for (int k = 0; k < c.points.z(); k += size)
        for (int j = 0; j < c.points.y(); j += size)
            for (int i = 0; i < c.points.x(); i += size) blocks.emplace_back(i, j, k);
    for (; size >= 1; size /= 2) {
        points.clear();
        for (const Vector3i& b : blocks) {
            const Vector3d middle = b.cast<double>() + Vector3d::Constant(0.5 * (size - 1));
            points.push_back(to_body * (c.origin + c.spacing * middle - motion.position));
        }
        values.resize(points.size());
        shape.distance(points, values);
        const double settled = 1.05 * std::sqrt(3.0) * (0.5 * (size - 1) + 1.0) * c.spacing;
        undecided.clear();
        for (std::size_t b = 0; b < blocks.size(); ++b) {
            const Vector3i low = blocks[b], high = (low + Vector3i::Constant(size)).cwiseMin(c.points);
            if (size > 1 && std::abs(values[b]) < settled) {
                for (int child = 0; child < 8; ++child) {
                    const Vector3i corner = low + (size / 2) * Vector3i(child & 1, (child >> 1) & 1, child >> 2);
                    if ((c.points - corner).minCoeff() > 0) undecided.push_back(corner);
                }
                continue;
            }
            for (int k = low.z(); k < high.z(); ++k)
                for (int j = low.y(); j < high.y(); ++j)
                    for (int i = low.x(); i < high.x(); ++i) c.distance[c.index(i, j, k)] = values[b];
        }
        blocks.swap(undecided);
    }
}

std::array<double, 8> corner_distances(const Corners& c, int i, int j, int k)
{
    std::array<double, 8> d;
    for (int corner = 0; corner < 8; ++corner)
        d[std::size_t(corner)] = c.distance[c.index(i + (corner & 1), j + ((corner >> 1) & 1), k + (corner >> 2))];
    return d;
}

/// sum max(-d, 0) / sum |d|, every distance lowered by `shift`.
double solid_fraction(const std::array<double, 8>& distances, double shift)
{
    double solid = 0.0, all = 0.0;
    for (const double distance : distances) {
        const double d = distance - shift;
        solid += std::max(-d, 0.0);
        all += std::abs(d);
    }
    return all > 0.0 ? solid / all : 0.0;
}

/// A volume with solid in it, counted from the first, x fastest.
struct Volume {
    Vector3i at;
    bool near;  ///< the surface cuts it, or would if it lay a quarter of a cell off
};

std::vector<Volume> volumes_with_solid(const Corners& c)
{
    const double near = 0.25 * c.spacing;
    const Vector3i count = c.high - c.low;
    std::vector<Volume> found;
    std::vector<double> lowest(std::size_t(c.points.x())), highest(lowest);  // of the four rows of corners around a row
    for (int k = 0; k < count.z(); ++k)
        for (int j = 0; j < count.y(); ++j) {
            const double *a = &c.distance[c.index(0, j, k)], *b = &c.distance[c.index(0, j + 1, k)],
                         *d = &c.distance[c.index(0, j, k + 1)], *e = &c.distance[c.index(0, j + 1, k + 1)];
            for (std::size_t i = 0; i < lowest.size(); ++i) {
                lowest[i] = std::min(std::min(a[i], b[i]), std::min(d[i], e[i]));
                highest[i] = std::max(std::max(a[i], b[i]), std::max(d[i], e[i]));
            }
            for (int i = 0; i < count.x(); ++i) {
                const auto n = std::size_t(i);
                if (std::min(lowest[n], lowest[n + 1]) >= near) continue;
                found.push_back({Vector3i(i, j, k), std::max(highest[n], highest[n + 1]) > -near});
            }
        }
    return found;
}

/// Distance at the middle of the volumes near the surface.
std::vector<double> middle_distances(const Corners& c, const std::vector<Volume>& volumes, const BodyShape& shape,
                                     const RigidMotion& motion)
{
    const Eigen::Matrix3d to_body = motion.orientation.conjugate().toRotationMatrix();
    std::vector<Vector3d> middles;
    for (const Volume& v : volumes)
        if (v.near)
            middles.push_back(
                to_body * (c.origin + c.spacing * (v.at.cast<double>() + Vector3d::Constant(0.5)) - motion.position));
    std::vector<double> distances(middles.size());
    shape.distance(middles, distances);
    return distances;
}

/// What the mean distance of the corners is above the distance of the middle: near a surface of principal radii R1, R2
/// about h2 (1/R1 + 1/R2)/8.
double corner_excess(const std::array<double, 8>& corners, double middle)
{
    double mean = 0.0;
    for (const double d : corners) mean += 0.125 * d;
    return mean - middle;
}

void add_solid(SolidSet& set, std::uint32_t at, const Vector3i& v)
{
    SolidRun* last = set.runs.empty() ? nullptr : &set.runs.back();
    if (last && last->j == v.y() && last->k == v.z() && last->i + last->length == v.x() &&
        last->at + std::uint32_t(last->length) == at)
        ++last->length;
    else
        set.runs.push_back({at, std::int16_t(v.x()), std::int16_t(v.y()), std::int16_t(v.z()), 1});
}

int wrap(int i, int n)
{
    return ((i % n) + n) % n;
}

/// The corner rule puts the surface of a sphere 0.11 h2/R too far in, whatever R: with 0.44 of the excess (h2/4R) the
/// volume is right. A Brinkman layer lets the flow in by another 0.3 h2/R; the faces, which carry it, take that back
/// [fitted to the drag of periodic arrays: docs/numerics.md, eq. 9].
constexpr double volume_part = 0.44, face_part = 1.65;

}  // namespace

SolidSet find_solid(const GridSpec& grid, const Layout& layout, int component, const BodyShape& shape,
                    const RigidMotion& motion, FractionRule rule)
{
    constexpr double negligible = 1e-6;
    SolidSet set;
    Corners c = corners_of(grid, component, shape, motion);
    if (c.empty()) return set;
    set.low = c.low, set.high = c.high;
    sample(c, shape, motion);
    const double part = rule == FractionRule::corners ? 0.0 : component == cells_component ? volume_part : face_part;
    const std::vector<Volume> volumes = volumes_with_solid(c);
    const std::vector<double> middles =
        part > 0.0 ? middle_distances(c, volumes, shape, motion) : std::vector<double>{};
    const auto wrapped = [&](int i, int d) { return grid.periodic(d) ? wrap(i, grid.cells[d]) : i; };
    std::size_t next = 0;
    for (const Volume& volume : volumes) {
        double phi = 1.0;
        if (volume.near) {
            const std::array<double, 8> corners =
                corner_distances(c, volume.at.x(), volume.at.y(), volume.at.z());
            phi = solid_fraction(corners, part > 0.0 ? part * corner_excess(corners, middles[next++]) : 0.0);
        }
        if (phi < negligible) continue;
        const Vector3i v = c.low + volume.at;
        const auto at = std::uint32_t(layout.index(wrapped(v.x(), 0), wrapped(v.y(), 1), wrapped(v.z(), 2)));
        if (phi < 1.0 - negligible)
            set.cuts.push_back({at, std::int16_t(v.x()), std::int16_t(v.y()), std::int16_t(v.z()), float(phi)});
        else
            add_solid(set, at, v);
    }
    return set;
}

}  // namespace coral::fluid::detail
