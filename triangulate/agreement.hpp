// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "triangulate/point.hpp"

namespace drape::triangulate {

struct AgreementLimits {
  double max_sigmas = 0, min_angle_rad = 0;  ///< see TriangulateOptions
  /// Three or more views that miss each other by less than this (rms) see the same dot, whatever
  /// the sigmas say; the point's covariance is then widened to what the views show. A sharp crease
  /// of 15 degrees anywhere under a dot of 8 px radius moves its image by up to 0.27 px from view
  /// to view, one of 60 degrees by up to 0.76 px; a view that takes another dot, a pitch away,
  /// misses by 5.5 px or more (three cameras tilted by 40 degrees, see agreement_test.cpp). The
  /// limit is the gentle crease: letting all through would also let through what no crease
  /// explains.
  double shape_px = 0.3;
};

/// A point from the views that agree, or why there is none.
struct Agreed {
  std::optional<Point> point;
  std::vector<std::size_t> used;       ///< indices of the views that made it
  std::optional<std::size_t> dropped;  ///< view left out because the others agree without it
  double disagreement_sigmas = 0;      ///< with all views
  std::string gap_reason;              ///< reason where there is no point
};

/// Solves the point from all views; when they disagree and there are three or more, leaves out the
/// one view without which the others agree best.
[[nodiscard]] Agreed solve_with_agreement(const std::vector<View>& views,
                                          const AgreementLimits& limits);

}  // namespace drape::triangulate
