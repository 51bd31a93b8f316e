#include "sdf/surface_nodes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <random>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"
#include "sdf/mesh.h"

namespace coral::sdf {
namespace {

struct Sample {
    Eigen::Vector3d position, normal;
    double density = 1.0;  ///< of nodes, wanted here
};

constexpr double hidden_spacing = 3.0;  ///< of nodes where no ball touches, against the others

/// Area-uniform samples of the mesh: the n-th lies at area (n + 1/2) A/count along the triangles, spread in its triangle by
/// the golden-ratio (R2) sequence.
std::vector<Sample> sample_mesh(const TriangleMesh& mesh, const DistanceGrid& grid, std::size_t count, double area, double ball)
{
    std::vector<Sample> samples;
    samples.reserve(count);
    double passed = 0;
    for (const Eigen::Vector3i& t : mesh.triangles) {
        const Eigen::Vector3d a = mesh.vertices[std::size_t(t[0])], u = mesh.vertices[std::size_t(t[1])] - a, v = mesh.vertices[std::size_t(t[2])] - a;
        passed += 0.5 * u.cross(v).norm();
        while (samples.size() < count && (double(samples.size()) + 0.5) * area <= passed * double(count)) {
            const double n = double(samples.size() + 1);
            double p = std::fmod(n * 0.7548776662466927, 1.0), q = std::fmod(n * 0.5698402909980532, 1.0);
            if (p + q > 1) p = 1 - p, q = 1 - q;
            Sample s{a + p * u + q * v, {}};
            grid.sample_with_gradient(s.position, s.normal);
            s.normal.normalize();
            // Half the radius leaves the rims of pores among those that are touched: with 0.9 of it their few nodes stood for ten times the
            // area in every third contact, and undid what the others gained.
            if (ball > 0 && grid.sample(s.position + ball * s.normal) < 0.5 * ball) s.density = 1.0 / (hidden_spacing * hidden_spacing);
            samples.push_back(s);
        }
    }
    return samples;
}

/// Cubes over a cloud of points, in rows.
class Cubes {
public:
    Cubes(std::span<const Eigen::Vector3d> points, double edge) : edge_(edge), lower_(points[0])
    {
        Eigen::Vector3d upper = points[0];
        for (const auto& p : points) lower_ = lower_.cwiseMin(p), upper = upper.cwiseMax(p);
        size_ = ((upper - lower_) / edge).array().floor().cast<int>() + 1;
    }

    std::size_t count() const { return std::size_t(size_.x()) * std::size_t(size_.y()) * std::size_t(size_.z()); }
    std::size_t at(const Eigen::Vector3d& p) const { return number(cell(p)); }
    /// visit(number) for the cubes that a ball may meet, in order.
    template <class Visit>
    void around(const Eigen::Vector3d& p, double radius, const Visit& visit) const
    {
        const Eigen::Vector3i first = cell(p.array() - radius).cwiseMax(0), last = cell(p.array() + radius).cwiseMin((size_.array() - 1).matrix());
        for (int k = first.z(); k <= last.z(); ++k)
            for (int j = first.y(); j <= last.y(); ++j)
                for (int i = first.x(); i <= last.x(); ++i) visit(number({i, j, k}));
    }

private:
    Eigen::Vector3i cell(const Eigen::Vector3d& p) const { return ((p - lower_) / edge_).array().floor().cast<int>(); }
    std::size_t number(const Eigen::Vector3i& c) const
    {
        return std::size_t(c.x()) + std::size_t(size_.x()) * (std::size_t(c.y()) + std::size_t(size_.y()) * std::size_t(c.z()));
    }
    double edge_;
    Eigen::Vector3d lower_;
    Eigen::Vector3i size_;
};

/// Points by cube: lists of them by counting sort.
class Bins {
public:
    Bins(std::span<const Eigen::Vector3d> points, double edge) : cubes_(points, edge), start_(cubes_.count() + 1, 0), items_(points.size())
    {
        for (const auto& p : points) ++start_[cubes_.at(p) + 1];
        std::partial_sum(start_.begin(), start_.end(), start_.begin());
        std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
        for (std::size_t n = 0; n < points.size(); ++n) items_[next[cubes_.at(points[n])]++] = std::uint32_t(n);
    }

