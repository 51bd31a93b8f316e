#include "morph/oriented_box.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "core/error.h"

namespace coral::morph {
namespace {

/// A turn of the box and the volume it then has.
struct Turn {
    Eigen::Matrix3d axes;  ///< a row each
    double volume;
};

/// How many turns are refined, and between which angles.
struct Stage {
    std::size_t kept;
    double from, to;
};

class Points {
public:
    explicit Points(std::span<const Eigen::Vector3d> points) : xyz_(Eigen::Index(points.size()), 3), along_(Eigen::Index(points.size()))
    {
        for (std::size_t p = 0; p < points.size(); ++p) xyz_.row(Eigen::Index(p)) = points[p].transpose();
    }
    Eigen::Vector3d edges(const Eigen::Matrix3d& axes)
    {
        Eigen::Vector3d out;
        for (int a = 0; a < 3; ++a) {
            along_ = axes(a, 0) * xyz_.col(0) + axes(a, 1) * xyz_.col(1) + axes(a, 2) * xyz_.col(2);
            out[a] = along_.maxCoeff() - along_.minCoeff();
        }
        return out;
    }
    Turn turned(const Eigen::Matrix3d& axes) { return {axes, edges(axes).prod()}; }

private:
    Eigen::Array<double, Eigen::Dynamic, 3> xyz_;
    Eigen::ArrayXd along_;
};

/// Rotations spread over the part of the rotation group that the symmetries of a box leave: in Rodrigues' parameters a cube of
/// half width tan(pi/8) without its corners [Frank 1988, Metall. Trans. A 19].
std::vector<Turn> starts(Points& points)
{
    constexpr int cells = 7;
    const double half = std::sqrt(2.0) - 1.0;
    std::vector<Turn> out;
    for (int i = 0; i < cells; ++i)
        for (int j = 0; j < cells; ++j)
            for (int k = 0; k < cells; ++k) {
                const Eigen::Vector3d r = half * ((2.0 * Eigen::Array3d(i, j, k) + 1.0) / cells - 1.0);
                if (r.lpNorm<1>() > 1.0) continue;
                out.push_back(points.turned(Eigen::Quaterniond(1, r.x(), r.y(), r.z()).normalized().toRotationMatrix()));
            }
    return out;
}

/// Turns about the edges, face and body diagonals of the box, halving the angle when none of them helps. The volume has kinks
/// wherever the box comes flush with an edge of the hull, along which turns about the edges alone would stop too early.
void refine(Points& points, Turn& turn, double angle, double least)
{
    static const std::vector<Eigen::Vector3d> about = [] {
        std::vector<Eigen::Vector3d> out;
        for (int n = 0; n < 27; ++n)
            if (n != 13) out.push_back(Eigen::Vector3d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1).normalized());
        return out;
    }();
    while (angle > least) {
        bool better = false;
        for (const Eigen::Vector3d& axis : about) {
            const Turn trial = points.turned(Eigen::AngleAxisd(angle, axis).toRotationMatrix() * turn.axes);
            if (trial.volume >= turn.volume) continue;
            turn = trial;
            better = true;
        }
        if (!better) angle *= 0.5;
    }
}

}  // namespace

Eigen::Vector3d least_box(std::span<const Eigen::Vector3d> corners)
{
    if (corners.empty()) throw Error("oriented box", "there are no points");
    Points points(corners);
    std::vector<Turn> turns = starts(points);
    // Ever fewer are followed ever further: many valleys of nearly the same volume are usual, and the least start is often not in the least one.
    for (const auto& [kept, from, to] : {Stage{24, 0.04, 1e-2}, Stage{6, 1e-2, 1e-4}, Stage{1, 1e-4, 1e-9}}) {
        std::stable_sort(turns.begin(), turns.end(), [](const Turn& a, const Turn& b) { return a.volume < b.volume; });
        turns.resize(std::min(kept, turns.size()));
        for (Turn& turn : turns) refine(points, turn, from, to);
    }
    const Turn& best = turns.front();
    Eigen::Vector3d edges = points.edges(best.axes);
    std::sort(edges.data(), edges.data() + 3, std::greater<>());
    return edges;
}

}  // namespace coral::morph
