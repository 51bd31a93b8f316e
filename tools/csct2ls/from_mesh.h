#pragma once
/// \file csct2ls/from_mesh.h
/// Grains whose surfaces are given as meshes (--from-mesh).
#include <vector>

#include "csct2ls/options.h"
#include "csct2ls/report.h"
#include "morph/extraction.h"
#include "sdf/mesh.h"

namespace coral::csct2ls {

/// Measured grains with the surfaces they came from.
struct MeshGrains {
    morph::Extraction extraction;              ///< label: place of the file on the command line, from 1
    std::vector<sdf::TriangleMesh> surfaces;   ///< of extraction.grains, scaled as they are [m]
    double edge = 0;                           ///< median edge of the voxels they were measured in, scaled [m]
};

/// Reads and measures one grain per file. Volume and surface area are the mesh's own; apparent shape, voids and the other descriptors
/// come from voxels half the spacing (1/150 of the diameter by default) wide.
/// \throws Error a mesh that is damaged, open, or too thin to measure (names the file)
MeshGrains grains_of_meshes(const Options& o, Source& source, Stages& stages);

}  // namespace coral::csct2ls
