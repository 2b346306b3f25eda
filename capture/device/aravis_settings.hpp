// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "capture/device/aravis_features.hpp"
#include "capture/device/camera.hpp"

namespace drape::capture {

/// Ticks per second of the camera's clock, absent when the camera does not say.
[[nodiscard]] std::optional<double> tick_rate_hz(const AravisFeatures& features, bool is_gige);

/// Writes the settings in the order they depend on each other and reads all of them back; see
/// CameraDevice::configure().
[[nodiscard]] std::vector<SettingReadBack> configure_aravis(const AravisFeatures& features,
                                                            const CameraSettings& settings,
                                                            bool is_gige);

/// The same of exposure and gain alone.
[[nodiscard]] std::vector<SettingReadBack> set_aravis_light(const AravisFeatures& features,
                                                            const CameraSettings& settings);

}  // namespace drape::capture
