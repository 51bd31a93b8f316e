#include "sdf/mesh.h"

#include <Eigen/Geometry>
#include <array>
#include <fstream>

#include "core/error.h"
#include "core/output_file.h"

namespace coral::sdf {
namespace {

// Corner c of a cell sits at (c&1, c>>1&1, c>>2). The four edges along an axis are numbered 4*axis + their place in the
// other two axes, so edge numbers follow from corners without a table.
constexpr int corner_axis_bit[3] = {1, 2, 4};

constexpr int edge_between(int a, int b)
{
    const int low = a < b ? a : b, axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
    const int place = axis == 0 ? low >> 1 : axis == 1 ? (low & 1) | (low >> 2 << 1) : low & 3;
    return 4 * axis + place;
}

/// Corners of the six faces, counter-clockwise seen from outside the cell.
constexpr int face_corners[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

class Mesher {
public:
    explicit Mesher(const DistanceGrid& grid) : grid_(grid)
    {
        row_ = grid.size.x();
        layer_ = row_ * grid.size.y();
        for (auto& plane : edge_vertex_) plane.assign(std::size_t(layer_) * 3, -1);
    }

    TriangleMesh run()
    {
        for (int k = 0; k + 1 < grid_.size.z(); ++k) {
            for (int j = 0; j + 1 < grid_.size.y(); ++j)
                for (int i = 0; i + 1 < grid_.size.x(); ++i) cell(i, j, k);
            edge_vertex_[0].swap(edge_vertex_[1]);
            std::fill(edge_vertex_[1].begin(), edge_vertex_[1].end(), -1);
        }
        return std::move(mesh_);
    }

private:
    void cell(int i, int j, int k)
    {
        const float* corner = grid_.distance.data() + grid_.index(i, j, k);
        std::array<float, 8> d;
        int solid = 0;
        for (int c = 0; c < 8; ++c) {
            d[std::size_t(c)] = corner[(c & 1) + row_ * (c >> 1 & 1) + layer_ * (c >> 2)];
            solid |= (d[std::size_t(c)] < 0) << c;
        }
        if (solid == 0 || solid == 255) return;

        std::array<int, 12> next;
        next.fill(-1);
        for (const auto& face : face_corners) link(d, face, next);
        std::array<int, 12> loop;
        for (int start = 0; start < 12; ++start) {
            int length = 0;
            for (int e = start; next[std::size_t(e)] >= 0;) {
                loop[std::size_t(length++)] = vertex(i, j, k, d, e);
                const int following = next[std::size_t(e)];
                next[std::size_t(e)] = -1;
                e = following;
            }
            for (int n = 2; n < length; ++n) mesh_.triangles.emplace_back(loop[0], loop[std::size_t(n - 1)], loop[std::size_t(n)]);
        }
    }

    /// Contour segments of one face, directed with the solid on the right seen from outside the cell (so that polygons turn
    /// counter-clockwise seen from the open side): next[edge where it begins] = edge where it ends.
    static void link(const std::array<float, 8>& d, const int (&face)[4], std::array<int, 12>& next)
    {
        std::array<int, 2> into{}, out{};  // places of the edges where a walk around the face enters and leaves the solid
        int entries = 0, exits = 0;
        for (int n = 0; n < 4; ++n) {
            const bool here = d[std::size_t(face[n])] < 0, there = d[std::size_t(face[(n + 1) % 4])] < 0;
            if (!here && there) into[std::size_t(entries++)] = n;
            if (here && !there) out[std::size_t(exits++)] = n;
        }
        const auto edge = [&face](int n) { return edge_between(face[n], face[(n + 1) % 4]); };
        for (int n = 0; n < entries; ++n) {
            // With two entries the solid corners are opposite. Cut apart, a contour goes around the solid corner after the entry;
            // joined, around the open corner before it.
            int end = out[std::size_t(n)];
            if (entries == 2) {
                const double saddle = double(d[std::size_t(face[0])]) * d[std::size_t(face[2])] - double(d[std::size_t(face[1])]) * d[std::size_t(face[3])];
                const bool solid_even = d[std::size_t(face[0])] < 0;
                const bool joined = solid_even ? saddle > 0 : saddle < 0;  // sign of the bilinear saddle is that of the solid
                const int entry = into[std::size_t(n)];
                end = joined ? (entry + 3) % 4 : (entry + 1) % 4;
            }
            next[std::size_t(edge(into[std::size_t(n)]))] = edge(end);
        }
    }

    int vertex(int i, int j, int k, const std::array<float, 8>& d, int edge)
    {
        const int axis = edge / 4, place = edge % 4;
        const int a = axis == 0 ? place << 1 : axis == 1 ? (place & 1) | (place >> 1 << 2) : place;
        const int b = a | corner_axis_bit[axis];
        const std::ptrdiff_t node = i + (a & 1) + row_ * (j + (a >> 1 & 1));
        int& number = edge_vertex_[std::size_t(a >> 2)][std::size_t(3 * node + axis)];
        if (number < 0) {
            const double da = d[std::size_t(a)], db = d[std::size_t(b)];
            Eigen::Vector3d at = grid_.node(i + (a & 1), j + (a >> 1 & 1), k + (a >> 2));
            at[axis] += grid_.spacing * da / (da - db);
            number = int(mesh_.vertices.size());
            mesh_.vertices.push_back(at);
        }
        return number;
    }

    const DistanceGrid& grid_;
    std::ptrdiff_t row_, layer_;
    std::array<std::vector<int>, 2> edge_vertex_;  // vertex per node and axis, for the lower and upper plane of the cells
    TriangleMesh mesh_;
};

template <class T>
void put(std::ofstream& out, T value)
{
    out.write(reinterpret_cast<const char*>(&value), sizeof value);
}

void finish(OutputFile& output, std::ofstream& stream, const std::filesystem::path& file)
{
    if (!stream.flush()) throw Error(file.string(), "could not be written", "check the space left on the disk");
    stream.close();
    output.commit();
}

}  // namespace

TriangleMesh extract_mesh(const DistanceGrid& grid) { return Mesher(grid).run(); }

double triangle_area(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) { return 0.5 * (b - a).cross(c - a).norm(); }

double surface_area(const TriangleMesh& mesh)
{
    double area = 0;
    for (const Eigen::Vector3i& t : mesh.triangles)
        area += triangle_area(mesh.vertices[std::size_t(t[0])], mesh.vertices[std::size_t(t[1])], mesh.vertices[std::size_t(t[2])]);
    return area;
}

double enclosed_volume(const TriangleMesh& mesh)
{
    if (mesh.vertices.empty()) return 0;
    const Eigen::Vector3d o = mesh.vertices.front();
    double six = 0;
    for (const Eigen::Vector3i& t : mesh.triangles)
        six += (mesh.vertices[std::size_t(t[0])] - o).cross(mesh.vertices[std::size_t(t[1])] - o).dot(mesh.vertices[std::size_t(t[2])] - o);
    return six / 6.0;
}

void write_ply(const TriangleMesh& mesh, const std::filesystem::path& file, double unit)
{
    OutputFile output(file);
    std::ofstream out(output.temporary(), std::ios::binary);
    out << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.size()
        << "\nproperty double x\nproperty double y\nproperty double z\nelement face " << mesh.triangles.size()
        << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const Eigen::Vector3d& v : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis) put(out, v[axis] / unit);
    for (const Eigen::Vector3i& t : mesh.triangles) {
        put(out, std::uint8_t(3));
        for (int n = 0; n < 3; ++n) put(out, std::int32_t(t[n]));
    }
    finish(output, out, file);
}

void write_stl(const TriangleMesh& mesh, const std::filesystem::path& file, double unit)
{
    OutputFile output(file);
    std::ofstream out(output.temporary(), std::ios::binary);
    std::array<char, 80> title{};
    std::string("coralsand grain").copy(title.data(), title.size());
    out.write(title.data(), title.size());
    put(out, std::uint32_t(mesh.triangles.size()));
    for (const Eigen::Vector3i& t : mesh.triangles) {
        const Eigen::Vector3d &a = mesh.vertices[std::size_t(t[0])], &b = mesh.vertices[std::size_t(t[1])], &c = mesh.vertices[std::size_t(t[2])];
        const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
        for (int axis = 0; axis < 3; ++axis) put(out, float(normal[axis]));
        for (const Eigen::Vector3d& v : {a, b, c})
            for (int axis = 0; axis < 3; ++axis) put(out, float(v[axis] / unit));
        put(out, std::uint16_t(0));
    }
    finish(output, out, file);
}

}  // namespace coral::sdf
