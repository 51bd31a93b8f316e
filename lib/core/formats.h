#pragma once
/// \file core/formats.h
/// Numbers of the layouts of our files, which each file carries as `format`. A number grows when a reader of before would go wrong.
#include <cstdint>

namespace coral::file_format {

inline constexpr std::int64_t grains = 1;      ///< grains.vdb: names, metadata, units
inline constexpr std::int64_t shapes = 1;      ///< .sh.h5: groups, attributes, units
inline constexpr std::int64_t sample = 2;      ///< sample.h5: groups, attributes, units. Boxes with six walls keep 1, which readers of before take
inline constexpr std::int64_t results = 1;     ///< results.h5: datasets, their dimensions, units
inline constexpr std::int64_t checkpoint = 2;  ///< checkpoint.h5: attributes, and the bytes of /simulation and /observer; 2: fields in either precision
inline constexpr std::int64_t pack_checkpoint = 1;  ///< of pack-sample: attributes, and the bytes of /world

}  // namespace coral::file_format
