// Contact loops of spheres against spheres and walls, in closed form.
// Each block of the loop writes its touching contacts into its own part of `out`; sums are taken later, in order.
#include <cmath>

#include "core/parallel.h"
#include "dem/detail/crossing.h"
#include "dem/detail/impl.h"

namespace coral::dem {

void World::Impl::sphere_loop(double dt)
{
    SphereList& l = spheres;
    const Vec3* const xs = x.data();
    const double* const rs = radius.data();
    parallel_blocks(l.rows.size(), row_grain, [&](std::size_t first, std::size_t last) {
        const std::size_t block = first / row_grain;
        LoopSums s;
        std::vector<Crossing>& crossing = crossings[block];
        PointForce* const begin = l.out.data() + l.row[first];
        PointForce* out = begin;
        for (std::size_t r = first; r < last; ++r) {
            const std::size_t i = std::size_t(l.rows[r]);
            const Vec3 xi = xs[i];
            const double ri = rs[i];
            for (Index k = l.row[r]; k < l.row[r + 1]; ++k) {
                const std::size_t j = std::size_t(l.other[k]);
                const Vec3 d = periodic(xi - xs[j]);
                const double reach = ri + rs[j], d2 = d.squaredNorm();
                if (d2 >= reach * reach && l.touch[k] == 0) continue;
                const PairLaw& pair = law(material[i], material[j]);
                const double length = std::sqrt(d2);
                const Vec3 n = length > 0.0 ? Vec3(d / length) : Vec3::UnitZ();
                const double overlap = reach - length;
                const Vec3 relative = v[i] - v[j];
                const double root_mass = std::sqrt(1.0 / (inverse_mass[i] + inverse_mass[j]));
                const double approach = (v_end[j] - v_end[i]).dot(n);
                const bool touching = overlap > 0.0;
                if (touching != (l.touch[k] != 0) && dt > 0.0 && l.touch[k] != 2)
                    detail::add_crossing(crossing, Index(i), Index(j), pair, reach - (d - relative * dt).norm(), overlap, approach, root_mass, dt, n,
                                 Vec3::Zero(), s);
                if (!touching) {
                    s.friction += 0.5 * pair.kt * l.spring[k].squaredNorm();
                    l.spring[k].setZero();
                    l.touch[k] = 0;
                    continue;
                }
                const double smaller = std::min(ri, rs[j]), cap = options.overlap_cap * smaller;
                const double pressed = std::min(overlap, cap);
                const double fn = normal_force(pair.kn * pressed, approach, pair, root_mass, dt, s);
                const double arm_i = ri - 0.5 * overlap, arm_j = rs[j] - 0.5 * overlap;
                const Vec3 slide = relative - relative.dot(n) * n - (arm_i * w[i] + arm_j * w[j]).cross(n);
                out->tangential = tangential_force(pair, fn, n, slide, 0.5 * (w[i] + w[j]).dot(n), root_mass, dt, 1.0, l.spring[k], s);
                out->a = Index(i);
                out->b = Index(j);
                out->normal = n;
                out->force = fn;
                out->overlap = overlap;
                out->arm_a = arm_i;
                out->arm_b = arm_j;
                ++out;
                l.touch[k] = fn > 0.0 ? 1 : 2;
                s.elastic_normal += pair.kn * pressed * (overlap - 0.5 * pressed);
                s.max_overlap = std::max(s.max_overlap, overlap / smaller);
                s.deep += overlap > cap;
            }
        }
        s.tests = l.row[last] - l.row[first];
        s.touching = out - begin;
        out_count[0][block] = std::int32_t(out - begin);
        block_sums[block] = s;
    });
}

void World::Impl::sphere_wall_loop(double dt)
{
    SphereWallList& l = sphere_walls;
    const std::size_t base = (spheres.rows.size() + row_grain - 1) / row_grain;
    parallel_blocks(l.body.size(), entry_grain, [&](std::size_t first, std::size_t last) {
        const std::size_t block = first / entry_grain;
        LoopSums s;
        std::vector<Crossing>& crossing = crossings[base + block];
        PointForce* const begin = l.out.data() + first;
        PointForce* out = begin;
        for (std::size_t k = first; k < last; ++k) {
            const std::size_t i = std::size_t(l.body[k]);
            const WallData& wall = walls[std::size_t(l.wall[k])];
            const double ri = radius[i];
            Vec3 n = wall.normal;
            double distance = 0.0;
            bool facing = true;
            if (wall.kind == WallData::Kind::plane) distance = n.dot(x[i] - wall.point);
            else facing = wall.plate.feature(l.feature[k], x[i], distance, n);
            const double overlap = facing ? ri - distance : -1.0;
            const bool touching = overlap > 0.0;
            if (!touching && l.touch[k] == 0) continue;
            const PairLaw& pair = law(material[i], wall.material);
            const Vec3 relative = v[i] - wall.velocity;
            const double approach = (wall.velocity - v_end[i]).dot(n), root_mass = std::sqrt(mass[i]);
            if (touching != (l.touch[k] != 0) && dt > 0.0 && facing && l.touch[k] != 2)
                detail::add_crossing(crossing, Index(i), -1 - l.wall[k], pair, overlap + relative.dot(n) * dt, overlap, approach, root_mass, dt, n, Vec3::Zero(), s);
            if (!touching) {
                s.friction += 0.5 * pair.kt * l.spring[k].squaredNorm();
                l.spring[k].setZero();
                l.touch[k] = 0;
                continue;
            }
            const double cap = options.overlap_cap * ri, pressed = std::min(overlap, cap);
            const double fn = normal_force(pair.kn * pressed, approach, pair, root_mass, dt, s);
            const double arm = ri - overlap;
            const Vec3 slide = relative - relative.dot(n) * n - (arm * w[i]).cross(n);
            out->tangential = tangential_force(pair, fn, n, slide, 0.5 * w[i].dot(n), root_mass, dt, 1.0, l.spring[k], s);
            out->a = Index(i);
            out->b = -1 - l.wall[k];
            out->normal = n;
            out->force = fn;
            out->overlap = overlap;
            out->arm_a = arm;
            out->arm_b = 0.0;
            ++out;
            l.touch[k] = fn > 0.0 ? 1 : 2;
            s.elastic_normal += pair.kn * pressed * (overlap - 0.5 * pressed);
            s.max_overlap = std::max(s.max_overlap, overlap / ri);
            s.deep += overlap > cap;
        }
        s.tests = std::int64_t(last - first);
        s.touching = out - begin;
        out_count[1][block] = std::int32_t(out - begin);
        block_sums[base + block] = s;
    });
}

}  // namespace coral::dem
