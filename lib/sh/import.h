#pragma once
/// \file sh/import.h
/// Shapes that others publish, as surfaces of ours: a user can start without a CT scan.
///   TSQUARE (NIST; Garboczi, Cem. Concr. Res. 32, 2002): text lines `n m Re(a_nm) Im(a_nm)`, r(u) = sum a_nm Y_n^m(u), Y complex,
///     orthonormal, with Condon-Shortley phase. The files name no unit. A table of the same project holds the figures that its
///     code computed at the degree `Nnn`, which it lowers where the series rings.
///   Sand Atlas (CC BY): CSV tables with the volume and the three axes of each grain, the unit in the header; junk rows occur.
///     They hold no coefficients: a grain becomes the ellipsoid of its axes.
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "sh/shape_file.h"
#include "sh/surface.h"

namespace coral::sh {

/// What the publisher says of a shape; NaN where it says nothing.
struct PublishedFigures {
    double volume = std::numeric_limits<double>::quiet_NaN();  ///< [m^3]
    double area = std::numeric_limits<double>::quiet_NaN();    ///< [m^2]
    Eigen::Vector3d lower = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< corners of the bounding box [m]
    Eigen::Vector3d upper = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    int degree = 0;        ///< of the series the figures belong to; 0 when it is not said
    int named_degree = 0;  ///< `Nnn` of the table: a few rows name two more than their figures belong to
};

struct PublishedShape {
    std::string name;    ///< file, or file and row
    Surface surface;     ///< at the full degree of the file [m]; method "tsquare" or "ellipsoid"
    PublishedFigures figures;
};

enum class PublishedFormat { tsquare_coefficients, tsquare_table, sand_atlas_table };

/// Tells the formats by their content.
/// \throws Error when the file is missing or none of them; names csct2ls when it holds voxels
PublishedFormat published_format(const std::filesystem::path& file);

/// c_l0 = Re a_l0, c_lm = (-1)^m sqrt(2) Re a_lm, c_l,-m = -(-1)^m sqrt(2) Im a_lm.
/// \param unit  length of one unit of the file [m]
/// \throws Error naming file and line: not four numbers, order outside -n..n, given twice, no real surface (a_n,-m is not
///         (-1)^m conj(a_nm)), a harmonic missing below the highest degree, a degree above 200, a_00 not positive
Surface read_tsquare(const std::filesystem::path& file, double unit);

/// Figures by name of the coefficient file.
/// \param unit  length of one unit of the file [m]; the unit of its header is that of `tsquare_table_unit`
/// \throws Error naming file and line
std::map<std::string, PublishedFigures> read_tsquare_table(const std::filesystem::path& file, double unit);
/// Unit that the table's header names, as in `length(mm)` [m]; 0 when it names none.
double tsquare_table_unit(const std::filesystem::path& file);

/// Rows of a Sand Atlas table.
struct AxesTable {
    std::vector<PublishedShape> shapes;  ///< in the order of the file
    std::size_t left_out = 0;            ///< rows without size: an axis or the volume is zero, missing or not finite
    std::size_t too_slender = 0;         ///< ellipsoids whose radius is not positive everywhere at this degree
};

/// Ellipsoids with the three axes along x, y, z (major to minor), analysed to a degree and scaled to the volume of the ellipsoid.
/// \throws Error naming file and line: a column is missing, a cell is no number, no usable row
AxesTable read_sand_atlas(const std::filesystem::path& file, int degree);

/// How published shapes become ours.
struct ImportOptions {
    double unit = 0;      ///< length of one unit of files that do not name it [m]; 0 when it is not known
    double scale_to = 0;  ///< equivalent diameter every shape is scaled to [m]; 0 keeps sizes
    int degree = 0;       ///< highest degree kept; 0 takes the one of the published figures, else that of the file (ellipsoids: 10)
};

struct ImportedShape {
    ShapeRecord record;        ///< centroid at the origin; errors NaN where there is nothing to compare with
    std::string name;          ///< of the published shape
    double area = 0;           ///< of the surface [m^2]
    PublishedFigures figures;  ///< scaled as the shape is; NaN where nothing is published
};

struct ImportedSet {
    std::vector<ImportedShape> shapes;  ///< ids from 1 in the order of the files; a folder stands for its .dat files by name
    std::size_t left_out = 0;           ///< rows without size
    std::size_t too_slender = 0;        ///< ellipsoids that the degree cannot hold
    std::vector<std::string> without_unit;  ///< sets of a folder that no table names: their unit is not known, they are left out
};

/// Reads coefficient sets and axes tables, in any order, and compares with the figures of the TSQUARE tables among the files.
/// volume_error and area_error of a record are against the published figures.
/// 	hrows UsageError when a coefficient set names no unit and the options neither, or a table's unit is not that of the options
/// 	hrows Error      naming file and line; a radius that is not positive everywhere; no shape among the files
ImportedSet import_shapes(const std::vector<std::filesystem::path>& files, const ImportOptions& options);

/// Semi-axes along x, y, z [m], as the harmonics of 1/sqrt((x/a)^2 + (y/b)^2 + (z/c)^2), scaled to volume 4/3 pi abc.
/// `method` is "ellipsoid", `scale` the volume factor the truncation needed.
Surface ellipsoid_surface(const Eigen::Vector3d& semi_axes, int degree);

}  // namespace coral::sh
