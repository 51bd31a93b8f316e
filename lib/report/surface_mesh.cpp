#include "report/surface_mesh.h"

#include <algorithm>
#include <cmath>

namespace coral::report {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

/// Trilinear value at a point given in lattice steps, clamped to the lattice.
double sample(const Lattice& lattice, const Vector3d& at)
{
    Vector3i cell;
    Vector3d t;
    for (int a = 0; a < 3; ++a) {
        const double x = std::clamp(at[a], 0.0, static_cast<double>(lattice.size[a] - 1));
        cell[a] = std::min(static_cast<int>(x), lattice.size[a] - 2);
        t[a] = x - cell[a];
    }
    double value = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
        value += (dx ? t.x() : 1 - t.x()) * (dy ? t.y() : 1 - t.y()) * (dz ? t.z() : 1 - t.z()) * lattice.at(cell.x() + dx, cell.y() + dy, cell.z() + dz);
    }
    return value;
}

/// A lattice read with a layer of outside around it: index 0 is that layer.
struct Padded {
    const Lattice& lattice;
    Vector3i size() const { return lattice.size + Vector3i(2, 2, 2); }
    double at(const Vector3i& node) const
    {
        const Vector3i inner = node - Vector3i(1, 1, 1);
        if ((inner.array() < 0).any() || (inner.array() >= lattice.size.array()).any()) return lattice.spacing;
        return lattice.at(inner.x(), inner.y(), inner.z());
    }
};

/// Mean of the crossings on the twelve edges of the cell at `low`, in lattice steps; false when the surface does not pass.
bool cell_vertex(const Padded& field, const Vector3i& low, Vector3d& vertex)
{
    double value[8];
    int inside = 0;
    for (int corner = 0; corner < 8; ++corner) {
        value[corner] = field.at(low + Vector3i(corner & 1, corner >> 1 & 1, corner >> 2));
        inside += value[corner] < 0;
    }
    if (inside == 0 || inside == 8) return false;
    Vector3d sum = Vector3d::Zero();
    int crossings = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (int corner = 0; corner < 8; ++corner) {
            const int other = corner | 1 << axis;
            if (other == corner || (value[corner] < 0) == (value[other] < 0)) continue;
            Vector3d at(corner & 1, corner >> 1 & 1, corner >> 2);
            at[axis] = value[corner] / (value[corner] - value[other]);
            sum += at;
            ++crossings;
        }
    vertex = low.cast<double>() + sum / crossings;
    return true;
}

}  // namespace

Lattice coarsened(const Lattice& lattice, double spacing)
{
    Vector3i low = lattice.size, high = Vector3i::Constant(-1);
    for (int k = 0; k < lattice.size.z(); ++k)
        for (int j = 0; j < lattice.size.y(); ++j)
            for (int i = 0; i < lattice.size.x(); ++i)
                if (lattice.at(i, j, k) < 0) {
                    low = low.cwiseMin(Vector3i(i, j, k));
                    high = high.cwiseMax(Vector3i(i, j, k));
                }
    Lattice coarse;
    coarse.spacing = spacing;
    if (high.x() < 0 || (lattice.size.array() < 2).any()) return coarse;
    const double step = spacing / lattice.spacing;
    const Vector3d start = low.cast<double>() - Vector3d::Constant(1.0);
    for (int a = 0; a < 3; ++a) coarse.size[a] = static_cast<int>(std::ceil((high[a] - low[a] + 2) / step)) + 1;
    coarse.origin = lattice.origin + lattice.spacing * start;
    coarse.distance.reserve(static_cast<std::size_t>(coarse.size.prod()));
    for (int k = 0; k < coarse.size.z(); ++k)
        for (int j = 0; j < coarse.size.y(); ++j)
            for (int i = 0; i < coarse.size.x(); ++i)
                coarse.distance.push_back(static_cast<float>(sample(lattice, start + step * Vector3d(i, j, k))));
    return coarse;
}

Mesh surface_mesh(const Lattice& lattice)
{
    Mesh mesh;
    if (lattice.distance.empty()) return mesh;
    const Padded field{lattice};
    const Vector3i cells = field.size() - Vector3i(1, 1, 1);
    const auto index = [&](const Vector3i& c) {
        return (static_cast<std::size_t>(c.z()) * static_cast<std::size_t>(cells.y()) + static_cast<std::size_t>(c.y())) * static_cast<std::size_t>(cells.x()) +
               static_cast<std::size_t>(c.x());
    };
    std::vector<std::uint32_t> vertex_of(static_cast<std::size_t>(cells.prod()));
    const auto each_cell = [&](const auto& body) {
        for (int k = 0; k < cells.z(); ++k)
            for (int j = 0; j < cells.y(); ++j)
                for (int i = 0; i < cells.x(); ++i) body(Vector3i(i, j, k));
    };
    each_cell([&](const Vector3i& c) {
        Vector3d vertex;
        if (!cell_vertex(field, c, vertex)) return;
        vertex_of[index(c)] = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(lattice.origin + lattice.spacing * (vertex - Vector3d::Ones()));
    });
    // Each edge that the surface crosses is shared by four cells: their vertices make a quad.
    each_cell([&](const Vector3i& c) {
        for (int axis = 0; axis < 3; ++axis) {
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            if (c[u] == 0 || c[v] == 0) continue;
            Vector3i end = c;
            ++end[axis];
            const bool from = field.at(c) < 0, to = field.at(end) < 0;
            if (from == to) continue;
            const auto cell = [&](int du, int dv) {
                Vector3i at = c;
                at[u] -= du;
                at[v] -= dv;
                return vertex_of[index(at)];
            };
            std::array<std::uint32_t, 4> quad{cell(1, 1), cell(0, 1), cell(0, 0), cell(1, 0)};
            if (!from) std::swap(quad[1], quad[3]);
            mesh.triangles.push_back({quad[0], quad[1], quad[2]});
            mesh.triangles.push_back({quad[0], quad[2], quad[3]});
        }
    });
    return mesh;
}

}  // namespace coral::report
