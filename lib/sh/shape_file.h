#pragma once
/// \file sh/shape_file.h
/// grains.sh.h5: `/shapes/<id>/coefficients` [(L+1)^2] in metres; attributes `degree`, `centre`, `scale`, `method` ("radial" fit;
/// "outer-envelope" of a grain that is not star-shaped; "tsquare", "ellipsoid" of published shapes, with `name`), volume and errors; file attributes `convention` and `history`.
#include <filesystem>
#include <span>
#include <vector>

#include "core/record.h"
#include "sh/fit.h"

namespace coral::sh {

struct ShapeRecord {
    int id = 0;
    std::string name;                  ///< of a published shape; empty for grains of a level set, which have their id
    Surface surface;
    double volume = 0.0;               ///< of the body inside the surface [m^3]
    double solid_volume = 0.0;         ///< of the grain with its voids, 0 when unknown [m^3]
    double equivalent_diameter = 0.0;  ///< of the apparent shape [m]
    FitErrors errors;                  ///< against the level set; of published shapes against the published figures, NaN where there are none
};

struct ShapeFile {
    std::vector<ShapeRecord> shapes;  ///< by rising id
    History history;
};

/// Same shapes, same bytes. \throws Error when the file cannot be written
void write_shapes(const std::filesystem::path& file, std::span<const ShapeRecord> shapes, const History& history);
/// \throws Error when missing, not HDF5, without /shapes, or a coefficient count that does not fit its degree
ShapeFile read_shapes(const std::filesystem::path& file);

}  // namespace coral::sh
