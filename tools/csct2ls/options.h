#pragma once
/// \file csct2ls/options.h
/// The command line of csct2ls and what can be wrong with it.
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli.h"
#include "morph/stack_io.h"

namespace coral::csct2ls {

namespace fs = std::filesystem;

struct Options {
    std::vector<std::string> stack;
    fs::path output, table, voids, mesh;
    std::string voxel_size, band = "6,9", labels = "auto", solid = "bright", threshold, split = "none", border = "drop", shape, type = "u8";
    std::string mesh_format = "ply", mesh_unit;
    bool from_mesh = false;
    double spacing = 0, tolerance = 0, throat = 0, minimum_diameter = 0, scale_to = 0;
};

void declare(cli::Options& options, Options& o);

/// Everything the command line can get wrong, found before any work. \throws UsageError, Error (a folder that cannot be written to)
void check(const Options& o);

std::pair<double, double> parse_band(const std::string& text);  ///< inside, outside [nodes]
std::optional<morph::RawLayout> parse_layout(const Options& o);

/// The option wins over the file; without either there is nothing to go by. [m]
Eigen::Vector3d choose_voxel_size(const Options& o, const morph::VoxelStack& stack);

std::string edges_text(const Eigen::Vector3d& edges);  ///< voxel edges for people
std::string short_length(double length);               ///< for people: four digits

}  // namespace coral::csct2ls
