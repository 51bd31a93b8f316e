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

/// \tparam T  float while the search is coarse: twice the speed
template <class T>
class Points {
public:
    explicit Points(std::span<const Eigen::Vector3d> points) : xyz_(Eigen::Index(points.size()), 3), along_(Eigen::Index(points.size()))
    {
        for (std::size_t p = 0; p < points.size(); ++p) xyz_.row(Eigen::Index(p)) = (points[p] - points.front()).cast<T>().transpose();
    }
    Eigen::Vector3d edges(const Eigen::Matrix3d& axes)
    {
        Eigen::Vector3d out;
        for (int a = 0; a < 3; ++a) {
            along_ = T(axes(a, 0)) * xyz_.col(0) + T(axes(a, 1)) * xyz_.col(1) + T(axes(a, 2)) * xyz_.col(2);
            out[a] = double(along_.maxCoeff()) - double(along_.minCoeff());
        }
        return out;
    }
    Turn turned(const Eigen::Matrix3d& axes) { return {axes, edges(axes).prod()}; }

private:
    Eigen::Array<T, Eigen::Dynamic, 3> xyz_;
    Eigen::Array<T, Eigen::Dynamic, 1> along_;
};

/// Rotations spread over the part of the rotation group that the symmetries of a box leave: in Rodrigues' parameters a cube of
/// half width tan(pi/8) without its corners [Frank 1988, Metall. Trans. A 19].
std::vector<Turn> starts(Points<float>& points)
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
template <class T>
void refine(Points<T>& points, Turn& turn, double angle, double least)
{
    static const std::vector<Eigen::Vector3d> about = [] {
        std::vector<Eigen::Vector3d> out;
        for (int n = 0; n < 27; ++n)
            if (n != 13) out.push_back(Eigen::Vector3d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1).normalized());
        return out;
    }();
    for (; angle > least; angle *= 0.5) {
        std::vector<Eigen::Matrix3d> turns;
        for (const Eigen::Vector3d& axis : about) turns.push_back(Eigen::AngleAxisd(angle, axis).toRotationMatrix());
        for (bool better = true; better;) {
            better = false;
            for (const Eigen::Matrix3d& by : turns)
                if (const Turn trial = points.turned(by * turn.axes); trial.volume < turn.volume) {
                    turn = trial;
                    better = true;
                }
        }
    }
}

}  // namespace

Eigen::Vector3d least_box(std::span<const Eigen::Vector3d> corners)
{
    if (corners.empty()) throw Error("oriented box", "there are no points");
    Points<float> coarse(corners);
    std::vector<Turn> turns = starts(coarse);
    // Ever fewer are followed ever further: many valleys of nearly the same volume are usual, and the least start is often not in the least one.
    for (const auto& [kept, from, to] : {Stage{24, 0.04, 1e-2}, Stage{6, 1e-2, 1e-4}, Stage{1, 0, 0}}) {
        std::stable_sort(turns.begin(), turns.end(), [](const Turn& a, const Turn& b) { return a.volume < b.volume; });
        turns.resize(std::min(kept, turns.size()));
        for (Turn& turn : turns) refine(coarse, turn, from, to);
    }
    Points<double> points(corners);
    Turn best = points.turned(turns.front().axes);
    refine(points, best, 1e-4, 1e-9);
    Eigen::Vector3d edges = points.edges(best.axes);
    std::sort(edges.data(), edges.data() + 3, std::greater<>());
    return edges;
}

}  // namespace coral::morph
