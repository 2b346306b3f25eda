// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "core/detections.hpp"

namespace drape::calib {

/// Throws Error(bad_input) where two sets show one picture: it repeats nothing and no other place.
void refuse_pictures_twice(const Detections& detections);

/// Throws Error(bad_input) where a picture calibrated: it proves nothing of the calibration.
void refuse_pictures_of(const Detections& calibrated, const Detections& detections);

/// What calibrated, as the record beside calibration.json names it; absent where there is no record
/// of this file, or the detections are gone or changed.
[[nodiscard]] std::optional<Detections> detections_behind(const std::filesystem::path& calibration);

}  // namespace drape::calib
