// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "core/camera_model.hpp"
#include "core/marks.hpp"

namespace drape::test {

/// Exact values of bench1's renderer (tests/data/bench1/truth.json). Metres and pixels.
struct TrueView {
  Eigen::Vector2d px;           ///< projection of the dot's centre
  Eigen::Vector2d centroid_px;  ///< centroid of the projected disc
  double cos_view = 0;          ///< cosine between normal and direction to the camera
  bool visible = false;
  double visible_fraction = 0;
};

struct TrueDot {
  MarkId mark;
  Eigen::Vector3d point_in_world;
  Eigen::Vector3d normal_in_world;
  std::vector<TrueView> views;  ///< by camera: cam0, cam1, cam2

  /// Number of cameras that see the whole dot and face it within `degrees`.
  [[nodiscard]] int facing_views(double degrees) const;
};

struct TruePose {
  std::string set;
  WorldFromTarget world_from_target;
  std::vector<std::vector<Eigen::Vector2d>> px;           ///< [camera][row * 12 + col]
  std::vector<std::vector<Eigen::Vector2d>> centroid_px;  ///< the same
};

struct Bench1Truth {
  std::vector<Camera> cameras;                         ///< Brown lens
  std::vector<TruePose> poses;                         ///< stages and free poses
  std::map<std::string, std::vector<TrueDot>> drapes;  ///< "A", "C", "E"; index row * 11 + col
};

[[nodiscard]] const Bench1Truth& bench1_truth();

}  // namespace drape::test
