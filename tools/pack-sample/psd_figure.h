#pragma once
// Picture of the gradation of a sample.
#include <filesystem>

#include "pack/sample.h"

namespace coral::tool {

/// Throws unless `file` ends in .png or .svg and its folder exists; to be asked before the hours of packing.
void check_psd_figure(const std::filesystem::path& file);

/// Draws passing by mass [%] over diameter [mm], of the whole sample and of its coarse and fine grains by themselves, with gnuplot.
/// The file appears whole or not at all.
/// \throws Error when gnuplot is missing or fails
void draw_psd(const pack::Sample& sample, const std::filesystem::path& file);

}  // namespace coral::tool
