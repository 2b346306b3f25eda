// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Maximum permissible errors and what the test needs (after VDI/VDE 2634-1 and ISO 10360-13).
struct AcceptanceOptions {
  double max_length_error_mm = 0.1;  ///< twice the bench's error budget of 0.05 mm
  double max_flatness_mm = 0.2;      ///< of the target's plate as measured: one length error a side
  double max_shift_error_mm = 0.1;   ///< of a known shift on the z stage
  double max_noise_ratio = 1.5;      ///< scatter of repeats over the stated standard deviation
  double shift_uncertainty_mm = 0.01;  ///< standard uncertainty of a height in rig.toml
  int least_positions = 7;             ///< of the target, five lengths each

  /// Throws Error(usage) naming an option that makes no sense.
  void check() const;
};

/// One acceptance figure. Conformity is proven when value and U together stay within the limit
/// (ISO 14253-1).
struct AcceptanceFigure {
  std::string name, where;  ///< e.g. "length error", "set pose_03, (0, 0) to (8, 11)"
  std::string unit;
  double value = 0;          ///< largest found, not negative
  double expanded = 0;       ///< its expanded uncertainty U (k = 2)
  double limit = 0;          ///< maximum permissible error
  std::string not_measured;  ///< why there is no value, and what to record; empty when there is one

  [[nodiscard]] bool good() const { return not_measured.empty() && value + expanded <= limit; }
};

struct Acceptance {
  std::string calibration_sha256, rig;
  int positions = 0;
  std::vector<AcceptanceFigure> figures;

  [[nodiscard]] bool good() const;
};

/// Measures the target itself with the calibrated cameras, on sets that its calibration did not
/// use: lengths on the plate and its flatness at each position, the heights of the z stage, and the
/// scatter of `repeats`, sets of the target at rest. Only the shift may lack (a rig of one stage).
/// Throws Error(bad_input) when the detections are not of this target or no set is seen by two
/// cameras.
[[nodiscard]] Acceptance accept(const Detections& detections, const Calibration& calibration,
                                const Rig& rig, const Target& target,
                                const std::vector<std::string>& repeats,
                                const AcceptanceOptions& options);

/// The protocol as one HTML page without scripts, for printing.
[[nodiscard]] std::string protocol_page(const Acceptance& acceptance, const std::string& date);

}  // namespace drape::calib
