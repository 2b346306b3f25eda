// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Throws Error(bad_input) if a length measured on the target contradicts its pitch by more
/// than three standard uncertainties, including the `tolerance` (1) of the print: every
/// measured millimetre would be wrong by the same fraction. The message names the pitch that
/// would agree.
void check_known_lengths(const Target& target, double tolerance);

/// Relative standard uncertainty of the print's scale; 0 if no length was measured.
[[nodiscard]] double scale_uncertainty(const Target& target);

/// Sentence about the scale of the print.
[[nodiscard]] std::string print_scale_line(const Target& target);

/// A selection of sets in a detections file.
struct PictureSource {
  const Detections& detections;
  std::string file;               ///< for messages; can be empty
  std::vector<std::string> sets;  ///< cameras to consider; empty for all
};

/// Throws Error(bad_input) naming both frames if the same picture occurs twice, in two sets or for
/// two cameras: it carries the information of one view only.
void refuse_pictures_twice(const PictureSource& source);

/// Same, also if a picture of `tested` was used for calibration and so proves nothing.
void refuse_pictures_of(const PictureSource& calibrated, const PictureSource& tested);

/// Throws Error(bad_input) if rig.toml names a set of the target twice, which would count its views
/// twice.
void refuse_sets_twice(const Rig& rig);

}  // namespace drape::calib
