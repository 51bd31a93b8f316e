#pragma once
/// \file pack/picture.h
/// Picture of a sample, cut open so that the voids of its grains show.
#include <cstdint>
#include <filesystem>
#include <vector>

#include "pack/sample.h"

namespace coral::pack {

struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  ///< rows from the top, three bytes a pixel
};

/// Parallel projection from the front, right and above, on white. What lies in front of the middle plane y = size.y/2 is taken away: cut faces of coarse
/// grains are light, fines are left out when their centre is in front. Coarse grains have the colours of sand, fines go from
/// violet (the smallest) over green to yellow (the largest). A grain across a periodic side shows at both ends. The same bytes for any number of threads.
/// \param pixels  of the longer side, at least 16
Picture draw_sample(const Sample& sample, int pixels);

/// \throws UsageError  when `file` does not end in .png or its folder does not exist; to be asked before the hours of packing
void check_png(const std::filesystem::path& file);

/// The file appears whole or not at all. \throws Error when it cannot be written
void write_png(const Picture& picture, const std::filesystem::path& file);

}  // namespace coral::pack
