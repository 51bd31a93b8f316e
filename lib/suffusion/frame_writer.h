#pragma once
/// \file suffusion/frame_writer.h
/// The frames of a run: frames/fluid_<n>.vti, frames/bodies_<n>.vtu (points), frames/surfaces_<n>.vtu (bodies that are no spheres),
/// frames/slice_<n>.vti and .png (one slice of the flow), and fluid.pvd, bodies.pvd, surfaces.pvd, slice.pvd with their times.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "suffusion/flow_region.h"
#include "suffusion/shapes.h"
#include "suffusion/simulation.h"

namespace coral::suffusion {

class FrameWriter {
public:
    explicit FrameWriter(const Simulation& simulation);
    void set_folder(std::filesystem::path folder) { folder_ = std::move(folder); }
    /// Removes the frames of an earlier run.
    void clear() const;
    /// \throws Error when a file cannot be written
    void write(const Simulation& simulation);
    std::size_t count() const { return times_.size(); }
    /// Goes on after `count` frames.
    void resume(std::size_t count);

private:
    void write_bodies(const Simulation& simulation, const std::string& name) const;
    void write_surfaces(const Simulation& simulation, const std::string& name) const;
    void write_fluid(const Simulation& simulation, const std::string& name) const;

    std::filesystem::path folder_;
    double interval_, duration_;
    std::vector<Surface> surfaces_;  ///< by shape of the world
    bool any_surface_ = false;
    int slice_row_ = 0;  ///< the same in all frames
    std::optional<RegionFinder> regions_;  ///< with flow
    std::vector<double> times_;
};

}  // namespace coral::suffusion
