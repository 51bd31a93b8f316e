#pragma once
/// \file suffusion/slices.h
/// One vertical slice of the flow, as numbers (.vti) and as a picture (.png).
#include <filesystem>

#include "pack/picture.h"
#include "suffusion/flow_region.h"
#include "suffusion/simulation.h"

namespace coral::suffusion {

/// Row of cells (y index) that is cut: through the centre of the grain with voids that is nearest to the middle of the domain, else
/// through the middle. \pre simulation.has_flow()
int slice_row(const Simulation& simulation);

/// Cells of the row, one cell thick: velocity [m/s], pressure [Pa], solid_fraction [-], region (the number of
/// Region in flow_region.h). \throws Error when the file cannot be written
void write_slice(const std::filesystem::path& file, const Simulation& simulation, const RegionFinder& regions, int row);

/// Speed that the lightest colour stands for [m/s]: five times that of the inlet; without an inlet the highest in the row.
double slice_speed_scale(const Simulation& simulation, int row);

/// Picture of the row, x to the right and z upwards: speed from dark violet (0) over green to yellow (slice_speed_scale), solid grains grey,
/// fines that the plane cuts orange. \param pixels  of the longer side, at least 16
pack::Picture draw_slice(const Simulation& simulation, int row, int pixels);

}  // namespace coral::suffusion
