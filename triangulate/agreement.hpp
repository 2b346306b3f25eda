// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "triangulate/point.hpp"

namespace drape::triangulate {

struct AgreementLimits {
  double max_sigmas = 0, min_angle_rad = 0;  ///< see TriangulateOptions
  /// Limit (rms) below which three or more views are taken to see the same dot, whatever their
  /// sigmas; the covariance of the point is then widened to the scatter of the views. A sharp
  /// crease of 15 degrees anywhere under a dot of 8 px radius shifts its image by up to 0.27 px
  /// between views, one of 60 degrees by up to 0.76 px; a view of another dot, a pitch away, is
  /// off by 5.5 px or more (three cameras tilted by 40 degrees, see agreement_test.cpp). The
  /// limit is that of the gentle crease: accepting sharp ones would also accept what no crease
  /// explains.
  double shape_px = 0.3;
};

/// A point from the views that agree, or the reason why there is none.
struct Agreed {
  std::optional<Point> point;
  std::vector<std::size_t> used;       ///< indices of the views used
  std::optional<std::size_t> dropped;  ///< view that was left out because the others agree
  double disagreement_sigmas = 0;      ///< all views together
  std::string gap_reason;              ///< why there is no point
};

/// Solves the point from all views. If they disagree and there are at least three, leaves out the
/// view whose removal gives the best agreement.
[[nodiscard]] Agreed solve_with_agreement(const std::vector<View>& views,
                                          const AgreementLimits& limits);

}  // namespace drape::triangulate
