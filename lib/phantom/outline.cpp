#include "phantom/outline.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "sh/basis.h"
#include "sh/quadrature.h"

namespace coral::phantom {

namespace {
constexpr int table_rows = 256, table_columns = 512;
constexpr double smallest_relative_radius = 0.35;
using std::numbers::pi;

double sphericity_of(double volume, double area)
{
    return std::cbrt(36 * pi * volume * volume) / area;
}

/// Volume and area of R = 1 + height * bumps, stretched along z, from the bumps and their gradients at quadrature
/// nodes.
struct Bumps {
    sh::SphereQuadrature nodes;
    std::vector<double> values;
    std::vector<Eigen::Vector3d> gradients;
    double stretch;

    /// {volume, area, smallest radius}
    Eigen::Vector3d measure(double height) const
    {
        double volume = 0, area = 0, smallest = 1e300;
        const Eigen::Vector3d cofactor(stretch, stretch,
                                       1);  // det(S) S^-1: how S = diag(1, 1, stretch) maps area vectors
        for (std::size_t i = 0; i < values.size(); ++i) {
            const double r = 1 + height * values[i];
            const Eigen::Vector3d area_vector = r * (r * nodes.directions[i] - height * gradients[i]);
            volume += nodes.weights[i] * stretch * r * r * r / 3;
            area += nodes.weights[i] * cofactor.cwiseProduct(area_vector).norm();
            smallest = std::min(smallest, r);
        }
        return {volume, area, smallest};
    }
};

Bumps draw_bumps(const OutlineSpec& spec, RandomSource& random, std::vector<double>& coefficients)
{
    const sh::Basis basis(spec.degree);
    coefficients.assign(sh::coefficient_count(spec.degree), 0.0);
    for (int l = 2; l <= spec.degree; ++l) {  // l = 1 would only move the grain
        for (int m = -l; m <= l; ++m)
            coefficients[sh::coefficient_index(l, m)] = std::pow(l, -spec.decay) * random.normal();
    }
    // R^3 has degree 3 L, for which 5 (L + 1) polar nodes are more than exact; the area integrand is smooth.
    Bumps bumps{sh::sphere_quadrature(5 * (spec.degree + 1), 10 * (spec.degree + 1)), {}, {}, spec.stretch};
    for (const auto& u : bumps.nodes.directions) {
        Eigen::Vector3d gradient;
        bumps.values.push_back(basis.sum(coefficients, u, gradient));
        bumps.gradients.push_back(gradient);
    }
    return bumps;
}

/// Height of the bumps at which the sphericity is met, or negative when the surface would come too near the origin.
double find_height(const Bumps& bumps, double sphericity)
{
    double low = 0, high = 0.05;
    const auto value = [&](double height) {
        const Eigen::Vector3d m = bumps.measure(height);
        return m[2] < smallest_relative_radius ? -1.0 : sphericity_of(m[0], m[1]);
    };
    if (std::abs(value(0) - sphericity) < 1e-9) return 0;
    if (value(0) < sphericity) return -1;
    while (value(high) > sphericity) high *= 1.5;
    if (value(high) < 0) {  // back to the largest admissible height
        for (int i = 0; i < 40; ++i) (value((low + high) / 2) < 0 ? high : low) = (low + high) / 2;
        if (value(low) > sphericity) return -1;
        high = low;
        low = 0;
    }
    for (int i = 0; i < 50 && high - low > 1e-9 * high; ++i) {
        (value((low + high) / 2) > sphericity ? low : high) = (low + high) / 2;
    }
    return (low + high) / 2;
}
}  // namespace

Outline::Outline(const OutlineSpec& spec, RandomSource& random) : degree_(spec.degree), stretch_(spec.stretch)
{
    constexpr int draws = 50;
    for (int draw = 0; draw < draws; ++draw) {
        const Bumps bumps = draw_bumps(spec, random, coefficients_);
        const double height = find_height(bumps, spec.sphericity);
        if (height < 0) continue;
        const Eigen::Vector3d unscaled = bumps.measure(height);
        const double target = pi / 6 * std::pow(spec.equivalent_diameter, 3);
        const double scale = std::cbrt(target / unscaled[0]);
        for (double& c : coefficients_) c *= height * scale;
        coefficients_[0] = std::sqrt(4 * pi) * scale;  // Y_00 = 1/sqrt(4 pi)
        volume_ = target;
        area_ = unscaled[1] * scale * scale;
        tabulate();
        return;
    }
    throw Error("--sphericity",
                fmt::format("no outline of degree {} and stretch {} with sphericity {:.3f} in {} draws", spec.degree,
                            spec.stretch, spec.sphericity, draws),
                "choose 0.80 to 0.95 for lumps, 0.70 to 0.85 for sticks");
}

double Outline::sphericity() const
{
    return sphericity_of(volume_, area_);
}

double Outline::equivalent_diameter() const
{
    return std::cbrt(6 * volume_ / pi);
}

void Outline::tabulate()
{
    const sh::Basis basis(degree_);
    table_.resize(static_cast<std::size_t>(table_rows + 1) * (table_columns + 1));
    std::vector<double> distance(table_.size());
    parallel_blocks(table_rows + 1, 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const double theta = static_cast<double>(i) * pi / table_rows;
            for (int j = 0; j <= table_columns; ++j) {
                const double phi = 2 * pi * j / table_columns;
                const Eigen::Vector3d u(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                        std::cos(theta));
                Eigen::Vector3d gradient;
                const double r = basis.sum(coefficients_, u, gradient);
                const Eigen::Vector3d point = r * Eigen::Vector3d(u.x(), u.y(), stretch_ * u.z());
                Eigen::Vector3d normal = r * u - gradient;
                normal.z() /= stretch_;
                const double cosine = point.normalized().dot(normal.normalized());
                table_[i * (table_columns + 1) + j] = Eigen::Vector2f(r, cosine);
                distance[i * (table_columns + 1) + j] = point.norm();
            }
        }
    });
    const auto [smallest, largest] = std::minmax_element(distance.begin(), distance.end());
    inner_radius_ = 0.999 * *smallest;  // between the nodes the surface may come a little nearer
    outer_radius_ = 1.001 * *largest;
}

