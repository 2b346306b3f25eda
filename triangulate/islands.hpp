// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"

namespace drape::triangulate {

struct IslandOptions {
  double most_stretch = 0, min_angle_rad = 0;  ///< see TriangulateOptions
  double most_sigmas = 3;     ///< by which an island's dot may miss what other views say
  double shape_px = 0.3;      ///< error of a bent dot's centroid, added to each covariance
  double least_chord = 0.35;  ///< part of it; cloth does not fold sharper between two dots
  int least_evidence = 4;     ///< independent pixel coordinates that must agree
  int least_links = 2;        ///< lattice neighbours in space that must be near enough
  int least_refutations = 2;  ///< refutations of every other place
};

/// One island of a frame and what became of it.
struct IslandFate {
  std::string camera;
  int island = 0;
  int dots = 0;
  bool merged = false;
  std::string
      reason;  ///< "merged: 6 dots agree with other views, 9 neighbours in reach", or why not
};

struct MergedIslands {
  Detections detections;  ///< detections of the set; dots of merged islands are labelled now
  std::vector<IslandFate> fates;
};

/// Gives the islands of a set their labels where the other views leave only one: an island may lie
/// anywhere on the lattice, in four turns. A place is refuted by views that miss each other
/// (epipolar distance), by neighbours farther in space than the cloth is long (White, Crane,
/// Forsyth 2007) and by marks that the frame has already. It is taken when enough views and
/// neighbours agree, none contradicts, and every other place that any view supports is refuted;
/// in doubt the island stays one. Merged islands count as labels for the next. Only measured pixels
/// enter: no simulated shape.
[[nodiscard]] MergedIslands merge_islands(const Detections& detections,
                                          const Calibration& calibration, const std::string& set,
                                          const IslandOptions& options);

}  // namespace drape::triangulate
