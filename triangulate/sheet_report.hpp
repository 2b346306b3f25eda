// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "triangulate/agreement.hpp"
#include "triangulate/lattice_views.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

/// A triangulated mark, before neighbours may reject it.
struct Placed {
  Agreed agreed;
  double shape_shift_m = 0;
  std::vector<View> shaped_views;  ///< corrected for the dot's shape; empty without correction
};

/// Root mean square, over the sheet's marks, of each contribution to their covariances.
[[nodiscard]] ErrorBudget budget_of(const std::vector<MarkViews>& marks,
                                    const std::vector<Placed>& placed, const Sheet& sheet,
                                    bool has_calibration_covariance);

/// Fills in medians and counts over the sheet's marks, and the views that were left out.
void note_statistics(const std::vector<MarkViews>& marks, const std::vector<Placed>& placed,
                     const Sheet& sheet, TriangulateReport& report);

/// Marks known to be less accurate than the rest: a nearby crease or hem leaves the curvature at
/// the dot uncertain, or its views do not quite meet.
[[nodiscard]] std::vector<Doubt> doubts_of(const std::vector<MarkViews>& marks,
                                           const std::vector<Placed>& placed, const Sheet& sheet,
                                           const TriangulateOptions& options);

/// Number of marks lost by each camera, and why: views that could not be used, of marks that became
/// gaps for lack of a second view ("cam1 cost 12 marks: saturated; lower its exposure").
[[nodiscard]] std::vector<std::string> costs_of_views(const std::vector<MarkViews>& marks,
                                                      const Sheet& sheet);

/// Adds one line about the calibration, whose own ending and file contain the rest, and one if it
/// belongs to another rig than the detections' `rig`.
void note_calibration(const Calibration& calibration, const std::string& rig,
                      TriangulateReport& report);

/// Distance between the rays of each pair of cameras over their common marks, in stated standard
/// deviations, including those of the calibration. A camera that moved since its calibration is off
/// in every mark. Pairs with fewer than `least_marks` common marks are left out.
[[nodiscard]] std::vector<PairAgreement> pair_agreements(const std::vector<MarkViews>& marks,
                                                         const std::vector<Placed>& placed,
                                                         double min_angle_rad, int least_marks);

}  // namespace drape::triangulate
