#pragma once
/// \file pack/sample_world.h
/// A sample as a discrete element world: shapes, materials, bodies, walls and friction springs.
#include <array>
#include <memory>
#include <vector>

#include "dem/shape.h"
#include "dem/world.h"
#include "pack/sample.h"

namespace coral::pack {

/// The contact shape of a template; it shares the template's lattice.
std::shared_ptr<const dem::Shape> make_shape(const ShapeTemplate& shape);

/// Ids that the parts of a sample got in a world.
struct SampleIds {
    std::vector<int> shapes, materials, bodies;  ///< by index in the sample
    std::vector<int> walls;                      ///< by index in the sample; -1 where left out
};

/// Gravity and periodic lengths of a sample.
dem::WorldOptions world_options(const Sample& sample);

/// Adds a plane or a cylinder; returns its id.
int add_wall(dem::World& world, const Wall& wall, int material);

/// Adds a sample to a world: bodies in the order of the sample, then the walls of `with_walls` (names; all by default), each of a
/// material of its own with the wall's friction.
/// \throws Error  a periodic sample in a world that does not repeat itself after the same lengths, or with a grain of more than half of one
/// Friction springs are a separate step (restore_springs) because bodies of others may be added first.
SampleIds add_sample(dem::World& world, const Sample& sample,
                     const std::vector<std::string>& with_walls = {"x-", "x+", "y-", "y+", "z-", "z+", "side"});

/// Gives the world the friction springs of the sample; those at walls left out are dropped. Call before the first step.
void restore_springs(dem::World& world, const Sample& sample, const SampleIds& ids);

}  // namespace coral::pack
