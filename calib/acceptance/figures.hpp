// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "calib/acceptance/acceptance.hpp"
#include "calib/acceptance/draws.hpp"
#include "calib/acceptance/positions.hpp"

namespace drape::calib {

/// Inputs that all figures have in common.
struct FigureContext {
  const Draws* draws = nullptr;
  double noise_variance = 1;     ///< variance of the detections over the stated one
  double false_no_go = 0.001;    ///< probability of a false NO-GO for one figure
  double scale_uncertainty = 0;  ///< plate's size relative to the calibration's (1)
};

/// Point pairs of the measured lengths: two diagonals, the two longest edges and half a diagonal.
[[nodiscard]] std::vector<std::pair<MarkId, MarkId>> lengths_of(const Target& target);

/// Largest error of lengths_of() over all positions.
[[nodiscard]] AcceptanceFigure length_error(const std::vector<Position>& positions,
                                            const Plate& plate, const FigureContext& context,
                                            const AcceptanceOptions& options);

/// Range of the points' distances from their best-fit plane, after removal of the stated bow.
[[nodiscard]] AcceptanceFigure flatness(const std::vector<Position>& positions, const Plate& plate,
                                        const FigureContext& context,
                                        const AcceptanceOptions& options);

/// Distance between a stage and the first one along the plate's normal, compared with rig.toml.
[[nodiscard]] AcceptanceFigure shift_error(const std::vector<Position>& positions, const Rig& rig,
                                           const FigureContext& context,
                                           const AcceptanceOptions& options);

/// Range of the marks' distances from their best-fit sphere, and error of its diameter.
[[nodiscard]] std::vector<AcceptanceFigure> sphere_figures(const AcceptanceInput& input,
                                                           const Calibration& calibration,
                                                           const FigureContext& context,
                                                           const AcceptanceOptions& options);

/// Scatter of the target at rest relative to the detections' covariances.
[[nodiscard]] AcceptanceFigure noise_floor(const Detections& detections,
                                           const std::vector<std::string>& repeats,
                                           const AcceptanceOptions& options);

}  // namespace drape::calib
