// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"

namespace drape::triangulate {

struct IslandOptions {
  double most_stretch = 0, min_angle_rad = 0;  ///< see TriangulateOptions
  double most_sigmas = 3;     ///< largest residual of an island's dot against other views
  double shape_px = 0.3;      ///< centroid error of a dot on curved cloth, added to each covariance
  double least_chord = 0.35;  ///< least chord over arc; cloth does not fold more sharply than this
  int least_evidence = 4;     ///< least number of independent pixel coordinates that must agree
  int least_links = 2;        ///< least number of lattice neighbours within reach in space
  int least_refutations = 2;  ///< least number of refutations of every other position
};

/// One island of a frame and its outcome.
struct IslandFate {
  std::string camera;
  int island = 0;
  int dots = 0;
  bool merged = false;
  std::string
      reason;  ///< "merged: 6 dots agree with other views, 9 neighbours in reach", or why not so
};

struct MergedIslands {
  Detections detections;  ///< detections of the set, including the new labels of merged islands
  std::vector<IslandFate> fates;
};

/// Labels the islands of a set whose position is unique given the other views; a priori an island
/// can lie anywhere on the lattice in four orientations. A position is refuted by views that do not
/// meet (epipolar distance), by neighbours farther apart in space than the cloth between them
/// (White, Crane, Forsyth 2007) and by marks that the frame already has. It is accepted if enough
/// views and neighbours agree, none contradicts, and every other position with any support is
/// refuted; otherwise the island stays unlabelled. Merged islands provide labels for the next one.
/// Only measured pixels are used, never a simulated shape.
[[nodiscard]] MergedIslands merge_islands(const Detections& detections,
                                          const Calibration& calibration, const std::string& set,
                                          const IslandOptions& options);

}  // namespace drape::triangulate
