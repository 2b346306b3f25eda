// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Throws Error(bad_input) when a length that the operator measured on the target contradicts its
/// pitch by more than three standard uncertainties, with the `tolerance` (1) of a print that may be
/// off: every measured millimetre would be wrong by the same fraction. Names the pitch that would
/// agree.
void check_known_lengths(const Target& target, double tolerance);

/// Standard uncertainty of the print's scale (1), 0 when no length was measured.
[[nodiscard]] double scale_uncertainty(const Target& target);

/// Sentence about the print's scale, for people.
[[nodiscard]] std::string print_scale_line(const Target& target);

/// Some sets of a detections file.
struct PictureSource {
  const Detections& detections;
  std::string file;               ///< for messages; may be empty
  std::vector<std::string> sets;  ///< cameras that count; empty: all
};

/// Throws Error(bad_input) naming both frames where one picture is there twice, in two sets or for
/// two cameras: it holds one view's information.
void refuse_pictures_twice(const PictureSource& source);

/// The same, and where a picture of `tested` calibrated: it proves nothing of the calibration.
void refuse_pictures_of(const PictureSource& calibrated, const PictureSource& tested);

/// Throws Error(bad_input) where rig.toml names a set of the target twice: its views would count
/// twice.
void refuse_sets_twice(const Rig& rig);

}  // namespace drape::calib
