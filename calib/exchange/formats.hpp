// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/exchange/exchange.hpp"

namespace drape::calib {

/// A camera with a Brown lens, ready for export.
struct BrownCamera {
  std::string name;
  BrownLens lens;
  int width_px = 0, height_px = 0;
  CamFromWorld cam_from_world;
};

[[nodiscard]] std::vector<ExportedFile> opencv_files(const std::vector<BrownCamera>& cameras);
[[nodiscard]] std::vector<ExportedFile> kalibr_files(const std::vector<BrownCamera>& cameras);
[[nodiscard]] std::vector<ExportedFile> colmap_files(const std::vector<BrownCamera>& cameras);
[[nodiscard]] std::vector<ExportedFile> mrcal_files(const std::vector<BrownCamera>& cameras);

[[nodiscard]] Camera camera_of_opencv(const std::filesystem::path& file);
[[nodiscard]] Camera camera_of_mrcal(const std::filesystem::path& file);

/// Throws Error(bad_input) naming the file if the camera is invalid.
void check_imported(const Camera& camera, const std::filesystem::path& file);

}  // namespace drape::calib
