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

/// Maximum permissible errors and what the test needs (after VDI/VDE 2634 and ISO 10360-13). An
/// error that is not stated here follows from the uncertainties of calibration, marks and print.
/// Where the operator states the length error, a change since the calibration that he thereby
/// permits is a warning.
struct AcceptanceOptions {
  std::optional<double> max_length_error_mm;
  std::optional<double> max_flatness_mm;
  std::optional<double> max_shift_error_mm;
  std::optional<double> max_sphere_form_mm;
  std::optional<double> max_sphere_size_mm;  ///< error of its diameter
  double max_noise_ratio = 1.5;        ///< scatter of repeats over the stated standard deviation
  double shift_uncertainty_mm = 0.01;  ///< standard uncertainty of a height in rig.toml
  int least_positions = 7;             ///< places of the target, five lengths each
  Eigen::Vector2d bow_mm = Eigen::Vector2d::Zero();  ///< bow of the plate, edges above the middle
  Eigen::Vector2d bow_sd_mm = Eigen::Vector2d::Zero();  ///< its standard uncertainty
  bool own_target = true;      ///< the plate measured here is the one that calibrated
  double false_no_go = 0.005;  ///< part of the instruments without a fault, all figures together
  int draws = 2000;            ///< number of Monte Carlo draws of the uncertainty
};
void fields(Fields& f, AcceptanceOptions& options);

/// A ball with the print on it: marks of known names on a sphere of known size.
struct SphereInput {
  Detections marks;
  double diameter_mm = 0;              ///< over the print
  double standard_uncertainty_mm = 0;  ///< standard uncertainty of the diameter
};

/// Detections behind a calibration, as far as its record tells.
struct CalibrationEvidence {
  std::optional<Detections> detections;  ///< detections that calibration.json's `sets` calibrated
  std::string file;                      ///< file of the detections
  std::string missing;                   ///< why there are none; a clause
};

struct AcceptanceInput {
  Detections target;
  std::vector<std::string> repeats;  ///< sets of the target at rest
  std::optional<SphereInput> sphere;
  CalibrationEvidence calibrated = {};
  std::string file = {};  ///< name of the file of `target`, for messages
};

/// One acceptance figure. Conformity is proven when value and U together stay within the limit
/// (ISO 14253-1).
struct AcceptanceFigure {
  std::string name, where;  ///< e.g. "length error", "set pose_03, (0, 0) to (8, 11)"
  std::string unit;
  double value = 0;           ///< largest found, not negative
  double expanded = 0;        ///< U: what 95 % of instruments without a fault stay within
  double limit = 0;           ///< maximum permissible error
  bool limit_stated = false;  ///< by the operator; otherwise it follows from the uncertainties
  std::string not_measured;   ///< why there is no value, and what to record; empty if there is one
  bool may_lack = false;      ///< acceptance is possible without it
  bool informs = false;       ///< beyond its limit it is a warning, see AcceptanceOptions
  /// Smallest fault that is named in 95 of 100 tests, with its unit.
  double smallest = 0;
  std::string smallest_unit;
  std::string cause;  ///< sentence about the fault, where the figure shows one fault alone

  [[nodiscard]] bool good() const { return not_measured.empty() && value + expanded <= limit; }
};

struct Acceptance {
  std::string calibration_sha256, rig;
  int positions = 0;  ///< places of the target; sets of one place are one
  std::vector<AcceptanceFigure> figures;
  std::string cause;                  ///< the one fault that explains most; empty without one
  std::vector<std::string> warnings;  ///< a change that the operator's own limits permit
  /// Parts of an acceptance in the sense of ISO 10360-13 and VDI/VDE 2634 that this test does not
  /// have; with any of them it is an interim check.
  std::vector<std::string> lacks;

  [[nodiscard]] bool good() const;
};

/// Measures a plate with the calibrated cameras, on sets that its calibration did not use: lengths
/// and flatness at each position, the heights of the z stage, a ball, the scatter of `repeats`; and
/// what would explain all sets together: the plate grown or bowed since, a camera moved, exchanged
/// or mirrored. Positions whose lengths all lie within 20 degrees of one plane are NO-GO: they test
/// no volume. It is an interim check where the plate calibrated the rig or has no calibrated
/// length, no limit is stated, or the positions reach over less than two thirds of what the
/// calibrating ones did along x, y or z. What rests on a NO-GO is NO-GO, and so are sets of names
/// that calibrated, where the pictures that calibrated are not known. Throws Error(bad_input) when
/// the detections are not of this target, no set is seen by two cameras, or a picture is there
/// twice or calibrated; Error(usage) where a set of `repeats` is not there.
[[nodiscard]] Acceptance accept(const AcceptanceInput& input, const Calibration& calibration,
                                const Rig& rig, const Target& target,
                                const AcceptanceOptions& options);

}  // namespace drape::calib
