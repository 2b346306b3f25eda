// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Some sets of a detections file.
struct PictureSource {
  const Detections& detections;
  std::string file;               ///< for messages; may be empty
  std::vector<std::string> sets;  ///< that count; empty: all
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
