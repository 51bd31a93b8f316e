// Contact of spheres with grids and polyhedra: one query of the distance at the centre.
#include <cmath>

#include "core/parallel.h"
#include "dem/detail/crossing.h"
#include "dem/detail/impl.h"

namespace coral::dem {

namespace {

/// Slot of the wall with this normal (frame of the grid): within 37 degrees of it, or a new one.
int slot_of(Slots& slots, const Vec3& normal)
{
    for (int k = 0; k < Slots::count; ++k)
        if ((slots.used >> k & 1) && slots.normal[k].dot(normal) > 0.8) {
            slots.normal[k] = normal;
            return k;
        }
    int k = 0;
    while (k < Slots::count && (slots.used >> k & 1)) ++k;
    if (k == Slots::count) {
        k = slots.next;
        slots.next = std::uint8_t((slots.next + 1) % Slots::count);
    }
    slots.used = std::uint8_t(slots.used | 1 << k);
    slots.spring[k].setZero();
    slots.normal[k] = normal;
    return k;
}

}  // namespace

void World::Impl::sphere_grid_loop(double dt)
{
    SphereGridList& l = sphere_grids;
    const std::size_t base = (spheres.rows.size() + row_grain - 1) / row_grain + (sphere_walls.body.size() + entry_grain - 1) / entry_grain;
    parallel_blocks(l.sphere.size(), grid_grain, [&](std::size_t first, std::size_t last) {
        const std::size_t block = first / grid_grain;
        LoopSums s;
        std::vector<Crossing>& crossing = crossings[base + block];
        GeneralForce* const begin = l.out.data() + first;
        GeneralForce* out = begin;
        for (std::size_t k = first; k < last; ++k) {
            const std::size_t i = std::size_t(l.sphere[k]), j = std::size_t(l.grid[k]);
            const Vec3 offset = periodic(x[i] - x[j]);
            const detail::DistanceField field(*shapes[std::size_t(shape[j])]);
            Vec3 local_gradient;
            const Vec3 local = q[j].conjugate() * offset;
            const double overlap = radius[i] - scale[j] * field.distance_and_gradient(local / scale[j], local_gradient);
            const bool touching = overlap > 0.0;
            if (!touching && l.touch[k] == 0) continue;
            const PairLaw& pair = law(material[i], material[j]);
            const double slope = local_gradient.norm();
            const Vec3 local_normal = slope > 1e-9 ? Vec3(local_gradient / slope) : Vec3::UnitZ();
            const Vec3 n = q[j] * local_normal;
            const Vec3 arm_j = offset - n * (radius[i] - 0.5 * overlap);  // contact point, from the grid's centre
            const Vec3 relative = v[i] - v[j] - w[j].cross(offset);
            const double root_mass = std::sqrt(1.0 / (inverse_mass[i] + inverse_mass[j]));
            const double approach = (v_end[j] + w[j].cross(offset) - v_end[i]).dot(n);
            if (touching != (l.touch[k] != 0) && dt > 0.0 && l.touch[k] != 2) {
                // Where the centre was against the grid a step ago: the rigid motion of the pair taken back.
                const Vec3 before = q[j].conjugate() * Vec3(offset - relative * dt);
                const double past = radius[i] - scale[j] * field.distance(before / scale[j]);
                detail::add_crossing(crossing, Index(i), Index(j), pair, past, overlap, approach, root_mass, dt, n, offset, s);
            }
            if (!touching) {
                for (int slot = 0; slot < Slots::count; ++slot)
                    if (l.slots[k].used >> slot & 1) s.friction += 0.5 * pair.kt * l.slots[k].spring[slot].squaredNorm();
                l.slots[k].used = 0;
                l.touch[k] = 0;
                continue;
            }
            const double cap = options.overlap_cap * radius[i], pressed = std::min(overlap, cap);
            const double fn = normal_force(pair.kn * pressed * slope, approach, pair, root_mass, dt, s);
            const double arm_i = radius[i] - 0.5 * overlap;
            const Vec3 velocity = v[i] - v[j] - arm_i * w[i].cross(n) - w[j].cross(arm_j);
            const Vec3 slide = velocity - n.dot(velocity) * n;
            Slots& slots = l.slots[k];
            const int slot = slot_of(slots, local_normal);
            const Vec3 ft = tangential_force(pair, fn, n, slide, 0.5 * (w[i] + w[j]).dot(n), root_mass, dt, 1.0, slots.spring[slot], s);
            out->a = Index(i);
            out->b = Index(j);
            out->points = 1;
            out->overlap = overlap;
            out->normal_force = fn * n;
            out->tangential_force = ft;
            out->torque_a = -arm_i * n.cross(ft);
            out->torque_b = -arm_j.cross(out->normal_force + ft);
            out->arm = -arm_i * n;
            ++out;
            l.touch[k] = fn > 0.0 ? 1 : 2;
            s.elastic_normal += pair.kn * pressed * (overlap - 0.5 * pressed);
            s.max_overlap = std::max(s.max_overlap, overlap / radius[i]);
            s.deep += overlap > cap;
        }
        s.tests = std::int64_t(last - first);
        s.touching = out - begin;
        out_count[2][block] = std::int32_t(out - begin);
        block_sums[base + block] = s;
    });
}

}  // namespace coral::dem
