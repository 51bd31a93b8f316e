// Friction springs of a sample whose grains have new shapes.
#include <algorithm>
#include <limits>
#include <memory>

#include "pack/detail/swap.h"
#include "pack/sample_world.h"

namespace coral::pack::detail {
namespace {

using Vec3 = Eigen::Vector3d;

/// Whether contact treats both alike, so that a friction spring between them means the same.
bool same_kind_of_contact(ShapeKind a, ShapeKind b)
{
    const auto group = [](ShapeKind k) { return k == ShapeKind::sphere ? 0 : k == ShapeKind::polyhedron ? 1 : 2; };
    return group(a) == group(b);
}

}  // namespace

bool same_template(const ShapeTemplate& a, const ShapeTemplate& b)
{
    if (a.kind != b.kind || !a.grid || !b.grid || a.nodes != b.nodes) return false;
    return a.grid == b.grid || (a.grid->distance == b.grid->distance && a.grid->origin == b.grid->origin &&
           a.grid->spacing == b.grid->spacing);
}

void keep_springs(const Sample& old, const std::vector<Vec3>& origin, const std::vector<char>& is_new, Sample& sample, SwapReport& report)
{
    const auto old_shape = [&](int i) -> const ShapeTemplate& { return old.shapes[std::size_t(old.particles[std::size_t(i)].shape)]; };
    const auto new_shape = [&](int i) -> const ShapeTemplate& { return sample.shapes[std::size_t(sample.particles[std::size_t(i)].shape)]; };
    std::vector<std::shared_ptr<const dem::Shape>> olds(old.shapes.size()), news(sample.shapes.size());
    const auto made = [](auto& list, const auto& shapes, int k) -> const dem::Shape& {
        if (!list[std::size_t(k)]) list[std::size_t(k)] = make_shape(shapes[std::size_t(k)]);
        return *list[std::size_t(k)];
    };
    report.springs_before = int(old.springs.size());
    sample.springs.clear();
    for (ContactSpring s : old.springs) {
        bool kept = true;
        for (const int body : {s.first, s.second})
            kept = kept && (body < 0 || same_kind_of_contact(old_shape(body).kind, new_shape(body).kind));
        if (!kept) continue;
        const bool nodes = new_shape(s.first).kind != ShapeKind::sphere;
        if (nodes && is_new[std::size_t(s.first)] && !same_template(old_shape(s.first), new_shape(s.first))) {
            const Particle &p = old.particles[std::size_t(s.first)], &q = sample.particles[std::size_t(s.first)];
            const dem::Shape& before = made(olds, old.shapes, p.shape);
            const dem::Shape& after = made(news, sample.shapes, q.shape);
            if (s.node < 0 || std::size_t(s.node) >= before.nodes().size()) continue;
            const Vec3 place = (before.nodes()[std::size_t(s.node)] - origin[std::size_t(s.first)]) * (p.scale / q.scale);
            double nearest = std::numeric_limits<double>::infinity();
            for (std::size_t n = 0; n < after.nodes().size(); ++n)
                if (const double d = (after.nodes()[n] - place).squaredNorm(); d < nearest) nearest = d, s.node = int(n);
            const auto twin = [&](const ContactSpring& t) { return t.first == s.first && t.second == s.second && t.node == s.node; };
            if (std::any_of(sample.springs.begin(), sample.springs.end(), twin)) continue;
        }
        sample.springs.push_back(s);
    }
    report.springs_kept = int(sample.springs.size());
}

}  // namespace coral::pack::detail
