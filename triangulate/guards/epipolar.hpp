// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "triangulate/sheet_report.hpp"

namespace drape::triangulate {

/// For each pair of cameras: how far the two miss each other over the marks that both see, in
/// stated standard deviations, the calibration's included. A camera that moved since its
/// calibration misses in every mark. Pairs of fewer than `least_marks` common marks are left out.
[[nodiscard]] std::vector<PairAgreement> pair_agreements(const std::vector<MarkViews>& marks,
                                                         const std::vector<Placed>& placed,
                                                         double min_angle_rad, int least_marks);

}  // namespace drape::triangulate
