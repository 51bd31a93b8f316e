#include "fluid/fine_force.h"

#include <algorithm>
#include <cmath>

namespace coral::fluid {

namespace {

constexpr double kernel_square = 0.55588;  ///< R^3 int w^2 dV of the four-point kernel of support radius R
constexpr double largest_share = 0.8;      ///< of the own velocity in the slip: beyond it the linear response means little

}  // namespace

double self_velocity_factor(double reynolds)
{
    return 0.0891097 / (1.0 + reynolds * (0.258 - 0.03 / (1.0 + reynolds / 8.0)));
}

FineForce fine_force(DragLaw law, const FineParticle& particle, const FeltFlow& felt, double density, double nu)
{
    const Eigen::Vector3d slip = felt.velocity - particle.velocity;
    const double felt_slip = slip.norm(), R = felt.support_radius;
    const double back_flow = felt.isolation * felt.own_solid / (3.0 * felt.void_fraction);
    // undisturbed slip over felt slip; drag and wake depend on it weakly, so it is found by repetition
    double ratio = 1.0 / (1.0 + back_flow), b = 0.0;
    for (int i = 0; i < 20; ++i) {
        b = drag_coefficient(law, felt.void_fraction, ratio * felt_slip, particle.diameter, density, nu, particle.shape);
        if (felt.isolation == 0.0) break;
        const double wake = felt.isolation * b * self_velocity_factor(ratio * felt_slip * R / nu) / (density * nu * R);
        const double next = 1.0 / (1.0 - std::min(wake, largest_share) + back_flow);
        const bool found = std::abs(next - ratio) < 1e-8 * next;
        ratio = next;
        if (found) break;
    }
    FineForce result;
    result.coefficient = b * ratio;
    const Eigen::Vector3d drag = result.coefficient * slip;
    const Eigen::Vector3d own_gradient = -felt.isolation * kernel_square / (3.0 * density * R * R * R) * drag;
    result.force = drag - density * particle.volume * (felt.wide_pressure_gradient - own_gradient - felt.pressure_gradient);
    return result;
}

}  // namespace coral::fluid
