#include "pack/detail/keeper.h"

#include <algorithm>

#include "core/error.h"

namespace coral::pack::detail {
namespace {

constexpr double writing_share = 0.05;  ///< of the wall time may go into checkpoints

double seconds_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

Keeper::Keeper(const PackControl& control, const Spec& spec, std::uint64_t seed) : control_(control)
{
    if (control.checkpoint.empty()) return;
    origin_ = origin_of(spec, seed);
    if (!std::filesystem::exists(control.checkpoint)) {
        if (control.resume) control.message("there is no checkpoint yet: starting from the beginning");
        return;
    }
    if (!control.resume) {
        control.message("starting anew: " + control.checkpoint.string() + " will be replaced (--resume goes on instead)");
        return;
    }
    PackCheckpoint stored = read_checkpoint(control.checkpoint, origin_);
    state = std::move(stored.state);
    world_ = std::move(stored.world);
    if (world_.empty()) damaged();
}

void Keeper::restore(dem::World& world)
{
    try {
        world.restore(world_);
    } catch (const Error& error) {
        throw Error(control_.checkpoint.string(), std::string("cannot be used: ") + error.what(), "pack without --resume to start anew");
    }
    world_ = {};
}

void Keeper::visit(const dem::World& world)
{
    const bool stop = control_.interrupted();
    if (!control_.checkpoint.empty() && (stop || seconds_since(last_) > std::max(control_.checkpoint_every, cost_ / writing_share))) write(world);
    if (stop) throw Stopped{};
}

void Keeper::visit() const
{
    if (control_.interrupted()) throw Stopped{};
}

void Keeper::write(const dem::World& world)
{
    const auto begin = std::chrono::steady_clock::now();
    write_checkpoint(control_.checkpoint, {origin_, state, world.save()});
    last_ = std::chrono::steady_clock::now();
    cost_ = seconds_since(begin);
}

void Keeper::damaged() const { throw Error(control_.checkpoint.string(), "is damaged", "pack without --resume to start anew"); }

}  // namespace coral::pack::detail
