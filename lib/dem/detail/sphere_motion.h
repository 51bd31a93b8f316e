#pragma once
/// \file dem/detail/sphere_motion.h
/// Motion of free spheres on which nothing acts but contacts and gravity: a register full of bodies at a time, their vectors as they lie in memory.
#include <cstring>

#include "dem/detail/impl.h"
#include "dem/detail/lanes.h"

namespace coral::dem::detail {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

/// The quaternion s + (x, y, z) times one of a small turn, half of which is (a, b, c): to second order, once it has unit length again.
template <class V>
[[gnu::always_inline]] inline void turn_little(V a, V b, V c, V& s, V& x, V& y, V& z)
{
    const V now_s = s - (a * x + b * y + c * z), now_x = x + (a * s + b * z - c * y), now_y = y + (b * s + c * x - a * z), now_z = z + (c * s + a * y - b * x);
    s = now_s, x = now_x, y = now_y, z = now_z;
}

class SphereMotion {
public:
    static constexpr std::size_t count = std::size_t(wide_lane_count);

    /// \param gravity  of the world [m/s2]
    SphereMotion(World::Impl& world, double dt, const Vec3& gravity)
        : w_(world), dt_(dt), kick_(repeat(0.5 * dt * gravity)), gravity_(repeat(gravity)), bare_(!world.any_external)
    {
    }

    /// Whether `count` bodies from i on are of that sort. In registers of four it costs more to sort the numbers than is saved.
    bool plain(std::size_t i) const
    {
        if (wide_lane_count < 8 || !bare_ || i + count > w_.x.size()) return false;
        bool all_plain = true;
        for (std::size_t k = i; k < i + count; ++k)
            all_plain = all_plain && w_.in[k] && w_.motion[k] == Motion::free && !w_.has_nodes[k] && (k >= w_.added_mass.size() || w_.added_mass[k] == Vec3::Zero());
        return all_plain;
    }

    /// Half a kick, way and turn.
    void drift(std::size_t i)
    {
        const Flat push = spread(0.5 * dt_ * load(&w_.inverse_mass[i])), weight = spread(load(&w_.mass[i]));
        const Flat force = load(&w_.force[i]), reference = load(&w_.x_reference[i]);
        Flat v = load(&w_.v[i]), x = load(&w_.x[i]), v_end, from2;
        const Flat w = turned(i);
        for (int r = 0; r < 3; ++r) {
            const Lanes before = v.part[r];
            v.part[r] = before + (push.part[r] * force.part[r] + kick_.part[r]);
            v_end.part[r] = 2.0 * v.part[r] - before;
            const Lanes way = dt_ * v.part[r];
            x.part[r] += way;
            const Lanes from = x.part[r] - reference.part[r];
            from2.part[r] = from * from;
            finite_ += v.part[r] * v.part[r] + w.part[r] * w.part[r];
            gravity_work_ += weight.part[r] * gravity_.part[r] * way;
        }
        store(v, &w_.v[i]);
        store(v_end, &w_.v_end[i]);
        store(x, &w_.x[i]);
        store(w, &w_.w[i]);
        const Lanes moved2 = number<0>(from2) + number<1>(from2) + number<2>(from2);
        std::memcpy(&w_.moved2[i], &moved2, sizeof moved2);
        farthest2_ = max(farthest2_, moved2);
        turn(i, w);
    }

    /// The other half of the kick.
    void kick(std::size_t i) const
    {
        const Flat push = spread(0.5 * dt_ * load(&w_.inverse_mass[i])), force = load(&w_.force[i]);
        Flat v = load(&w_.v[i]);
        for (int r = 0; r < 3; ++r) v.part[r] = v.part[r] + (push.part[r] * force.part[r] + kick_.part[r]);
        store(v, &w_.v[i]);
        store(turned(i), &w_.w[i]);
    }

    double farthest2() const
    {
        double farthest = 0.0;
        for (int k = 0; k < wide_lane_count; ++k) farthest = std::max(farthest, farthest2_[k]);
        return farthest;
    }
    double finite() const { return sum(finite_); }
    double gravity_work() const { return sum(gravity_work_); }

private:
    using Lanes = WideLanes;
    static constexpr int n = wide_lane_count;
    using Numbers = std::make_index_sequence<std::size_t(n)>;
    /// Vectors of n bodies, one after the other.
    struct Flat {
        Lanes part[3];
    };

    World::Impl& w_;
    double dt_;
    Flat kick_, gravity_;
    bool bare_;
    Lanes farthest2_ = all<Lanes>(0.0), finite_ = farthest2_, gravity_work_ = farthest2_;

