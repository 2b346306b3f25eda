// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// A sharp corner of a solid, in the world.
struct SolidCorner {
  Eigen::Vector3d point;
  Eigen::Vector3d out;                 ///< unit, away from the solid
  std::vector<Eigen::Vector3d> along;  ///< unit, along the edges that leave it
};

/// A sharp convex edge of a solid, in the world.
struct SolidEdge {
  Eigen::Vector3d a, b;
  Eigen::Vector3d out;      ///< unit, mean of its faces' normals
  Eigen::Vector3d face[2];  ///< unit, from the edge into each face
};

struct SolidFeatures {
  std::vector<SolidCorner> corners;
  std::vector<SolidEdge> edges;
};

/// True if a shape is met at its corners and edges: meshes, and boxes whose edges are not rounded.
[[nodiscard]] bool is_sharp(const Surroundings& surroundings, int shape);

/// Convex edges and the corners at their ends of all sharp shapes. Edges between faces that lie
/// in one plane, and hollow ones, are left out: what touches there touches a face.
[[nodiscard]] SolidFeatures features_of(const Surroundings& surroundings);

}  // namespace drape::simulate
