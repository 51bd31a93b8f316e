#pragma once
/// \file suffusion/scene.h
/// A case made ready to run: bodies and walls in a contact world, the coupling scheme of each body.
#include <memory>
#include <string>
#include <vector>

#include "core/record.h"
#include "dem/world.h"
#include "suffusion/apparent.h"
#include "suffusion/case_file.h"

namespace coral::suffusion {

/// What the coupling needs to know of one body besides its state in the world.
struct BodyInfo {
    Scheme scheme = Scheme::resolved;  ///< never automatic; resolved also when there is no fluid
    bool fine = false;                 ///< role "fine": counted by the erosion series
    bool coarse = false;               ///< role "coarse"
    double diameter = 0;               ///< of the sphere of the apparent volume [m]
    double volume = 0;                 ///< of the solid [m3]
    double mass = 0;                   ///< [kg]
    const ApparentShape* apparent = nullptr;  ///< void region, of grains with intraparticle voids only
};

struct Scene {
    explicit Scene(Case given) : description(std::move(given)) {}

    Case description;
    dem::World world;
    std::vector<BodyInfo> bodies;
    std::vector<std::unique_ptr<ApparentShape>> apparent_shapes;  ///< by shape of the world; null without voids
    Eigen::Vector3d lower = Eigen::Vector3d::Zero(), upper = Eigen::Vector3d::Zero();  ///< box around the grains at the start [m]
    History history;  ///< of the sample and of the files of shapes; the caller adds its own entry
    bool has_plate() const { return description.plate() != nullptr; }
    /// Lengths of the domain between periodic faces, 0 along other axes [m].
    Eigen::Vector3d period() const;
    /// The image of a place that lies in the domain; positions of bodies go on beyond its periodic faces.
    Eigen::Vector3d wrapped(Eigen::Vector3d x) const;
    /// The shortest of all images of a difference of places.
    Eigen::Vector3d nearest_image(Eigen::Vector3d r) const;
    /// Centre of one hole of the plate [m]: half a pitch from the lower corner of the domain.
    Eigen::Vector2d hole_centre() const;
};

/// Scheme of a body by its size in cells: above 8 resolved, down to 1/3 semi-resolved, below unresolved. [paper, section 2.3.4]
Scheme scheme_for(double diameter, double cell);
/// "resolved", "semi-resolved", "unresolved" or "auto".
std::string_view to_string(Scheme scheme);

/// Reads the sample and the shapes, fills the world.
/// \throws Error for damaged files; UsageError when the case names bodies or shapes that are not there
std::unique_ptr<Scene> build_scene(Case description);

}  // namespace coral::suffusion
