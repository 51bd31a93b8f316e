#pragma once
/// \file sh/shape_file.h
/// grains.sh.h5: `/shapes/<id>/coefficients` [(L+1)^2] in metres; attributes `degree`, `centre`, `scale`, `method`, volume and
/// errors; file attributes `convention` and `history`.
#include <filesystem>
#include <span>
#include <vector>

#include "core/record.h"
#include "sh/fit.h"

namespace coral::sh {

struct ShapeRecord {
    int id = 0;
    Surface surface;
    double volume = 0.0;               ///< of the body inside the surface [m^3]
    double solid_volume = 0.0;         ///< of the grain with its voids, 0 when unknown [m^3]
    double equivalent_diameter = 0.0;  ///< of the apparent shape [m]
    FitErrors errors;
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
