// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "triangulate/agreement.hpp"
#include "triangulate/lattice_views.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

/// A mark that may become one of the sheet.
struct Placed {
  Agreed agreed;
  double shape_shift_m = 0;
  std::vector<View> shaped_views;  ///< corrected for the dot's shape; empty without
};

/// Root mean squares over the sheet's marks of what their covariances are made of.
[[nodiscard]] ErrorBudget budget_of(const std::vector<MarkViews>& marks,
                                    const std::vector<Placed>& placed, const Sheet& sheet,
                                    bool has_calibration_covariance);

/// Medians and counts over the sheet's marks, and the views that were left out.
void note_statistics(const std::vector<MarkViews>& marks, const std::vector<Placed>& placed,
                     const Sheet& sheet, TriangulateReport& report);

/// Marks that are known to be worse than the rest without any truth: a crease or hem beside the dot
/// leaves its bend open, or its views do not quite meet.
[[nodiscard]] std::vector<Doubt> doubts_of(const std::vector<MarkViews>& marks,
                                           const std::vector<Placed>& placed, const Sheet& sheet,
                                           const TriangulateOptions& options);

/// Marks that each camera cost, and why: what it saw and could not use of marks that became
/// gaps for want of a second view ("cam1 cost 12 marks: saturated; lower its exposure").
[[nodiscard]] std::vector<std::string> costs_of_views(const std::vector<MarkViews>& marks,
                                                      const Sheet& sheet);

/// One line, however much there is to say of the calibration: its own ending and file say all; and
/// one where it is of another rig than the detections' `rig`.
void note_calibration(const Calibration& calibration, const std::string& rig,
                      TriangulateReport& report);

/// For each pair of cameras: how far the two miss each other over the marks that both see, in
/// stated standard deviations, the calibration's included. A camera that moved since its
/// calibration misses in every mark. Pairs of fewer than `least_marks` common marks are left out.
[[nodiscard]] std::vector<PairAgreement> pair_agreements(const std::vector<MarkViews>& marks,
                                                         const std::vector<Placed>& placed,
                                                         double min_angle_rad, int least_marks);

}  // namespace drape::triangulate