double Outline::depth(const Eigen::Vector3d& point) const
{
    const double from_origin = point.norm();
    if (from_origin > outer_radius_) return outer_radius_ - from_origin - 1e-12 * outer_radius_;
    const Eigen::Vector3d q(point.x(), point.y(), point.z() / stretch_);
    const double radius = q.norm();
    if (radius < 1e-9 * inner_radius_) return inner_radius_;

    double phi = std::atan2(q.y(), q.x());
    if (phi < 0) phi += 2 * pi;
    const double row = std::acos(std::clamp(q.z() / radius, -1.0, 1.0)) * (table_rows / pi),
                 column = phi * (table_columns / (2 * pi));
    const int i = std::min(static_cast<int>(row), table_rows - 1),
              j = std::min(static_cast<int>(column), table_columns - 1);
    const float a = static_cast<float>(row - i), b = static_cast<float>(column - j);
    const Eigen::Vector2f* at = table_.data() + static_cast<std::size_t>(i) * (table_columns + 1) + j;
    const Eigen::Vector2f value =
        (1 - a) * ((1 - b) * at[0] + b * at[1]) + a * ((1 - b) * at[table_columns + 1] + b * at[table_columns + 2]);
    return from_origin * (value[0] / radius - 1) * value[1];
}

std::vector<Eigen::Vector3d> Outline::surface_points() const
{
    constexpr int stride = 8;
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i <= table_rows; i += stride) {
        for (int j = 0; j < table_columns; j += stride) {
            const double theta = i * pi / table_rows, phi = 2 * pi * j / table_columns;
            const Eigen::Vector3d u(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                    stretch_ * std::cos(theta));
            points.push_back(table_[static_cast<std::size_t>(i) * (table_columns + 1) + j][0] * u);
        }
    }
    return points;
}

}  // namespace coral::phantom
