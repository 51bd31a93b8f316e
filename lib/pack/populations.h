#pragma once
/// \file pack/populations.h
/// From a specification to grains: shape templates loaded and drawn, diameters drawn, numbers found from counts and mass fractions.
#include <cstdint>
#include <functional>
#include <vector>

#include "pack/sample.h"
#include "pack/spec.h"

namespace coral::pack {

/// The grains of a specification before any of them is placed: particles of the populations in their order, all at the origin.
struct Grains {
    Sample sample;                  ///< shapes, materials, particles and the histories of the shape files
    std::vector<int> population;    ///< by particle
};

/// Draws and loads everything. Ids are drawn evenly: every id once in random order, then again, until the population is full.
/// A mass fraction is met to half a grain of the population. Grid shapes reach out to the largest sphere of the specification, its
/// skin included, at the smallest scale they are used with.
/// \throws UsageError  an id that the file does not have, a grain without volume, more grains than the box can hold; each with its place
///                     in the specification
/// \throws Error       a damaged file
/// \param visit  called now and then while files are read, never from two threads at once; what it throws ends the loading
Grains make_grains(const Spec& spec, std::uint64_t seed, const std::function<void()>& visit = [] {});

/// Template of a level-set grain of a .vdb file, of a harmonic shape, of a polyhedron (`id` counts those of the population) or of a
/// superellipsoid. Lengths as in the file.
/// \param reach  distance outside the surface that contact queries [m]
ShapeTemplate load_shape(const Population& population, std::int64_t id, double reach);

}  // namespace coral::pack
