// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::detect {

/// Where the points of a tagged target lie in a picture, from the tags near each of them.
class BoardMap {
 public:
  /// `tags` are the target's, each id once.
  BoardMap(const Target& target, const std::vector<TagDetection>& tags);

  /// Projective map from the target's plane (metres) to pixels as the four nearest tags have it.
  /// Nothing where no tag lies within 1.6 pitches.
  [[nodiscard]] std::optional<Eigen::Matrix3d> around(const Eigen::Vector2d& point_m) const;

 private:
  struct SeenTag {
    Eigen::Vector2d centre_m;
    Eigen::Matrix<double, 2, 4> corners_m, corners_px;
  };
  double pitch_m_;
  std::vector<SeenTag> tags_;
};

}  // namespace drape::detect
