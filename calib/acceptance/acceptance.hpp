// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/fields/fields.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Maximum permissible errors and requirements of the test (after VDI/VDE 2634 and ISO 10360-13).
/// Limits that are not stated follow from the uncertainties of calibration, marks and print. If the
/// operator states the length error, a change since the calibration within that limit is only a
/// warning.
struct AcceptanceOptions {
  std::optional<double> max_length_error_mm;
  std::optional<double> max_flatness_mm;
  std::optional<double> max_shift_error_mm;
  std::optional<double> max_sphere_form_mm;
  std::optional<double> max_sphere_size_mm;  ///< limit for the error of the ball's diameter
  double max_noise_ratio = 1.5;  ///< largest ratio of the repeats' scatter to the stated deviation
  double shift_uncertainty_mm = 0.01;  ///< standard uncertainty of the heights in rig.toml
  int least_positions = 7;             ///< required positions of the target, with five lengths each
  Eigen::Vector2d bow_mm = Eigen::Vector2d::Zero();  ///< bow of the plate: edges above the centre
  Eigen::Vector2d bow_sd_mm = Eigen::Vector2d::Zero();  ///< standard uncertainty of the bow
  bool own_target = true;      ///< true if the plate measured here also calibrated the rig
  double false_no_go = 0.005;  ///< probability of NO-GO without a fault, for all figures together
  int draws = 2000;            ///< number of Monte Carlo draws
};

void fields(Fields& f, AcceptanceOptions& options);

/// A ball with printed marks: marks with known names on a sphere of known size.
struct SphereInput {
  Detections marks;
  double diameter_mm = 0;              ///< over the print
  double standard_uncertainty_mm = 0;  ///< standard uncertainty of the diameter
};

/// Detections that a calibration used, as far as its record identifies them.
struct CalibrationEvidence {
  std::optional<Detections> detections;  ///< detections of calibration.json's `sets`
  std::string file;                      ///< file of the detections
  std::string missing;                   ///< why there are none, as a clause
};

struct AcceptanceInput {
  Detections target;
  std::vector<std::string> repeats;  ///< sets of the target at rest
  std::optional<SphereInput> sphere;
  CalibrationEvidence calibrated = {};
  std::string file = {};  ///< file name of `target` for messages
};

/// One figure of merit. Conformity is proven if value plus U stays within the limit (ISO
/// 14253-1).
struct AcceptanceFigure {
  std::string name = {}, where = {};  ///< e.g. "length error", "set pose_03, (0, 0) to (8, 11)"
  std::string unit = {};
  double value = 0;     ///< largest absolute value found
  double expanded = 0;  ///< expanded uncertainty U: 95 % of faultless instruments stay within it
  double limit = 0;     ///< maximum permissible error
  bool limit_stated = false;  ///< true if given by the operator, else derived from uncertainties
  std::string not_measured = {};  ///< why there is no value, with the remedy; empty if there is one
  bool may_lack = false;          ///< true if acceptance is possible without this figure
  bool informs = false;           ///< exceeding the limit only warns, see AcceptanceOptions
  /// Smallest fault that 95 of 100 tests detect, with its unit.
  double smallest = 0;
  std::string smallest_unit = {};
  std::string cause = {};  ///< sentence about the fault, if the figure indicates a single one

  [[nodiscard]] bool good() const { return not_measured.empty() && value + expanded <= limit; }
};

struct Acceptance {
  std::string calibration_sha256, rig;
  int positions = 0;  ///< distinct positions of the target; sets at the same one count once
  std::vector<AcceptanceFigure> figures;
  std::string cause;  ///< the single fault that explains most; empty if there is none
  std::vector<std::string> warnings;  ///< changes within the limits set by the operator
  /// Parts of an acceptance by ISO 10360-13 and VDI/VDE 2634 that this test lacks; any of them
  /// makes it an interim check.
  std::vector<std::string> lacks;

  [[nodiscard]] bool good() const;
};

/// Measures a plate with the calibrated cameras, on sets that were not used for calibration:
/// lengths and flatness at each position, heights of the z stage, a ball, scatter of `repeats`.
/// Also looks for a common cause: plate grown or bowed, camera moved, exchanged or mirrored.
/// Positions whose lengths all lie within 20 degrees of one plane are NO-GO, since they test no
/// volume. The test is only an interim check if the plate calibrated the rig or has no calibrated
/// length, if no limit is stated, or if the positions span less than two thirds of the
/// calibration's extent along x, y or z. A NO-GO input makes the result NO-GO, and so do sets named
/// like calibrating ones if the calibration's pictures are unknown.
/// Throws Error(bad_input) if the detections are of another target, no set is seen by two cameras,
/// or a picture occurs twice or calibrated; Error(usage) if a set of `repeats` is missing.
[[nodiscard]] Acceptance accept(const AcceptanceInput& input, const Calibration& calibration,
                                const Rig& rig, const Target& target,
                                const AcceptanceOptions& options);

/// Validity as ISO dates; both empty if the operator states none.
struct AcceptanceDates {
  std::string on, valid_until;
};

/// Dates from `on` to `valid_days` later. Throws Error(usage) for an invalid date or 0 days.
[[nodiscard]] AcceptanceDates dates_of(const std::string& on, int valid_days);

/// Test protocol as one printable HTML page without scripts.
[[nodiscard]] std::string protocol_page(const Acceptance& acceptance, const AcceptanceDates& dates);

}  // namespace drape::calib
