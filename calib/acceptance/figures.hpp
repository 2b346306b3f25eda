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
  double false_no_go = 0.001;    ///< probability, for one figure
  double scale_uncertainty = 0;  ///< relative, plate's size against the calibration's (1)
};

/// Two diagonals, the two longest edges and half a diagonal of a plate.
[[nodiscard]] std::vector<std::pair<MarkId, MarkId>> lengths_of(const Target& target);

/// Largest error of lengths_of() at every position.
[[nodiscard]] AcceptanceFigure length_error(const std::vector<Position>& positions,
                                            const Plate& plate, const FigureContext& context,
                                            const AcceptanceOptions& options);

/// Range of the points' distances from the plane nearest to them, the stated bow taken out.
[[nodiscard]] AcceptanceFigure flatness(const std::vector<Position>& positions, const Plate& plate,
                                        const FigureContext& context,
                                        const AcceptanceOptions& options);

/// Distance of a stage from the first one along the plate's normal, against rig.toml.
[[nodiscard]] AcceptanceFigure shift_error(const std::vector<Position>& positions, const Rig& rig,
                                           const FigureContext& context,
                                           const AcceptanceOptions& options);

/// Range of the marks' distances from the sphere nearest to them, and its diameter's error.
[[nodiscard]] std::vector<AcceptanceFigure> sphere_figures(const AcceptanceInput& input,
                                                           const Calibration& calibration,
                                                           const FigureContext& context,
                                                           const AcceptanceOptions& options);

/// Scatter of the target at rest over what the detections' covariances state.
[[nodiscard]] AcceptanceFigure noise_floor(const Detections& detections,
                                           const std::vector<std::string>& repeats,
                                           const AcceptanceOptions& options);

}  // namespace drape::calib
