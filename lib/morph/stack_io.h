#pragma once
/// \file morph/stack_io.h
/// Reading of CT stacks and label images; writing of TIFF stacks.
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "morph/voxel_stack.h"

namespace coral::morph {

/// What a headerless .raw file holds.
struct RawLayout {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();  ///< voxels along x, y, z
    std::string type = "u8";                         ///< u8, u16, u32, i16, i32 or f32, little endian
};

/// Reads a stack: multi-page TIFF/BigTIFF, NRRD (raw, gzip), MetaImage (.mhd/.mha, raw or zlib), .raw with a layout, an
/// HDF5 dataset ("file.h5:/dataset"), a folder of slices, or several slice files. Slices are taken in natural order.
/// The voxel size comes from ImageJ's TIFF fields, NRRD spacings with `space units`, MetaImage ElementSpacing with
/// DistanceUnits, or the HDF5 attribute voxel_size [m]; otherwise it stays zero: it is never guessed.
/// \throws UsageError  a path does not exist, or a .raw file without layout
/// \throws Error       unreadable, truncated or unsupported file (names file and page), missing slice, slices of different size
VoxelStack read_stack(std::span<const std::string> paths, const std::optional<RawLayout>& layout = {});

/// What a stack is, from its headers alone.
struct StackHeader {
    Eigen::Vector3i size = Eigen::Vector3i::Zero();        ///< voxels along x, y, z
    Eigen::Vector3d voxel_size = Eigen::Vector3d::Zero();  ///< edges of a voxel [m]; zero when the file does not say
    std::string type;                                      ///< of its numbers: u1, u8, i8, u16, i16, u32, i32, f32 or f64
    std::string name;
};

/// Like read_stack, but no voxel is read: takes no memory and hardly time, however large the stack. What only the voxels show
/// (damage within them, numbers out of range) goes unnoticed.
StackHeader read_stack_header(std::span<const std::string> paths, const std::optional<RawLayout>& layout = {});

/// Writes integer voxels as a deflate-compressed multi-page TIFF with ImageJ's calibration [um].
/// \param bits  8, 16 or 32
/// \throws Error when a value does not fit or the file cannot be written
void write_tiff(const VoxelStack& stack, const std::filesystem::path& file, int bits);

/// Names in natural order: runs of digits compare as numbers ("slice2" before "slice10").
bool natural_less(const std::string& a, const std::string& b);

}  // namespace coral::morph
