#pragma once
/// \file report/scene.h
/// Grains and fines over time, packed for the viewer of the page.
#include <cstddef>
#include <string>

#include "report/case_data.h"

namespace coral::report {

/// How much a scene may hold before packing; the page stays under 10 MB with the defaults.
struct SceneLimits {
    std::size_t frames = 60;            ///< times shown, the first and the last always
    std::size_t position_words = 1200000;  ///< 16-bit numbers for the positions of all frames
    std::size_t mesh_words = 2000000;      ///< 16-bit numbers for all meshes
};

/// JSON object for the viewer (web/viewer.js reads it), or empty when the case has no tracked positions or no sizes of bodies.
/// Bodies whose shape has a distance lattice are meshes of it (surface_mesh.h), polyhedra are their faces, every other body is a sphere of its
/// equivalent diameter.
/// Numbers are 16 bit, coded as differences, split into byte planes, deflated and written in base64.
/// \param note  set to a sentence that says what is shown and how coarse, or why nothing is
std::string scene_json(const CaseData& data, const SceneLimits& limits, std::string& note);

}  // namespace coral::report