    static Lanes load(const double* from) { return detail::load<Lanes>(from); }
    static Flat load(const Vec3* from) { return {load(from->data()), load(from->data() + n), load(from->data() + 2 * n)}; }
    static void store(const Flat& a, Vec3* to) { std::memcpy(to->data(), &a, sizeof a); }

    static Flat repeat(const Vec3& v)
    {
        Flat all;
        for (int k = 0; k < 3 * n; ++k) all.part[k / n][k % n] = v[k % 3];
        return all;
    }
    /// A number of each body, beside each of its three.
    static Flat spread(Lanes a)
    {
        return [&]<std::size_t... k>(std::index_sequence<k...>) {
            return Flat{__builtin_shufflevector(a, a, int(k / 3)...), __builtin_shufflevector(a, a, int((n + k) / 3)...),
                        __builtin_shufflevector(a, a, int((2 * n + k) / 3)...)};
        }(Numbers());
    }
    /// Number c of each body's three.
    template <int c>
    static Lanes number(const Flat& a)
    {
        constexpr auto at = [](int k) { return 3 * k + c; };
        return [&]<std::size_t... k>(std::index_sequence<k...>) {
            const Lanes low = __builtin_shufflevector(a.part[0], a.part[1], (at(int(k)) < 2 * n ? at(int(k)) : 0)...);
            return __builtin_shufflevector(low, a.part[2], (at(int(k)) < 2 * n ? int(k) : at(int(k)) - n)...);
        }(Numbers());
    }

    Flat turned(std::size_t i) const
    {
        const Flat twist = spread(0.5 * dt_ * load(&w_.inverse_inertia[i])), torque = load(&w_.torque[i]);
        Flat w = load(&w_.w[i]);
        for (int r = 0; r < 3; ++r) w.part[r] = w.part[r] + twist.part[r] * torque.part[r];
        return w;
    }

    /// Orientations, as turn_sphere does it.
    void turn(std::size_t i, const Flat& w)
    {
        Lanes q[4];  // as they lie in memory
        std::memcpy(q, w_.q[i].coeffs().data(), sizeof q);
        Lanes x = part<0>(q), y = part<1>(q), z = part<2>(q), s = part<3>(q);
        turn_little(0.5 * dt_ * number<0>(w), 0.5 * dt_ * number<1>(w), 0.5 * dt_ * number<2>(w), s, x, y, z);
        const Lanes one = all<Lanes>(1.0), length2 = s * s + x * x + y * y + z * z;
        Lanes to_one = all<Lanes>(1.5) - 0.5 * length2;
        const auto far = max(length2 - one, one - length2) >= all<Lanes>(1e-4);
        if (any(far)) to_one = far ? one / sqrt(length2) : to_one;
        interleave(to_one * x, to_one * y, to_one * z, to_one * s, q);
        std::memcpy(w_.q[i].coeffs().data(), q, sizeof q);
    }
    template <int c>
    static Lanes part(const Lanes* q)
    {
        return [&]<std::size_t... k>(std::index_sequence<k...>) {
            const Lanes low = __builtin_shufflevector(q[0], q[1], int(4 * k + c) % (2 * n)...), high = __builtin_shufflevector(q[2], q[3], int(4 * k + c) % (2 * n)...);
            return __builtin_shufflevector(low, high, (int(k) < n / 2 ? int(k) : int(k) + n)...);
        }(Numbers());
    }
    static void interleave(Lanes x, Lanes y, Lanes z, Lanes s, Lanes* q)
    {
        [&]<std::size_t... r>(std::index_sequence<r...>) { ((q[r] = row<int(r)>(x, y, z, s)), ...); }(std::make_index_sequence<4>());
    }
    template <int r>
    static Lanes row(Lanes x, Lanes y, Lanes z, Lanes s)
    {
        constexpr auto body = [](int k) { return (r * n + k) / 4; };
        return [&]<std::size_t... k>(std::index_sequence<k...>) {
            const Lanes xy = __builtin_shufflevector(x, y, (k % 2 == 0 ? body(int(k)) : n + body(int(k)))...);
            const Lanes zs = __builtin_shufflevector(z, s, (k % 2 == 0 ? body(int(k)) : n + body(int(k)))...);
            return __builtin_shufflevector(xy, zs, (k % 4 < 2 ? int(k) : n + int(k))...);
        }(Numbers());
    }
};

#pragma GCC diagnostic pop

}  // namespace coral::dem::detail