    /// visit(item) for items in the cubes that a ball may meet.
    template <class Visit>
    void around(const Eigen::Vector3d& p, double radius, const Visit& visit) const
    {
        cubes_.around(p, radius, [&](std::size_t cube) {
            for (std::uint32_t n = start_[cube]; n < start_[cube + 1]; ++n) visit(items_[n]);
        });
    }

private:
    Cubes cubes_;
    std::vector<std::uint32_t> start_, items_;
};

/// Squared distance that keeps apart points on two sides of a thin wall: normals that differ count as far as `reach`.
double separation(const Sample& a, const Eigen::Vector3d& position, const Eigen::Vector3d& normal, double reach)
{
    return (a.position - position).squaredNorm() + reach * reach * (1.0 - a.normal.dot(normal));
}

/// Dart throwing with a falling radius until `count` samples are taken.
std::vector<std::size_t> seeds(const std::vector<Sample>& samples, std::span<const Eigen::Vector3d> positions, std::size_t count, double spacing)
{
    constexpr std::uint32_t none = ~std::uint32_t{0};
    std::vector<std::size_t> order(samples.size()), chosen;
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::mt19937_64 random(20240117);
    for (std::size_t n = order.size() - 1; n > 0; --n) std::swap(order[n], order[random() % (n + 1)]);
    std::vector<char> taken(samples.size(), 0);
    // Samples are many, those taken few: only these are listed, by cube.
    const Cubes cubes(positions, spacing);
    std::vector<std::uint32_t> newest(cubes.count(), none), older(samples.size(), none);
    for (double radius = spacing; chosen.size() < count; radius = radius > 0.3 * spacing ? 0.92 * radius : 0.0)
        for (const std::size_t s : order) {
            if (chosen.size() == count) break;
            if (taken[s]) continue;
            bool free = true;
            const double wide = radius / std::sqrt(samples[s].density);
            cubes.around(positions[s], wide, [&](std::size_t cube) {
                for (std::uint32_t other = newest[cube]; free && other != none; other = older[other])
                    free = !(separation(samples[s], samples[other].position, samples[other].normal, spacing) < wide * wide);
            });
            if (!free) continue;
            taken[s] = 1;
            std::uint32_t& head = newest[cubes.at(positions[s])];
            older[s] = std::exchange(head, std::uint32_t(s));
            chosen.push_back(s);
        }
    return chosen;
}

/// Number of the nearest node of each sample; `owner` comes with a guess.
void assign(const std::vector<Sample>& samples, const SurfaceNodes& nodes, double spacing, std::vector<std::uint32_t>& owner)
{
    const Bins bins(nodes.positions, 0.75 * spacing);
    parallel_blocks(samples.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s) {
            std::uint32_t nearest = owner[s];
            const auto distance2 = [&](std::uint32_t n) { return separation(samples[s], nodes.positions[n], nodes.normals[n], spacing); };
            double best = distance2(nearest);
            const auto look = [&](std::uint32_t n) {
                const double d2 = distance2(n);
                if (d2 < best || (d2 == best && n < nearest)) best = d2, nearest = n;
            };
            // Nearby first, which mostly shows that there is no need to look as far as a bad guess lies.
            const double first = 0.75 * spacing, far = std::sqrt(best);
            bins.around(samples[s].position, std::min(first, far), look);
            if (far > first && best > first * first) bins.around(samples[s].position, std::sqrt(best), look);
            owner[s] = nearest;
        }
    });
}

