#pragma once
/// \file fluid/detail/immersed_body.h
/// What ImmersedBodies knows of the faces: those that a body has to itself, and those on which several meet.
#include "fluid/detail/raster.h"

namespace coral::fluid {

namespace detail {

/// Faces of one component that a body has to itself; cut ones as one array for each property, for loops over them that
/// vectorise. Their velocity and torque need the place along the two axes after the component's own, cyclically.
struct OwnFaces {
    std::vector<SolidRun> runs;
    std::vector<std::uint32_t> at;
    std::array<std::vector<std::int16_t>, 2> place;
    std::vector<float> fraction;
    std::vector<float> weight;  ///< w of the last measure()

    void clear()
    {
        runs.clear(), at.clear(), place[0].clear(), place[1].clear(), fraction.clear();
    }
};

}  // namespace detail

struct ImmersedBodies::Body {
    BodyShape shape;
    RigidMotion placed;
    bool still = false;                          ///< moves alike in measure() and apply()
    Eigen::Vector3d given = Eigen::Vector3d::Zero();  ///< to the fluid on own faces in measure(), where it is `still`; sum of eps times the change
    bool found = false;                          ///< faces belong to `placed`
    std::array<detail::SolidSet, 4> solid;       ///< components and cells
    std::array<detail::OwnFaces, 3> own;         ///< without the faces shared with other bodies...
    std::array<std::vector<Claim>, 3> contested; ///< ...which are these
    Eigen::Vector3d run_mass = Eigen::Vector3d::Zero();  ///< of the own runs, in faces; about `placed` like the inertia
    Eigen::Matrix3d run_inertia = Eigen::Matrix3d::Zero();  ///< [m2]
};

struct ImmersedBodies::Claim {
    std::uint32_t at = 0, body = 0;
    std::int16_t i = 0, j = 0, k = 0;  ///< the face as the body sees it: bodies may meet across a periodic side
    float fraction = 0.0F;
    double part = 0.0;  ///< of the sum of fractions
};

struct ImmersedBodies::Shared {
    std::uint32_t at = 0;
    std::uint32_t first = 0, last = 0;  ///< its claims
    double fraction = 0.0, weight = 0.0;
};

struct ImmersedBodies::Change {
    std::size_t body = 0;
    std::array<detail::SolidSet, 4> solid;
};

}  // namespace coral::fluid
