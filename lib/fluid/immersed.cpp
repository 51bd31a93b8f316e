// The bodies themselves: which faces and cells they hold.
#include "fluid/immersed.h"

#include "core/error.h"
#include "core/parallel.h"
#include "fluid/detail/immersed_body.h"

namespace coral::fluid {

using detail::SolidRun;
using Eigen::Vector3d;

ImmersedBodies::ImmersedBodies(const GridSpec& grid, const ForcingOptions& options)
    : grid_(grid), layout_(grid.cells), options_(options)
{
    for (Field& f : solid_sum_) f = layout_.make_field();
    cell_solid_ = layout_.make_field();
}
ImmersedBodies::ImmersedBodies(ImmersedBodies&&) noexcept = default;
ImmersedBodies& ImmersedBodies::operator=(ImmersedBodies&&) noexcept = default;
ImmersedBodies::~ImmersedBodies() = default;

std::size_t ImmersedBodies::add(BodyShape shape, const RigidMotion& motion, bool still)
{
    auto body = std::make_unique<Body>();
    body->shape = std::move(shape);
    body->placed = motion;
    body->still = still;
    bodies_.push_back(std::move(body));
    actions_.emplace_back();
    driven_steps_.push_back(0);
    return bodies_.size() - 1;
}

ImmersedBodies::Change ImmersedBodies::rasterise(std::size_t body) const
{
    const Body& from = *bodies_[body];
    Change change;
    change.body = body;
    for (int component = 0; component < 4; ++component)
        change.solid[std::size_t(component)] =
            detail::find_solid(grid_, layout_, component, from.shape, from.placed, options_.fraction);
    return change;
}

void ImmersedBodies::place(std::span<const RigidMotion> motions)
{
    const double tolerance = options_.reshape_distance * grid_.cell;
    std::vector<std::size_t> moved;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        Body& body = *bodies_[b];
        const double reach = body.shape.box_min.cwiseAbs().cwiseMax(body.shape.box_max.cwiseAbs()).norm();
        const double travel = (motions[b].position - body.placed.position).norm() +
                              reach * motions[b].orientation.angularDistance(body.placed.orientation);
        if (body.found && !(travel > tolerance)) continue;
        body.placed = motions[b];
        body.found = true;
        moved.push_back(b);
    }
    if (moved.empty()) return;
    std::vector<Change> changes(moved.size());
    parallel_blocks(moved.size(), 1, [&](std::size_t m, std::size_t) { changes[m] = rasterise(moved[m]); });
    merge(changes);
}

std::vector<RigidMotion> ImmersedBodies::placed_motions() const
{
    std::vector<RigidMotion> motions;
    for (const auto& body : bodies_) motions.push_back(body->placed);
    return motions;
}

void ImmersedBodies::restore(std::span<const RigidMotion> placed_motions)
{
    if (placed_motions.size() != bodies_.size())
        throw Error("immersed bodies", "the checkpoint holds another number of bodies",
                    "resume with the case that wrote it");
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        bodies_[b]->placed = placed_motions[b];
        bodies_[b]->found = false;
    }
    place(placed_motions);
}

double ImmersedBodies::seen_volume(std::size_t body) const
{
    const detail::SolidSet& cells = bodies_[body]->solid[detail::cells_component];
    double volume = 0.0;
    for (const SolidRun& run : cells.runs) volume += run.length;
    for (const detail::CutFace& cut : cells.cuts) volume += double(cut.fraction);
    return volume * grid_.cell_volume();
}

}  // namespace coral::fluid