void place(const DistanceGrid& grid, Eigen::Vector3d& position, Eigen::Vector3d& normal)
{
    Eigen::Vector3d p = position, gradient;
    for (int n = 0; n < 8; ++n) {
        const double d = grid.sample_with_gradient(p, gradient), slope2 = gradient.squaredNorm();
        if (slope2 < 1e-6 || (p - position).norm() > 2.0 * grid.spacing) break;
        position = p;
        normal = gradient.normalized();
        if (std::abs(d) < 1e-9 * grid.spacing) return;
        p -= (std::clamp(d, -0.5 * grid.spacing, 0.5 * grid.spacing) / slope2) * gradient;
    }
}

/// Moves each node to the sample nearest to the mean of its own samples. Weights of the squared density keep the density, for nodes drift
/// to where weight is: their density goes with its root [CVT in the plane, Du, Faber & Gunzburger 1999].
void lloyd_step(const std::vector<Sample>& samples, const std::vector<std::uint32_t>& owner, double spacing, SurfaceNodes& nodes)
{
    const std::size_t count = nodes.positions.size();
    std::vector<Sample> mean(count, {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
    std::vector<double> share(count, 0.0);
    for (std::size_t s = 0; s < samples.size(); ++s) {
        const double weight = samples[s].density * samples[s].density;
        mean[owner[s]].position += weight * samples[s].position;
        mean[owner[s]].normal += weight * samples[s].normal;
        share[owner[s]] += weight;
    }
    std::vector<double> best(count, std::numeric_limits<double>::infinity());
    for (std::size_t n = 0; n < count; ++n) {
        if (share[n] == 0.0) continue;
        mean[n].position /= share[n];
        mean[n].normal.normalize();
    }
    for (std::size_t s = 0; s < samples.size(); ++s) {
        const std::uint32_t n = owner[s];
        const double d2 = separation(samples[s], mean[n].position, mean[n].normal, spacing);
        if (d2 >= best[n]) continue;
        best[n] = d2;
        nodes.positions[n] = samples[s].position;
        nodes.normals[n] = samples[s].normal;
    }
}

}  // namespace

SurfaceNodes surface_nodes(const DistanceGrid& grid, int count, double ball)
{
    if (count < 4) throw Error("surface nodes", "a count of " + std::to_string(count), "take 4 or more");
    const TriangleMesh mesh = extract_mesh(grid);
    const double area = surface_area(mesh);
    if (!(area > 0)) throw Error("surface nodes", "the grid has no surface");
    const std::size_t n = std::size_t(count);
    const double reach = std::min(ball, 0.8 * grid.outside_limit);
    std::vector<Sample> samples = sample_mesh(mesh, grid, std::max<std::size_t>(40 * n, 4000), area, reach);
    double share = 0;  // of the evenly spread nodes that the wanted density leaves
    for (const Sample& s : samples) share += s.density / double(samples.size());
    if (share < 1) samples = sample_mesh(mesh, grid, std::size_t(double(samples.size()) / share), area, reach);
    const double spacing = std::sqrt(share * area / count);

    std::vector<Eigen::Vector3d> positions;
    for (const Sample& s : samples) positions.push_back(s.position);
    SurfaceNodes nodes;
    for (const std::size_t s : seeds(samples, positions, n, spacing)) {
        nodes.positions.push_back(samples[s].position);
        nodes.normals.push_back(samples[s].normal);
    }
    std::vector<std::uint32_t> owner(samples.size(), 0);
    for (int step = 0; step < 12; ++step) {
        assign(samples, nodes, spacing, owner);
        lloyd_step(samples, owner, spacing, nodes);
    }
    assign(samples, nodes, spacing, owner);
    nodes.areas.assign(n, 0.0);
    for (const std::uint32_t node : owner) nodes.areas[node] += 1.0;
    for (double& a : nodes.areas) a *= area / double(samples.size());
    for (std::size_t i = 0; i < n; ++i) place(grid, nodes.positions[i], nodes.normals[i]);
    return nodes;
}

int node_count_for_spacing(const DistanceGrid& grid, double node_spacing)
{
    return std::max(4, int(std::lround(surface_area(extract_mesh(grid)) / (node_spacing * node_spacing))));
}

}  // namespace coral::sdf
